"""How do occurrences that were found in what is stored look as events, in the form in which a log tells its own?"""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

from chronicles.events import Occurrence
from service.records.events import EventRecord, Place
from service.records.runs import RunRecord
from service.records.seen import CarState
from service.runs.graph.rows import STALE_US, event_drafts
from service.store.chunks.kinds import SPAN_US
from service.store.log import EventLog


class RecognisedEvent(NamedTuple):
    """An event that is in no log, and the occurrence that it tells of."""

    event: EventRecord
    occurrence: Occurrence


def recognised_events(
    occurrences: Iterable[Occurrence], run: RunRecord, log: EventLog | None
) -> Iterator[RecognisedEvent]:
    """Give the events of some occurrences.

    Parameters
    ----------
    run : in which they were found; it names the source of a file of events, too.
    log : that of the run, which tells where its cars were; None for a file of events.
    """
    told = list(occurrences)
    places = [None] * len(told) if log is None else stored_places(log, run.id, told)
    for one, place in zip(told, places, strict=True):
        for draft in event_drafts(one, place):
            yield RecognisedEvent(EventRecord.of(draft, run), one)


def stored_places(log: EventLog, run_id: str, occurrences: Sequence[Occurrence]) -> list[Place | None]:
    """Find where each occurrence began, as runs do: where the first role that is a car, and was seen then, was."""
    places: list[Place | None] = [None] * len(occurrences)
    by_start = sorted(range(len(occurrences)), key=lambda k: occurrences[k].start_us)
    # What begins in one span is looked up in it together: to read a span costs as much as to read a car of it.
    for _, group in groupby(by_start, lambda k: occurrences[k].start_us // SPAN_US):
        together = list(group)
        names = {name for k in together for name in occurrences[k].roles.values()}
        from_us, to_us = (occurrences[k].start_us for k in (together[0], together[-1]))
        rows: dict[str, list[CarState]] = {}
        for row in log.states(run_id, cars=names, from_us=from_us - STALE_US, to_us=to_us + 1):
            rows.setdefault(row.car, []).append(row)
        for k in together:
            one = occurrences[k]
            found = (_at(rows.get(name, ()), one.start_us) for name in one.roles.values())
            places[k] = next((Place(row.road, row.x_m, row.y_m) for row in found if row), None)
    return places


def _at(rows: Sequence[CarState], t_us: int) -> CarState | None:
    """Give the last row of a car up to a time, if it is not much older."""
    before = bisect_right(rows, t_us, key=attrgetter("t_us"))
    return rows[before - 1] if before and rows[before - 1].t_us >= t_us - STALE_US else None
