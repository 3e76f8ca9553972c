"""How does the server explain? By looking again, in a process of its pool, at what a run saw.

That takes milliseconds or minutes, as the window and the traffic are.
"""

from functools import cache

import msgspec

from chronicles.explanation.json_form import to_json
from service.api.bodies import EventSummary
from service.api.process_pool import ProcessPool
from service.machine import look_seldom
from service.questions.coverage import Coverage
from service.questions.explaining import AbsenceQuestion, Explainer
from service.questions.queries import EventFilter
from service.questions.relation_intervals import RelationQuestion, relation_intervals
from service.questions.summaries import By, summarise
from service.store.log import EventLog, open_log


class Explanations:
    """Gives the explanations of one log, as JSON.

    Parameters
    ----------
    log : its URL.
    pool : whose processes look; its errors are raised besides those of `Explainer`.
    """

    def __init__(self, log: str, pool: ProcessPool) -> None:
        self._log, self._pool = log, pool

    async def why(self, event_id: str) -> bytes | None:
        """Explain an event; None if the log has no such event."""
        return await self._pool.ask(_why, self._log, event_id)

    async def why_not(self, question: AbsenceQuestion) -> bytes:
        """Explain the absence of a chronicle."""
        return await self._pool.ask(_why_not, self._log, question)

    async def awaited(self, question: AbsenceQuestion) -> bytes:
        """Say what a chronicle waits for."""
        return await self._pool.ask(_awaited, self._log, question)

    async def relations(self, question: RelationQuestion) -> bytes:
        """Say which relations held."""
        return await self._pool.ask(_relations, self._log, question)

    async def summary(self, wanted: EventFilter, by: By, bin_us: int | None, limit: int) -> bytes:
        """Count events."""
        return await self._pool.ask(_summary, self._log, wanted, by, bin_us, limit)

    async def trial(self, question: AbsenceQuestion, text: str) -> bytes:
        """Try a text."""
        return await self._pool.ask(_trial, self._log, (question, text))

    async def difference(self, question: AbsenceQuestion, before: str, after: str) -> bytes:
        """Compare two texts."""
        return await self._pool.ask(_difference, self._log, (question, before, after))

    async def unfit(self, path: str) -> str:
        """Say why a file is no video, or nothing: FFmpeg may crash or take long at what somebody made up."""
        return await self._pool.ask(_unfit, self._log, path)


# What follows runs in such a process.


def _why(log: str, event_id: str) -> bytes | None:
    found = _explainer(log).explain_event(event_id)
    return None if found is None else msgspec.json.encode(found.as_record())


def _why_not(log: str, question: AbsenceQuestion) -> bytes:
    return msgspec.json.encode(to_json(_explainer(log).explain_absence(question)))


def _awaited(log: str, question: AbsenceQuestion) -> bytes:
    return msgspec.json.encode(_explainer(log).awaited(question))


def _relations(log: str, question: RelationQuestion) -> bytes:
    return msgspec.json.encode(relation_intervals(_opened(log), question, _coverage(log)))


def _summary(log: str, wanted: EventFilter, by: By, bin_us: int | None, limit: int) -> bytes:
    as_of_seq, items = summarise(_opened(log), wanted, by, bin_us=bin_us, limit=limit)
    return msgspec.json.encode(EventSummary(by, bin_us, as_of_seq, items, _coverage(log).beside(wanted)))


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
