"""Which videos of runs may be sent, and what is one picture of them? The picture is made in a process of the pool."""

import mimetypes
from collections.abc import Iterable
from pathlib import Path

from service.api.explanations import opened
from service.errors import InputError, NotInLogError
from service.records import RunRecord


def video_of(run: RunRecord, folders: Iterable[Path]) -> Path:
    """Say where the video of a run lies, if it may be sent.

    Parameters
    ----------
    folders : only files that lie in these are sent; without links.

    Raises
    ------
    NotInLogError
        If it lies elsewhere, is no video, is gone, or is another one.
    """
    path = Path(run.file.path).resolve() if run.file else Path()
    is_video = (mimetypes.guess_type(path)[0] or "").startswith("video/")
    is_sent = run.file is not None and is_video and any(map(path.is_relative_to, folders)) and path.is_file()
    if run.file is None or not is_sent or path.stat().st_size != run.file.size_bytes:
        expected = "expected one whose file is a video, as it was, in a folder that may be sent (serve --media)"
        raise NotInLogError(f"run {run.id!r}: {expected}, got another one")
    return path


def picture(
    log: str, run_id: str, folders: Iterable[Path], t_us: int, *, is_drawn: bool = True, width_px: int | None = None
) -> bytes:
    """Make the picture of a run that is shown at a time, as JPEG; parameters and errors as those of `picture_at`."""
    import cv2

    from service.export.draw_video import picture_at
    from vision.errors import VisionError

    run = opened(log).run(run_id)
    video = video_of(run, folders)
    try:
        image = picture_at(opened(log), run, video, t_us, is_drawn=is_drawn, width_px=width_px)
    except VisionError as error:
        raise InputError(str(error)) from error
    return cv2.imencode(".jpg", image)[1].tobytes()
