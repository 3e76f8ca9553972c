"""What is asked in a process? What looks again at what a run saw, and what reads files of others.

That takes milliseconds or minutes, as the window and the traffic are. What takes a `log` runs in such a process.
"""

from functools import cache

import msgspec
from msgspec.structs import asdict

from chronicles.explanation.json_form import to_json
from service.api.messages.bodies import EventSummary, MonitorTrial
from service.errors import TextRefusedError
from service.questions.events.queries import MAX_LIMIT, EventFilter
from service.questions.events.summaries import By, summarise
from service.questions.observations.coverage import Coverage, LookedAt
from service.questions.observations.relation_intervals import RelationQuestion, relation_intervals
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.runs.machine import look_seldom
from service.store.log import EventLog, open_log


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
