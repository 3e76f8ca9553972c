"""`dyknow tracks`: where were the cars of a run?"""

import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from service.records import RunRecord
    from service.store.log import EventLog


class TrackFormat(StrEnum):
    """How to print tracks."""

    csv = "csv"
    mot = "mot"


def tracks(
    log: Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")],
    output: Annotated[
        TrackFormat, typer.Option("--format", help="csv, or mot (boxes in the image).")
    ] = TrackFormat.csv,
    run: Annotated[str | None, typer.Option("--run", help="Run to print, if the log holds several.")] = None,
    car: Annotated[str | None, typer.Option("--car", help="One car symbol only.")] = None,
    start: Annotated[str | None, typer.Option("--from", help="First media time: 12.5s, 01:23, 12500000 (us).")] = None,
    end: Annotated[str | None, typer.Option("--to", help="Media time to stop before.")] = None,
) -> None:
    """Print car symbols over time, in metres (csv) or in the image (mot)."""
    from service.export.tracks import write_tracks_csv
    from service.store.log import open_log
    from service.times import parse_media_us

    from_us = None if start is None else parse_media_us(start, parameter="--from")
    to_us = None if end is None else parse_media_us(end, parameter="--to")
    with open_log(log) as opened:
        record = opened.run(run)
        if car is not None:
            _check_car(opened, record, car)
        if output is TrackFormat.csv:
            write_tracks_csv(opened.states(record.id, car=car, from_us=from_us, to_us=to_us), sys.stdout)
        else:
            _print_mot(opened, record, car, from_us, to_us)


def _check_car(log: "EventLog", run: "RunRecord", car: str) -> None:
    from service.errors import ExportError

    cars = [one.car for one in log.cars(run.id)]
    if car not in cars:
        known = ", ".join(cars[:5]) + (", ..." if len(cars) > 5 else "") if cars else "none"
        raise ExportError(f"run {run.id!r}: expected one of its {len(cars)} cars ({known}), got {car!r}")


def _print_mot(log: "EventLog", run: "RunRecord", car: str | None, from_us: int | None, to_us: int | None) -> None:
    from service.errors import ExportError
    from service.export.tracks import write_tracks_mot

    if run.camera is None:
        raise ExportError(f"run {run.id!r}: expected a run with a camera for --format mot, got one without")
    report = write_tracks_mot(
        log.states(run.id, car=car, from_us=from_us, to_us=to_us),
        sys.stdout,
        frames=log.frames(run.id),
        car_numbers={one.car: one.number for one in log.cars(run.id)},
        camera=run.camera,
        views=log.views(run.id),
    )
    left_out = report.without_frame + report.outside
    if left_out:
        print(
            f"{left_out} car positions have no box: {report.outside} outside the image, "
            f"{report.without_frame} between frames",
            file=sys.stderr,
        )
