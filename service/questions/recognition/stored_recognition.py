"""Do other chronicles occur in what was stored? Recognition over the events of a log or a file."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Event, Occurrence
from chronicles.execution.unfit_events import UnfitCounter
from chronicles.recogniser import Recogniser, recognise
from service.errors import QueryError
from service.questions.observations.stored_events import (
    refuse_thinned,
    relations_of,
    streamed_events,
    unwatched_relations,
)
from service.questions.recognition.event_files import load_events
from service.questions.recognition.recognised_events import RecognisedEvent, recognised_events
from service.records.runs import RunRecord
from service.store.databases.location import is_log_name
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files
from service.texts.idle_chronicles import idle_in_file, idle_in_stream, unfit_told
from service.texts.monitor_messages import messages_of_run
from service.texts.text_streams import Stream

# Above this many events, some 200 MB, all that is at hand is what may still take part.
_MOST_AT_HAND = 1_000_000


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
            messages = messages_of_run(record)
            loaded = load_chronicle_files(chronicle_files, messages=messages)
            refuse_thinned(record)
            asked = relations_of(loaded.merged)
            unwatched = unwatched_relations(log, record, asked, site_file)
            events: Iterable[Event] = streamed_events(log, record.id, asked, unwatched, in_time=lateness_us is None)
            end_us, idle = log.last_us(record.id), idle_in_stream(source, loaded.merged, messages)
        else:
            _refuse("a log", "a file of events", run=run, site=site_file)
            log, record = None, RunRecord(id="", source=Path(source).name, start_utc_us=0)
            loaded = load_chronicle_files(chronicle_files, stream)
            events = load_events(Path(source))
            end_us, names = _end_us(events, until_us), {one.name for one in events}
            idle = idle_in_file(source, loaded.merged, names)
        counter = UnfitCounter(loaded.merged)
        found, late_count, left_out = _found(loaded.merged, _counted(events, counter), end_us, executor, lateness_us)
        unfit = unfit_told(source, loaded.merged, counter.found, is_traffic=log is not None)
        beyond = (f"{source}: chronicle {name}: {count} instances were left out" for name, count in left_out.items())
        told = tuple(recognised_events(found, record, log))
        return Recognised(told, late_count, (*idle, *unfit, *beyond), loaded.stream, loaded.doubts)


def _counted(events: Iterable[Event], counter: UnfitCounter) -> Iterator[Event]:
    for event in events:
        counter.count(event)
        yield event


def _found(
    chronicles: ChronicleSet, events: Iterator[Event], end_us: int, executor: str | None, lateness_us: int | None
) -> tuple[Sequence[Occurrence], int, Mapping[str, int]]:
    """Give what occurs, how many events came too late, and how many instances of each chronicle were left out.

    Backfill is quicker and needs all events at hand; so many that memory would tell are taken one by one.
    """
    if lateness_us is None:
        first = list(events if executor else islice(events, _MOST_AT_HAND))
        if executor or len(first) < _MOST_AT_HAND:
            left_out: Counter[str] = Counter()
            executor = executor or "backfill"
            return recognise(chronicles, first, until_us=end_us, executor=executor, left_out=left_out), 0, left_out
        events = chain(first, events)
    recogniser = Recogniser(chronicles, lateness_us or 0)
    found = [occurrence for event in events for occurrence in recogniser.observe(event)]
    found += recogniser.advance(end_us + (lateness_us or 0))
    return found, recogniser.late_count, recogniser.left_out


def _refuse(expected: str, came: str, **options: object) -> None:
    """Refuse options that would change nothing."""
    for name, value in options.items():
        if value is not None:
            raise QueryError(f"--{name}: expected {expected} to go with it, got {came}", parameter=name)


def _end_us(events: Sequence[Event], until_us: int | None) -> int:
    latest_us = max((event.t_us for event in events), default=0)
    end_us = latest_us if until_us is None else until_us
    if end_us < latest_us:
        expected = f"expected a time not before the last event ({latest_us} us)"
        raise QueryError(f"--until: {expected}, got {end_us} us", parameter="until")
    return end_us
