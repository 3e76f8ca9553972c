"""Do other chronicles occur in what was stored? Recognition over the events of a log or a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from chronicles.recognition import recognise
from service.chronicle_files import load_chronicle_files
from service.event_files import load_events
from service.store.location import is_log_name
from service.store.log import open_log
from service.stored_events import check_watched, stored_events


@dataclass(frozen=True, slots=True)
class StoredInput:
    """Hold events in the order in which they came, and the time up to which they are complete (None: the latest)."""

    events: Sequence[Event]
    until_us: int | None


@dataclass(frozen=True, slots=True)
class Recognised:
    """Hold what was recognised, and how many events came too late to take part."""

    occurrences: Sequence[Occurrence]
    late_count: int


def read_stored(source: str, chronicles: ChronicleSet, run: str | None = None) -> StoredInput:
    """Read the events of a run of a log, or of a `.jsonl` or `.csv` file.

    Raises
    ------
    LogError, InputError
        If the source cannot be read, or the run did not watch a relation that the chronicles look at.
    """
    if not is_log_name(source):
        return StoredInput(load_events(Path(source)), None)
    with open_log(source) as log:
        record = log.run(run)
        check_watched(record, chronicles)
        stored = stored_events(log, record.id)
    return StoredInput(stored.events, stored.until_us)


def recognise_stored(
    source: str,
    chronicle_files: Sequence[Path],
    *,
    run: str | None = None,
    executor: str | None = None,
    lateness_us: int | None = None,
) -> Recognised:
    """Recognise chronicles in stored events.

    Parameters
    ----------
    source : an event log, or a file of events.
    chronicle_files : their texts; none means the shipped library.
    run : which run of a log; may be left out when there is only one.
    executor : who finds them; all find the same. None is "backfill", or "eager" with a lateness.
    lateness_us : None takes the events as complete and sorts them. A number takes them as they come, one by one in the
        order of the source, as if they happened now; those later than that are left out and counted.

    Raises
    ------
    LogError, InputError, ChronicleError
        If the source or the chronicles cannot be used, or the executor cannot take events one by one.
    """
    chronicles = load_chronicle_files(chronicle_files).merged
    stored = read_stored(source, chronicles, run)
    if lateness_us is None:
        found = recognise(chronicles, stored.events, until_us=stored.until_us, executor=executor or "backfill")
        return Recognised(found, 0)
    recogniser = Recogniser(chronicles, lateness_us, executor=executor or "eager")
    live = [occurrence for event in stored.events for occurrence in recogniser.observe(event)]
    latest_us = max((event.t_us for event in stored.events), default=0)
    until_us = latest_us if stored.until_us is None else stored.until_us
    live += recogniser.advance(until_us + lateness_us)
    return Recognised(live, recogniser.late_count)
