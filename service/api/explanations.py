"""How is an explanation given without holding up anything else? By a process beside the server, for a time.

To explain is to look again at what a run saw, which takes milliseconds or minutes, as the window and the traffic are.
In a thread it would take the interpreter from all other answers, and nothing could end it. A process can be ended:
it only reads.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeVar

import msgspec
from anyio import BrokenWorkerProcess, CapacityLimiter, fail_after, to_process

from chronicles.explanation.json_form import to_json
from service.errors import UnansweredError
from service.machine import cores, look_seldom
from service.questions.coverage import Coverage
from service.questions.explaining import AbsenceQuestion, Explainer
from service.questions.relation_intervals import RelationQuestion, relation_intervals
from service.store.log import EventLog, open_log

ANSWERED_WITHIN_S = 10.0

_About = TypeVar("_About")
_Answer = TypeVar("_Answer")


class Explanations:
    """Gives the explanations of one log, as JSON.

    As many questions as there are cores are answered at once; others wait, which counts as theirs.

    Parameters
    ----------
    log : its URL.
    within_s : how long an answer may take.
    """

    def __init__(self, log: str, within_s: float = ANSWERED_WITHIN_S) -> None:
        self._log = log
        self._within_s = within_s
        self._limiter = CapacityLimiter(cores())

    async def why(self, event_id: str) -> bytes | None:
        """Explain an event; None if the log has no such event.

        Raises
        ------
        UnansweredError
            If it takes too long; besides, what `Explainer.explain_event` raises.
        """
        return await self._ask(_why, event_id)

    async def why_not(self, question: AbsenceQuestion) -> bytes:
        """Explain the absence of a chronicle.

        Raises
        ------
        UnansweredError
            If it takes too long; besides, what `Explainer.explain_absence` raises.
        """
        return await self._ask(_why_not, question)

    async def awaited(self, question: AbsenceQuestion) -> bytes:
        """Say what a chronicle waits for; raises as `why_not`."""
        return await self._ask(_awaited, question)

    async def relations(self, question: RelationQuestion) -> bytes:
        """Say which relations held; raises as `relation_intervals`, and as `why`."""
        return await self._ask(_relations, question)

    async def trial(self, question: AbsenceQuestion, text: str) -> bytes:
        """Try a text; raises as `why`."""
        return await self._ask(_trial, (question, text))

    async def difference(self, question: AbsenceQuestion, before: str, after: str) -> bytes:
        """Compare two texts; raises as `why`."""
        return await self._ask(_difference, (question, before, after))

    async def unfit(self, path: str) -> str:
        """Say why a file is no video, or nothing: FFmpeg may crash or take long at what somebody made up."""
        return await self._ask(_unfit, path)

    async def _ask(self, explained: Callable[[str, _About], _Answer], about: _About) -> _Answer:
        try:
            with fail_after(self._within_s):
                return await to_process.run_sync(explained, self._log, about, cancellable=True, limiter=self._limiter)
        except TimeoutError as error:
            wanted = f"explanation: expected one within {self._within_s:g} s, got none"
            raise UnansweredError(f"{wanted}; ask about less time, or later if much else is asked") from error
        except BrokenWorkerProcess as error:
            raise UnansweredError("explanation: expected one, got a process that was ended; ask again") from error


# What follows runs in such a process, which stays for the questions to come.


def _why(log: str, event_id: str) -> bytes | None:
    found = _explainer(log).explain_event(event_id)
    return None if found is None else msgspec.json.encode(found.as_record())


def _why_not(log: str, question: AbsenceQuestion) -> bytes:
    return msgspec.json.encode(to_json(_explainer(log).explain_absence(question)))


def _awaited(log: str, question: AbsenceQuestion) -> bytes:
    return msgspec.json.encode(_explainer(log).awaited(question))


def _relations(log: str, question: RelationQuestion) -> bytes:
    return msgspec.json.encode(relation_intervals(_opened(log), question, _coverage(log)))


def _trial(log: str, about: tuple[AbsenceQuestion, str]) -> bytes:
    return msgspec.json.encode(_explainer(log).try_text(*about))


def _difference(log: str, about: tuple[AbsenceQuestion, str, str]) -> bytes:
    return msgspec.json.encode(_explainer(log).compare_texts(*about))


def _unfit(_: str, path: str) -> str:
    from vision.video.decoding import unfit

    return unfit(path)


@cache
def _explainer(log: str) -> Explainer:
    return Explainer(_opened(log))


@cache
def _coverage(log: str) -> Coverage:
    return Coverage(_opened(log))


@cache
def _opened(log: str) -> EventLog:
    look_seldom()
    return open_log(log)
