"""`dyknow objects`, `tracks`, `draw` and `clip`: which cars are there, by what links, and where?"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.options import AsJson, From, LogName, RunName, To, open_log, read_window
from service.cli.printing import check_target, format_table, print_json_list, show, tell, write_blocks, write_picture
from service.errors import ExportError, InputError
from service.records.times import format_media, parse_media_us
from service.store.databases.location import log_files

if TYPE_CHECKING:
    from service.questions.observations.identity import CarIdentity, IdentityLink
    from service.records.runs import RunRecord
    from service.records.seen import CarState
    from service.store.log import EventLog

CAR_TITLES = ("car", "class", "first", "last", "vision objects", "hidden s", "undecided", "refuted", "open")
LINK_TITLES = ("start", "end", "link", "verdict", "score", "margin", "next best", "hidden s", "why", "ended by")


def objects(
    log: LogName,
    car: Annotated[str | None, typer.Argument(help="A car symbol: shows the links by which it is that car.")] = None,
    run: RunName = None,
    as_json: AsJson = False,
) -> None:
    """List the cars of a log, or the identity chain of one of them."""
    from service.questions.events.notes import run_notes
    from service.questions.events.queries import EventFilter
    from service.questions.observations.identity import identities, links_of

    with open_log(log) as opened:
        record = opened.run(run)
        if car is not None:
            links = links_of(opened, record, car)
            table = format_table(LINK_TITLES, [_link_row(one) for one in links])
            show({"run": record.id, "car": car, "links": links}, table, as_json=as_json)
            return
        cars = identities(opened, record.id)
        table = format_table(CAR_TITLES, [_car_row(one) for one in cars])
        show({"run": record.id, "cars": cars}, table, as_json=as_json)
        tell("note", run_notes([opened], EventFilter(runs=(record.id,))))
        tell("note", [] if cars else [f"run {record.id!r} of {record.source} has no cars"])


def _car_row(one: "CarIdentity") -> list[str]:
    times = [format_media(one.first_us), format_media(one.last_us)]
    counts = [str(count) if count else "" for count in (one.undecided, one.refuted, one.open)]
    return [one.car, one.car_class, *times, " ".join(one.vision_ids), _seconds(one.hidden_us), *counts]


def _link_row(one: "IdentityLink") -> list[str]:
    end = "" if one.end_us is None else format_media(one.end_us)
    hidden = _seconds(0 if one.hidden_us is None else one.start_us - one.hidden_us)
    weighed = ["" if value is None else f"{value:.1f}" for value in (one.score_nats, one.margin_nats)]
    name = f"{one.lower} -> {one.upper}"
    return [format_media(one.start_us), end, name, one.verdict, *weighed, one.runner_up, hidden, one.how, one.reason]


def _seconds(us: int) -> str:
    return f"{us * 1e-6:.2f}" if us else ""


def tracks(
    log: LogName,
    output: Annotated[
        Literal["csv", "mot", "parquet"], typer.Option("--format", help="csv, parquet, or mot (boxes in the image).")
    ] = "csv",
    run: RunName = None,
    car: Annotated[str | None, typer.Option(help="One car symbol only.")] = None,
    start: From = None,
    end: To = None,
    as_json: AsJson = False,
) -> None:
    """Print car symbols over time, in metres (csv, parquet) or in the image (mot)."""
    import msgspec

    from service.export.tracks import tracks_parquet, write_tracks_csv
    from service.questions.observations.identity import check_car

    from_us, to_us = read_window(start, end)
    with open_log(log) as opened:
        record = opened.run(run)
        if car is not None:
            check_car(opened, record, car)
        states = opened.states(record.id, cars=None if car is None else (car,), from_us=from_us, to_us=to_us)
        if as_json:
            print_json_list("states", (msgspec.json.encode(one).decode() for one in states), run=record.id)
        elif output == "csv":
            write_tracks_csv(states, sys.stdout)
        elif output == "parquet":
            write_blocks(tracks_parquet(states))
        else:
            _print_mot(opened, record, states)


def _print_mot(log: "EventLog", run: "RunRecord", states: "Iterable[CarState]") -> None:
    from service.export.tracks import write_tracks_mot

    if run.camera is None:
        raise ExportError(f"run {run.id!r}: expected a run with a camera for --format mot, got one without")
    report = write_tracks_mot(
        states,
        sys.stdout,
        frames=log.frames(run.id),
        car_numbers={one.car: one.number for one in log.cars(run.id)},
        camera=run.camera,
        views=log.views(run.id),
    )
    left_out = report.without_frame + report.outside
    if left_out:
        why = f"{report.outside} outside the image, {report.without_frame} between frames"
        print(f"{left_out} car positions have no box: {why}", file=sys.stderr)


def draw(
    video: Annotated[Path, typer.Argument(help="The video that was processed.")],
    log: LogName,
    out: Annotated[Path, typer.Option(help="A video (.mp4) or a single picture (.png, .jpg).")],
    start: From = "0",
    end: To = None,
    run: RunName = None,
    as_json: AsJson = False,
) -> None:
    """Draw cars, trails and events of a log on its video, or on the frame at --from."""
    from service.export.draw_video import picture_at, write_video

    from_us, to_us = read_window(start, end)
    if from_us is None or (to_us is not None and to_us <= from_us):
        raise InputError(f"--to: expected a time after --from, got {end!r} and {start!r}")
    suffix = out.suffix.lower()
    if suffix not in (".mp4", ".png", ".jpg"):
        raise InputError(f"--out: expected a path ending in .mp4, .png or .jpg, got {str(out)!r}")
    check_target(out, video, *log_files(log))
    with open_log(log) as opened:
        record = opened.run(run)
        if suffix == ".mp4":
            write_video(opened, record, video, out, (from_us, to_us))
        else:
            write_picture(out, picture_at(opened, record, video, from_us))
    show({"out": str(out), "bytes": out.stat().st_size}, str(out), as_json=as_json)


def clip(
    log: LogName,
    event_id: Annotated[str, typer.Argument(metavar="EVENT_ID", help="Identifier, as `dyknow events` shows it.")],
    out: Annotated[Path, typer.Option(help="The piece of video, .mp4.")],
    pad: Annotated[str, typer.Option(metavar="TIME", help="So much before and behind the event too.")] = "2s",
    overlay: Annotated[
        Literal["none", "boxes", "symbols"],
        typer.Option(help="Boxes of cars, or also their names and trails, and events."),
    ] = "symbols",
    video: Annotated[Path | None, typer.Option(help="The video of the run, if it moved.")] = None,
    as_json: AsJson = False,
) -> None:
    """Cut the piece of video of an event, with what the run saw on it."""
    from service.export.draw_video import event_window, write_video
    from service.records.seen import Drawing

    if out.suffix.lower() != ".mp4":
        raise InputError(f"--out: expected a path ending in .mp4, got {str(out)!r}")
    with open_log(log) as opened:
        run, window_us = event_window(opened, event_id, parse_media_us(pad, parameter="--pad"))
        source = video or Path(run.file.path if run.file else run.input)
        check_target(out, source, *log_files(log))
        write_video(opened, run, source, out, window_us, drawing=Drawing(overlay))
    show({"out": str(out), "bytes": out.stat().st_size, "run": run.id}, str(out), as_json=as_json)
