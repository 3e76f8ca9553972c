"""What should somebody know who asks for events? Which runs are no whole ones, and which names no log holds."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any  # a column of any type

from sqlalchemy import ColumnElement, select

from dyknow.language.diagnostics import hinted
from service.questions.events.queries import EventFilter
from service.records.runs import RunRecord, RunStatus
from service.records.times import format_media
from service.store.log import EventLog
from service.store.schema import cars, event_roles, events, role_names

_STATES: Mapping[RunStatus, str] = {
    "running": "is being written still, or was killed",
    "broken": "broke off",
    "interrupted": "was interrupted",
    "failed": "failed",
}
_EMITTED = re.compile(r"\bemit\s+(\w+)")


def run_notes(logs: Iterable[EventLog], wanted: EventFilter) -> Iterator[str]:
    """Say of each run that was asked for and did not come to its end how it ended, and what time it covers."""
    for log in logs:
        for run in log.runs():
            is_wanted = run.id in (wanted.runs or (run.id,)) and run.source in (wanted.sources or (run.source,))
            if is_wanted and run.status != "finished":
                reason = f"; {run.reason}" if run.reason else ""
                yield f"run {run.id!r} of {run.source} {_STATES[run.status]}; it covers {covered(log, run)}{reason}"


def covered(log: EventLog, run: RunRecord) -> str:
    """Write what time a run has frames of."""
    span = log.covered_us(run.id)
    return "no time" if span is None else f"{format_media(span[0])} to {format_media(span[1])}"


def name_notes(logs: Sequence[EventLog], wanted: EventFilter) -> Iterator[str]:
    """Say which of the names asked for none of the logs holds, with the nearest that one does.

    This reads much of the logs: ask when nothing was found.
    """
    for what, names in wanted.named().items():
        known = {one for log in logs for one in _known(log, what)} if names else set[str]()
        for name in names:
            if name not in known:
                yield f"{what}: expected one that the log holds, got {name!r}{hinted(name, known)}"


def _known(log: EventLog, what: str) -> set[str]:
    """List the names of a kind that a log holds; a type is known too if a chronicle of a run could give it."""
    runs = log.runs()
    match what:
        case "type":
            from service.texts.monitor_messages import messages_of_run  # loads all of chronicles and monitors

            given = {one.name for run in runs for one in run.chronicles}
            given |= {name for run in runs for name in messages_of_run(run)}
            emitted = {name for run in runs for one in run.chronicles for name in _EMITTED.findall(one.text)}
            return given | emitted | _distinct(log, events.c.type)
        case "road":
            return _distinct(log, events.c.road) | {one.road for run in runs for one in log.states(run.id)} - {""}
        case "source":
            return {run.source for run in runs}
        case "run":
            return {run.id for run in runs}
        case "role":
            return _distinct(log, role_names.c.role)
        case _:
            return _distinct(log, cars.c.car) | _distinct(log, event_roles.c.actor)


def _distinct(log: EventLog, column: ColumnElement[Any]) -> set[str]:
    with log.connect() as connection:
        return set(connection.scalars(select(column).distinct()))
