"""`dyknow draw`: what a run saw, on the frames of its video."""

from pathlib import Path
from typing import Annotated

import typer


def draw(
    video: Annotated[Path, typer.Argument(help="The video that was processed.")],
    log: Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")],
    out: Annotated[Path, typer.Option("--out", help="A video (.mp4) or a single picture (.png).")],
    start: Annotated[str, typer.Option("--from", help="First time, or the picture's: 12.5s, 01:23, 12500000.")] = "0",
    end: Annotated[str | None, typer.Option("--to", help="Time to stop before; default: the end.")] = None,
    run: Annotated[str | None, typer.Option("--run", help="Run to draw, if the log holds several.")] = None,
) -> None:
    """Draw cars, trails and events of a log on its video."""
    from service.draw_video import draw_picture, draw_video
    from service.errors import InputError

    from_us = media_us(start, parameter="--from")
    to_us = media_us(end, parameter="--to") if end else None
    if out.suffix == ".png":
        draw_picture(video, log, out, at_us=from_us, run=run)
    elif out.suffix == ".mp4":
        draw_video(video, log, out, from_us=from_us, to_us=to_us, run=run)
    else:
        raise InputError(f"--out: expected a path ending in .mp4 or .png, got {str(out)!r}")
    print(out)


def media_us(text: str, *, parameter: str) -> int:
    """Read a time point in media time, in microseconds.

    Raises
    ------
    InputError
        If it is a time on the UTC calendar: a video file knows only its own.
    QueryError
        If it is no time at all.

    Examples
    --------
    >>> media_us("1:02.5", parameter="--from")
    62500000
    """
    from service.errors import InputError
    from service.times import parse_time

    point = parse_time(text, parameter=parameter)
    if point.clock != "media":
        raise InputError(f"{parameter}: expected media time such as 12.5s, got {text!r}")
    return point.us
