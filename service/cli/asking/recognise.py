"""`dyknow recognise`: do these chronicles occur in what is stored?"""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.counted import counted
from service.cli.options import StreamOption, hinting_at_stream, tell_stream

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TextIO

    from chronicles.events import Event, Occurrence
    from service.questions.recognition import Recognised


class OccurrenceFormat(StrEnum):
    """How to print occurrences."""

    table = "table"
    jsonl = "jsonl"


class Executor(StrEnum):
    """Who finds the occurrences; all find the same."""

    auto = "auto"
    eager = "eager"
    lazy = "lazy"
    backfill = "backfill"


def recognise(
    source: Annotated[
        str, typer.Argument(metavar="INPUT", help="Event log (.db), or a file of events (.jsonl, .csv).")
    ],
    chronicles: Annotated[
        list[Path] | None,
        typer.Option("--chronicles", help="Chronicle file; repeat for several. Default: the whole library."),
    ] = None,
    run: Annotated[str | None, typer.Option("--run", help="Run of the log, if it holds several.")] = None,
    executor: Annotated[
        Executor | None, typer.Option(help="Who finds them; all find the same. Default: backfill, live eager.")
    ] = None,
    lateness: Annotated[
        str | None,
        typer.Option(help="Take the events one by one, as if live, up to so late (2s, 2000000); eager or lazy."),
    ] = None,
    output: Annotated[OccurrenceFormat, typer.Option("--format", help="table or jsonl.")] = OccurrenceFormat.table,
    out: Annotated[Path | None, typer.Option("--out", help="File to write to instead of standard output.")] = None,
    stream: StreamOption = None,
    until: Annotated[
        str | None, typer.Option(help="How far time goes on in a file of events: 90s, 01:30. Default: its last event.")
    ] = None,
) -> None:
    """Recognise chronicles again, in the relation changes of a log or in a file of events."""
    from service.questions.recognition import recognise_stored
    from service.store.location import is_log_name
    from service.times import parse_media_us

    if lateness is not None and executor is Executor.backfill:
        raise typer.BadParameter("expected eager or lazy to go with --lateness, got backfill", param_hint="--executor")
    if out is not None:
        _check_apart(out, source, chronicles or ())
    is_open = bool(chronicles) and stream is None and not is_log_name(source)
    with hinting_at_stream(is_open=is_open):
        found = recognise_stored(
            source,
            chronicles or (),
            run=run,
            executor=None if executor is None else executor.value,
            lateness_us=None if lateness is None else parse_media_us(lateness, parameter="--lateness"),
            stream=None if stream is None else stream.value,
            until_us=None if until is None else parse_media_us(until, parameter="--until"),
        )
    if out is None:
        _write(found.occurrences, output, sys.stdout)
    else:
        with out.open("w", encoding="utf-8") as file:
            _write(found.occurrences, output, file)
    _tell(found)
    if is_open:
        tell_stream(found.stream, is_doubtful=bool(found.warnings))


def _tell(found: "Recognised") -> None:
    """Say on stderr what may be wrong with the question or the events."""
    for warning in found.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    if found.late_count:
        late = counted(found.late_count, "event")
        print(f"{late} came too late and {'was' if found.late_count == 1 else 'were'} left out", file=sys.stderr)


def _check_apart(out: Path, source: str, chronicles: "Sequence[Path]") -> None:
    """Refuse to write over what is read, by whatever name it goes."""
    from service.errors import InputError
    from service.store.location import is_log_name, parse_log_url

    read = [parse_log_url(source) if is_log_name(source) else Path(source), *chronicles]
    if out.exists() and any(one.exists() and out.samefile(one) for one in read):
        raise InputError(f"{out}: expected a new file, got one that is being read")


def _write(occurrences: "Iterable[Occurrence]", output: OccurrenceFormat, out: "TextIO") -> None:
    if output is OccurrenceFormat.jsonl:
        import msgspec

        for one in occurrences:
            out.write(msgspec.json.encode(occurrence_record(one)).decode() + "\n")
        return
    from service.cli.tables import format_table
    from service.times import format_media

    rows = [
        [format_media(one.start_us), format_media(one.end_us), one.chronicle, _roles(one), " ".join(one.reports)]
        for one in occurrences
    ]
    out.write(format_table(["start", "end", "chronicle", "roles", "reports"], rows))


def _roles(occurrence: "Occurrence") -> str:
    return " ".join(f"{role}={value}" for role, value in occurrence.roles.items())


def occurrence_record(occurrence: "Occurrence") -> dict[str, object]:
    """Write an occurrence as plain data, for JSON."""
    return {
        "chronicle": {"name": occurrence.chronicle, "version": occurrence.version},
        "start_us": occurrence.start_us,
        "end_us": occurrence.end_us,
        "roles": occurrence.roles,
        "sub_events": [{"label": label, "t_us": t_us} for label, t_us in occurrence.sub_events],
        "events": [_event_record(event) for event in occurrence.events],
        "emitted": [_event_record(event) for event in occurrence.emitted],
        "reports": occurrence.reports,
    }


def _event_record(event: "Event") -> dict[str, object]:
    change = {} if event.new is None else {"old": event.old, "new": event.new}
    return {"t_us": event.t_us, "name": event.name, "args": event.args, **change}
