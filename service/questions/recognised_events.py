"""How do occurrences that were found in what is stored look as events, in the form in which a log tells its own?"""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

from chronicles.events import Occurrence
from service.records import CarState, EventRecord, Place, RunRecord
from service.runs.event_drafts import STALE_US, event_drafts
from service.store.chunks import SPAN_US
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
    places = None if log is None else _Places(log, run.id)
    for one in occurrences:
        place = None if places is None else places.of(one.roles, one.start_us)
        for draft in event_drafts(one, place):
            yield RecognisedEvent(EventRecord.of(draft, run), one)


class _Places:
    """Finds where events began, as runs do: where the first role that is a car was then."""

    def __init__(self, log: EventLog, run_id: str) -> None:
        self._log = log
        self._run_id = run_id
        self._cars_in = lru_cache(maxsize=4)(self._read)

    def of(self, roles: Mapping[str, str], t_us: int) -> Place | None:
        """Find the place of an event that began at a time; None if no role is a car that was seen then."""
        cars = self._cars_in(t_us // SPAN_US)
        for symbol in roles.values():
            rows = cars.get(symbol, ())
            before = bisect_right(rows, t_us, key=lambda row: row.t_us)
            if before and rows[before - 1].t_us >= t_us - STALE_US:
                row = rows[before - 1]
                return Place(row.road, row.x_m, row.y_m)
        return None

    def _read(self, span: int) -> Mapping[str, list[CarState]]:
        cars = defaultdict[str, list[CarState]](list)
        from_us = span * SPAN_US
        for row in self._log.states(self._run_id, from_us=from_us - STALE_US, to_us=from_us + SPAN_US):
            cars[row.car].append(row)
        return cars
