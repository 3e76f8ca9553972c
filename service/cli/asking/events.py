"""`dyknow events`: which events are in a log?"""

import heapq
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from enum import StrEnum
from itertools import chain, islice
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.options import AsJson, MinConfidence, open_log, read_roles
from service.cli.printing import NOTHING_FOUND, format_table, print_json_list, shown_roles, tell, write_blocks
from service.records.times import TimePoint, format_media, parse_time

if TYPE_CHECKING:
    from service.questions.events.queries import EventFilter
    from service.records.events import EventRecord
    from service.store.log import EventLog

TABLE_LIMIT = 100
AT_ONCE = 1_000  # events that are written
TITLES = ("start", "end", "type", "roles", "road", "status", "sure", "source", "id")

# The words are those of `service.questions.events.queries`, which loads more than help needs.
EventFormat = Literal["table", "jsonl", "csv", "json", "vtt", "geojson", "ocel", "openlabel", "parquet"]
Match = Literal["overlap", "start", "end", "inside"]
Order = Literal["start", "-start"]


class Status(StrEnum):
    """What is known of an event; an enumeration, since typer takes no list of literals."""

    recognised = "recognised"
    tentative = "tentative"
    confirmed = "confirmed"
    retracted = "retracted"
    doubtful = "doubtful"


Logs = Annotated[list[str] | None, typer.Argument(metavar="LOG...", help="Event logs: PATH.db, or a URL.")]
Texts = list[str] | None


def events(
    logs: Logs = None,
    more_logs: Annotated[Texts, typer.Option("--log", help="An event log; the same as LOG.")] = None,
    types: Annotated[Texts, typer.Option("--type", help="Event type; repeat for alternatives.")] = None,
    start: Annotated[
        str | None, typer.Option("--from", help="Start of the window: 12.5s, 01:23, 12500000 (us) or RFC 3339.")
    ] = None,
    end: Annotated[str | None, typer.Option("--to", help="End of the window, excluded.")] = None,
    match: Annotated[Match, typer.Option(help="How an event must lie to the window.")] = "overlap",
    actors: Annotated[Texts, typer.Option("--actor", help="Object in any role; repeat for alternatives.")] = None,
    roles: Annotated[Texts, typer.Option("--role", metavar="NAME=ID", help="Object in this role.")] = None,
    roads: Annotated[Texts, typer.Option("--road", help="Road on which the event began.")] = None,
    sources: Annotated[Texts, typer.Option("--source", help="Name of the input.")] = None,
    runs: Annotated[Texts, typer.Option("--run", help="Identifier of a run.")] = None,
    statuses: Annotated[
        list[Status] | None, typer.Option("--status", help="Status; without it, all but retracted and doubtful events.")
    ] = None,
    min_confidence: MinConfidence = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help=f"At most so many events; for a table {TABLE_LIMIT} if not given.")
    ] = None,
    order: Annotated[Order, typer.Option(help="Earliest or latest start first.")] = "start",
    output: Annotated[
        EventFormat, typer.Option("--format", help="The form; the last five are of one log, whole.")
    ] = "table",
    as_json: AsJson = False,
    fail_empty: Annotated[bool, typer.Option("--fail-empty", help="Exit with 4 if nothing is found.")] = False,
) -> None:
    """List recognised events of one or more logs."""
    from service.questions.events.queries import EventFilter

    wanted = EventFilter(
        types=tuple(types or ()),
        from_=_time(start, "--from"),
        to=_time(end, "--to"),
        match=match,
        actors=tuple(actors or ()),
        roles=read_roles(roles or ()),
        roads=tuple(roads or ()),
        sources=tuple(sources or ()),
        runs=tuple(runs or ()),
        statuses=tuple(one.value for one in statuses or ()),
        min_confidence=min_confidence,
        order=order,
    )
    is_empty = _print_events([*(logs or ()), *(more_logs or ())], wanted, "json" if as_json else output, limit)
    if fail_empty and is_empty:
        print("nothing found", file=sys.stderr)
        raise typer.Exit(NOTHING_FOUND)


def _time(text: str | None, parameter: str) -> "TimePoint | None":
    return None if text is None else parse_time(text, parameter=parameter)


def _print_events(urls: "Sequence[str]", wanted: "EventFilter", output: EventFormat, limit: int | None) -> bool:
    """Print the events of some logs; tell whether there are none."""
    from service.export.events import events_csv, events_jsonl, exported
    from service.questions.events.notes import name_notes, run_notes
    from service.questions.events.queries import find_role_names

    if not urls:
        raise typer.BadParameter("expected at least one event log, got none", param_hint="LOG")
    with ExitStack() as stack:
        logs = [stack.enter_context(open_log(url)) for url in urls]
        shown = limit or TABLE_LIMIT
        found = _merged(logs, wanted, limit=shown + 1 if output == "table" else limit)
        first = next(found, None)
        texts = found if first is None else chain((first,), found)
        pages = iter(lambda: "\n".join(islice(texts, AT_ONCE)), "")
        runs_told = tuple(run_notes(logs, wanted))
        if output == "table":
            _print_table(texts, shown)
        elif output == "jsonl":
            write_blocks(events_jsonl(pages))
        elif output == "json":
            print_json_list("items", texts, notes=runs_told)
        elif output == "csv":
            write_blocks(events_csv(pages, sorted({name for log in logs for name in find_role_names(log, wanted)})))
        else:
            if len(logs) > 1 or limit is not None:
                raise typer.BadParameter(f"{output}: expected one log, and no --limit", param_hint="--format")
            write_blocks(exported(logs[0], wanted, output))
        tell("note", (*runs_told, *(name_notes(logs, wanted) if first is None else ())))
        return first is None


def _merged(logs: "Sequence[EventLog]", wanted: "EventFilter", *, limit: int | None) -> "Iterator[str]":
    """Stream the events of several logs in one order, as JSON text."""
    from service.questions.events.queries import decode_event, iterate_events

    streams = [iterate_events(log, wanted, limit=limit) for log in logs]
    if len(streams) == 1:
        return streams[0]
    is_descending = wanted.order == "-start"
    merged = heapq.merge(*streams, key=lambda text: decode_event(text).start_us, reverse=is_descending)
    return islice(merged, limit)


def _print_table(texts: "Iterator[str]", limit: int) -> None:
    from service.questions.events.queries import decode_event

    print(format_table(TITLES, [cells(decode_event(text)) for text in islice(texts, limit)]), end="")
    if next(texts, None) is not None:
        print(f"the first {limit} of more; --limit N shows others, --format jsonl all", file=sys.stderr)


def cells(event: "EventRecord") -> list[str]:
    """Write an event for a table with `TITLES`."""
    road = event.place.road if event.place else ""
    start, end = format_media(event.start_us), format_media(event.end_us)
    sure = f"{event.confidence:.2f}"
    return [start, end, event.type, shown_roles(event.roles.items()), road, event.status, sure, event.source, event.id]
