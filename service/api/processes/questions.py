"""How is what takes long computed without holding up anything else? By a process beside the server, for a time.

In a thread it would take the interpreter from all other answers, and nothing could end it. A process can be ended where
it only reads. What is asked of one looks again at what a run saw, or reads files of others, which takes milliseconds or
minutes: all functions here that take a `log`.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeVar, TypeVarTuple

import msgspec
from anyio import BrokenWorkerProcess, CapacityLimiter, fail_after, to_process
from msgspec.structs import asdict

from chronicles.explanation.json_form import to_json
from service.api.messages.bodies import EventSummary, MonitorTrial
from service.errors import CrowdedError, TextRefusedError, UnansweredError
from service.questions.events.queries import MAX_LIMIT, EventFilter
from service.questions.events.summaries import By, summarise
from service.questions.observations.coverage import Coverage, LookedAt
from service.questions.observations.relation_intervals import RelationQuestion, relation_intervals
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.runs.machine import cores, look_seldom
from service.store.log import EventLog, open_log

ANSWERED_WITHIN_S = 10.0
"""An answer, with the time that it waits for a process."""

WAITING_PER_CORE = 8
"""More would wait longer than they may, if each before them takes what it may."""

_Arguments = TypeVarTuple("_Arguments")
_Answer = TypeVar("_Answer")


class ProcessPool:
    """Processes that answer questions to one log, as many as there are cores; they stay for the questions to come.

    Parameters
    ----------
    log : its URL.
    """

    def __init__(self, log: str) -> None:
        self._log = log
        self._limiter = CapacityLimiter(cores())

    @property
    def waiting(self) -> int:
        """Count the questions that wait for a process."""
        return self._limiter.statistics().tasks_waiting

    async def ask(self, function: Callable[[str, *_Arguments], _Answer], *arguments: *_Arguments) -> _Answer:
        """Call a function of a module with the log and more, in a process; what it takes, gives or raises is pickled.

        Raises
        ------
        CrowdedError
            If too many wait already.
        UnansweredError
            If it takes too long; besides, what the function raises.
        """
        most = WAITING_PER_CORE * int(self._limiter.total_tokens)
        if self.waiting >= most:
            raise CrowdedError(f"questions: expected at most {most} that wait, got one more; ask again later")
        try:
            with fail_after(ANSWERED_WITHIN_S):
                return await to_process.run_sync(
                    function, self._log, *arguments, cancellable=True, limiter=self._limiter
                )
        except TimeoutError as error:
            wanted = f"answer: expected one within {ANSWERED_WITHIN_S:g} s, got none"
            raise UnansweredError(f"{wanted}; ask about less time, or later if much else is asked") from error
        except BrokenWorkerProcess as error:
            raise UnansweredError("answer: expected one, got a process that was ended; ask again") from error


def why(log: str, event_id: str) -> bytes | None:
    """Explain an event; None if the log has no such event."""
    found = _explainer(log).explain_event(event_id)
    return None if found is None else msgspec.json.encode(found.as_record())


def why_not(log: str, question: AbsenceQuestion) -> bytes:
    """Explain the absence of a chronicle."""
    return msgspec.json.encode(to_json(_explainer(log).explain_absence(question)) | _looked_at(log, question.run))


def awaited(log: str, question: AbsenceQuestion) -> bytes:
    """Say what a chronicle waits for."""
    return msgspec.json.encode(asdict(_explainer(log).awaited(question)) | _looked_at(log, question.run))


def relations(log: str, question: RelationQuestion, cursor: str | None) -> bytes:
    """Say which relations held."""
    return msgspec.json.encode(relation_intervals(opened(log), question, _coverage(log), cursor=cursor))


def summary(log: str, wanted: EventFilter, by: By, bin_us: int | None, limit: int) -> bytes:
    """Count events."""
    as_of_seq, items = summarise(opened(log), wanted, by, bin_us=bin_us, limit=limit)
    return msgspec.json.encode(EventSummary(by, bin_us, as_of_seq, items, _coverage(log).beside(wanted)))


def trial(log: str, question: AbsenceQuestion, text: str) -> bytes:
    """Try a text."""
    return msgspec.json.encode(_explainer(log).try_text(question, text))


def difference(log: str, question: AbsenceQuestion, before: str, after: str) -> bytes:
    """Compare two texts."""
    return msgspec.json.encode(_explainer(log).compare_texts(question, before, after))


def site(log: str, run_id: str, form: str) -> bytes:
    """Tell the roads of a run, as JSON or GeoJSON."""
    from service.export.geojson import known_frame_of, site_features
    from service.questions.observations.run_sites import run_site

    run = opened(log).run(run_id)
    if form == "geojson":
        return site_features(run_site(run), known_frame_of(run))
    return msgspec.json.encode(run_site(run))


def monitors_tried(log: str, run_id: str | None, text: str) -> bytes:
    """Say what monitors would have told of a run."""
    from dyknow.errors import FormulaError
    from service.questions.recognition.stored_monitoring import monitor_run, verdicts

    run = opened(log).run(run_id)
    try:
        found = monitor_run(opened(log), run, [("text", text)])
    except FormulaError as error:
        raise TextRefusedError(str(error), error.diagnostics) from error
    told, looked_at = verdicts(found), _coverage(log).of_run(run)
    return msgspec.json.encode(MonitorTrial(run.id, len(told), told[:MAX_LIMIT], found.report, looked_at))


def unfit_video(_: str, path: str) -> str:
    """Say why a file is no video, or nothing: FFmpeg may crash or take long at what somebody made up."""
    from vision.video.decoding import unfit

    return unfit(path)


@cache
def opened(log: str) -> EventLog:
    """Open the log that a process is asked about."""
    look_seldom()
    return open_log(log)


def _looked_at(log: str, run: str | None) -> dict[str, list[LookedAt]]:
    return {"looked_at": _coverage(log).of_run(opened(log).run(run))}


@cache
def _explainer(log: str) -> Explainer:
    return Explainer(opened(log))


@cache
def _coverage(log: str) -> Coverage:
    return Coverage(opened(log))
