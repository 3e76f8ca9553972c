"""How do occurrences that were found in what is stored look as events, in the form in which a log tells its own?"""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from chronicles.events import Occurrence
from service.records import EventRecord, Place, RunRecord
from service.runs.event_drafts import STALE_US, event_drafts
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
    for one in occurrences:
        place = None if log is None else _place(log, run.id, one.roles, one.start_us)
        for draft in event_drafts(one, place):
            yield RecognisedEvent(EventRecord.of(draft, run), one)


def _place(log: EventLog, run_id: str, roles: Mapping[str, str], t_us: int) -> Place | None:
    """Find where an event began, as runs do: where the first role that is a car, and was seen then, was."""
    for symbol in roles.values():
        for row in reversed(list(log.states(run_id, car=symbol, from_us=t_us - STALE_US, to_us=t_us + 1))):
            return Place(row.road, row.x_m, row.y_m)
    return None
