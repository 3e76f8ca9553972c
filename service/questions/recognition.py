"""Do other chronicles occur in what was stored? Recognition over the events of a log or a file."""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Occurrence
from chronicles.execution.unfit_events import unfit_events
from chronicles.recogniser import Recogniser, recognise
from service.errors import QueryError
from service.monitoring.monitor_messages import messages_of_run
from service.questions.event_files import load_events
from service.questions.recognised_events import RecognisedEvent, recognised_events
from service.questions.stored_events import (
    StoredEvents,
    refuse_thinned,
    relations_of,
    stored_events,
    unwatched_relations,
)
from service.records import RunRecord
from service.store.location import is_log_name
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import LoadedChronicles, load_chronicle_files
from service.texts.idle_chronicles import idle_in_file, idle_in_stream, unfit_told
from service.texts.text_streams import Stream


@dataclass(frozen=True, slots=True)
class Recognised:
    """Hold what was recognised, how many events came too late to take part, and doubts about the question.

    `stream` is what the texts were taken to be about, `doubts` are the warnings that `dyknow check` gives of them.
    """

    events: Sequence[RecognisedEvent]
    late_count: int
    warnings: tuple[str, ...]
    stream: Stream
    doubts: tuple[str, ...] = ()


def recognise_stored(
    source: str,
    chronicle_files: Sequence[Path],
    *,
    run: str | None = None,
    executor: str | None = None,
    lateness_us: int | None = None,
    stream: Stream | None = None,
    until_us: int | None = None,
    site_file: Path | None = None,
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
    stream : what the texts are about, for a file of events; None leaves it to them. A log has DyKnow's relations.
    until_us : how far time goes on in a file of events; None: to its last event. A log says so itself.
    site_file : of the run, for relations that it did not watch; None for where the site file was.

    Raises
    ------
    QueryError
        If something is asked of a file of events that only a log has, or the other way round.
    LogError, InputError, ChronicleError
        If the source or the chronicles cannot be used, or the executor cannot take events one by one.
    """
    with ExitStack() as closing:
        if is_log_name(source):
            _refuse("a file of events", "a log", stream=stream, until=until_us)
            log = closing.enter_context(open_log(source))
            record = log.run(run)
            loaded, (stored, warnings) = _read_log(source, log, record, chronicle_files, site_file)
        else:
            _refuse("a log", "a file of events", run=run, site=site_file)
            log, record = None, RunRecord(id="", source=Path(source).name, start_utc_us=0)
            loaded = load_chronicle_files(chronicle_files, stream)
            stored, warnings = _read_file(source, loaded.merged, until_us)
        found, late_count, left_out = _found(loaded.merged, stored, executor, lateness_us)
        beyond = (f"{source}: chronicle {name}: {count} instances were left out" for name, count in left_out.items())
        events = tuple(recognised_events(found, record, log))
        return Recognised(events, late_count, (*warnings, *beyond), loaded.stream, loaded.doubts)


def _found(
    chronicles: ChronicleSet, stored: StoredEvents, executor: str | None, lateness_us: int | None
) -> tuple[Sequence[Occurrence], int, Mapping[str, int]]:
    """Give what occurs, how many events came too late, and how many instances of each chronicle were left out."""
    if lateness_us is None:
        left_out: Counter[str] = Counter()
        executor = executor or "backfill"
        found = recognise(chronicles, stored.events, until_us=stored.until_us, executor=executor, left_out=left_out)
        return found, 0, left_out
    recogniser = Recogniser(chronicles, lateness_us, executor=executor or "eager")
    found = [occurrence for event in stored.events for occurrence in recogniser.observe(event)]
    found += recogniser.advance(stored.until_us + lateness_us)
    return found, recogniser.late_count, recogniser.left_out


def _refuse(expected: str, came: str, **options: object) -> None:
    """Refuse options that would change nothing."""
    for name, value in options.items():
        if value is not None:
            raise QueryError(f"--{name}: expected {expected} to go with it, got {came}", parameter=name)


# Each gives the events and, as warnings, what the chronicles look for in vain.
_Read = tuple[StoredEvents, tuple[str, ...]]


def _read_file(source: str, chronicles: ChronicleSet, until_us: int | None) -> _Read:
    events = load_events(Path(source))
    latest_us = max((event.t_us for event in events), default=0)
    end_us = latest_us if until_us is None else until_us
    if end_us < latest_us:
        expected = f"expected a time not before the last event ({latest_us} us)"
        raise QueryError(f"--until: {expected}, got {end_us} us", parameter="until")
    return StoredEvents(tuple(events), end_us), idle_in_file(source, chronicles, events)


def _read_log(
    source: str, log: EventLog, run: RunRecord, chronicle_files: Sequence[Path], site_file: Path | None
) -> tuple[LoadedChronicles, _Read]:
    messages = messages_of_run(run)
    loaded = load_chronicle_files(chronicle_files, messages=messages)
    refuse_thinned(run)
    asked = relations_of(loaded.merged)
    stored = stored_events(log, run.id, computed=unwatched_relations(log, run, asked, site_file))
    unfit = unfit_told(source, loaded.merged, unfit_events(loaded.merged, stored.events), is_traffic=True)
    return loaded, (stored, (*idle_in_stream(source, loaded.merged, messages), *unfit))
