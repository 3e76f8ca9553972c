"""`dyknow recognise`, `monitor`, `explain`, `why-not`: do these chronicles occur, who breaks these rules, and why?"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TextIO

import typer

from service.cli import options
from service.cli.printing import check_target, counted, format_table, print_json, show, shown_roles, tell
from service.errors import NotInLogError
from service.records.times import format_media, parse_media_us
from service.store.databases.location import is_log_name, log_files, shown

if TYPE_CHECKING:
    from chronicles.events import Event, Occurrence
    from service.questions.recognition.recognised_events import RecognisedEvent
    from service.questions.recognition.stored_monitoring import Monitored
    from service.questions.recognition.stored_recognition import Recognised

OccurrenceFormat = Literal["table", "jsonl", "json"]
Executor = Literal["eager", "backfill"]


def recognise(
    source: Annotated[
        str, typer.Argument(metavar="INPUT", help="Event log (.db), or a file of events (.jsonl, .csv).")
    ],
    chronicles: options.ChronicleFiles = None,
    run: options.RunName = None,
    executor: Annotated[
        Executor | None, typer.Option(help="Who finds them; all find the same. Default: backfill, live eager.")
    ] = None,
    lateness: Annotated[
        str | None, typer.Option(help="Take the events one by one, as if live, up to so late (2s, 2000000); eager.")
    ] = None,
    output: Annotated[OccurrenceFormat, typer.Option("--format", help="table, jsonl or json.")] = "table",
    out: Annotated[Path | None, typer.Option(help="File to write to instead of standard output.")] = None,
    stream: options.StreamOption = None,
    until: Annotated[
        str | None, typer.Option(help="How far time goes on in a file of events: 90s, 01:30. Default: its last event.")
    ] = None,
    site: options.SiteOfRun = None,
    evidence: Annotated[
        bool, typer.Option("--evidence", help="With each event in JSON what it was recognised from, and its reports.")
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Recognise chronicles again, in the relation changes of a log or in a file of events."""
    from service.questions.recognition.stored_recognition import recognise_stored

    if lateness is not None and executor == "backfill":
        raise typer.BadParameter("expected eager to go with --lateness, got backfill", param_hint="--executor")
    if out is not None:
        check_target(out, *(log_files(source) if is_log_name(source) else [Path(source)]), *(chronicles or ()))
    is_open = bool(chronicles) and stream is None and not is_log_name(source)
    with options.hinting_at_stream(is_open=is_open):
        found = recognise_stored(
            source,
            chronicles or (),
            run=run,
            executor=executor,
            lateness_us=None if lateness is None else parse_media_us(lateness, parameter="--lateness"),
            stream=stream,
            until_us=None if until is None else parse_media_us(until, parameter="--until"),
            site_file=site,
        )
    output = "json" if as_json else output
    if out is None:
        _write(found, output, sys.stdout, evidence=evidence)
    else:
        with out.open("w", encoding="utf-8") as file:
            _write(found, output, file, evidence=evidence)
    tell("warning", (*found.doubts, *found.warnings))
    if found.late_count:
        late = counted(found.late_count, "event")
        print(f"{late} came too late and {'was' if found.late_count == 1 else 'were'} left out", file=sys.stderr)
    if is_open:
        options.tell_stream(found.stream, is_doubtful=bool(found.warnings))


def _write(found: "Recognised", output: OccurrenceFormat, out: "TextIO", *, evidence: bool) -> None:
    import msgspec

    from service.cli.asking.events import TITLES, cells

    records = [_with_evidence(one) if evidence else one.event for one in found.events] if output != "table" else []
    if output == "json":
        whole = {"stream": found.stream, "late_count": found.late_count, "items": records}
        out.write(msgspec.json.encode(whole).decode() + "\n")
    elif output == "jsonl":
        out.writelines(msgspec.json.encode(one).decode() + "\n" for one in records)
    else:  # what is in no log has no identifier, but its reports
        rows = [[*cells(one.event)[:-1], " ".join(one.occurrence.reports)] for one in found.events]
        out.write(format_table([*TITLES[:-1], "reports"], rows))


def _with_evidence(found: "RecognisedEvent") -> dict[str, object]:
    from msgspec.structs import asdict

    record = occurrence_record(found.occurrence)
    return asdict(found.event) | {name: record[name] for name in ("events", "emitted", "reports")}


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


def monitor(
    log: options.LogName,
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Files of monitors.")],
    run: options.RunName = None,
    site: options.SiteOfRun = None,
    as_json: options.AsJson = False,
) -> None:
    """Run monitors over the stored cars and relations of a log; show what was violated or satisfied, and when."""
    from service.questions.recognition.stored_monitoring import monitor_log, verdicts

    found = monitor_log(log, files, run=run, site_file=site)
    if as_json:
        print_json({"run": found.run, "events": verdicts(found), "monitors": found.report})
    else:
        _print_verdicts(found)


def _print_verdicts(found: "Monitored") -> None:
    rows = [
        [format_media(one.t_us), one.monitor, one.outcome, shown_roles(one.roles), format_media(one.since_us)]
        for one in found.events
    ]
    print(format_table(["time", "monitor", "verdict", "roles", "since"], rows), end="")
    for one in found.report:
        counts = f"{one.violated} violated, {one.satisfied} satisfied, {one.undecided} undecided"
        print(f"{one.monitor}: {counts}", file=sys.stderr)


def explain(
    log: options.LogName,
    event_id: Annotated[str, typer.Argument(metavar="EVENT_ID", help="Identifier, as `dyknow events` shows it.")],
    as_json: options.AsJson = False,
) -> None:
    """Say why an event was recognised: its parts, the room each constraint left, and who the cars were."""
    from service.questions.recognition.explaining import Explainer

    with options.open_log(log) as opened:
        found = Explainer(opened).explain_event(event_id)
    if found is None:
        raise NotInLogError(f"log {shown(log)!r}: expected the id of one of its events, got {event_id!r}")
    show(found.as_record(), found.render(), as_json=as_json)


def why_not(
    log: options.LogName,
    chronicle: Annotated[str, typer.Argument(metavar="CHRONICLE", help="Name of the chronicle.")],
    roles: Annotated[
        list[str] | None, typer.Option("--role", metavar="NAME=ID", help="Object in this role; once for each role.")
    ] = None,
    start: options.From = None,
    end: options.To = None,
    limit: Annotated[int, typer.Option(min=1, max=50, help="At most so many near misses.")] = 5,
    run: options.RunName = None,
    chronicles: options.ChronicleFiles = None,
    site: options.SiteOfRun = None,
    as_json: options.AsJson = False,
) -> None:
    """Say why a chronicle was not recognised: the instances that came closest, and what would have been enough."""
    from chronicles.explanation.json_form import to_json
    from chronicles.explanation.rendering import render
    from service.questions.recognition.explaining import AbsenceQuestion, Explainer

    start_us, end_us = options.read_window(start, end)
    given = _one_each(roles or ())
    question = AbsenceQuestion(chronicle=chronicle, run=run, roles=given, start_us=start_us, end_us=end_us, limit=limit)
    with options.open_log(log) as opened:
        found = Explainer(opened).explain_absence(question, chronicles or (), site)
    show(to_json(found), render(found), as_json=as_json)


def _one_each(texts: Sequence[str]) -> dict[str, str]:
    roles = {}
    for name, actors in options.read_roles(texts):
        if len(actors) > 1:
            raise typer.BadParameter(f"expected {name} once, got {' and '.join(actors)}", param_hint="--role")
        roles[name] = actors[0]
    return roles
