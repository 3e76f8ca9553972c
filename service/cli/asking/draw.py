"""`dyknow draw`: what did a run see, on the frames of its video?"""

from pathlib import Path
from typing import Annotated

import typer

PICTURES = (".png", ".jpg")


def draw(
    video: Annotated[Path, typer.Argument(help="The video that was processed.")],
    log: Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")],
    out: Annotated[Path, typer.Option("--out", help="A video (.mp4) or a single picture (.png, .jpg).")],
    start: Annotated[str, typer.Option("--from", help="First time, or the picture's: 12.5s, 01:23, 12500000.")] = "0",
    end: Annotated[str | None, typer.Option("--to", help="Time to stop before; default: the end.")] = None,
    run: Annotated[str | None, typer.Option("--run", help="Run to draw, if the log holds several.")] = None,
) -> None:
    """Draw cars, trails and events of a log on its video."""
    from service.errors import InputError
    from service.export.draw_video import draw_picture, draw_video
    from service.times import parse_media_us

    from_us = parse_media_us(start, parameter="--from")
    to_us = parse_media_us(end, parameter="--to") if end else None
    if to_us is not None and to_us <= from_us:
        raise InputError(f"--to: expected a time after --from, got {end!r} and {start!r}")
    suffix = out.suffix.lower()
    if suffix in PICTURES:
        draw_picture(video, log, out, at_us=from_us, run=run)
    elif suffix == ".mp4":
        draw_video(video, log, out, from_us=from_us, to_us=to_us, run=run)
    else:
        raise InputError(f"--out: expected a path ending in .mp4, .png or .jpg, got {str(out)!r}")
    print(out)
