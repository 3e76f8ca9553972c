"""Which videos of runs may be sent, and what is a picture or a piece of one? Both are made in processes of the pool."""

import mimetypes
import os
from collections.abc import Iterable
from contextlib import suppress
from hashlib import sha1
from pathlib import Path

import msgspec

from service.api.processes.questions import opened
from service.errors import ExportError, NotInLogError
from service.records.runs import RunRecord
from service.records.seen import Drawing

MOST_CLIP_US = 60_000_000
MOST_KEPT = 8


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


def picture(log: str, run_id: str, folders: Iterable[Path], t_us: int, drawing: Drawing) -> bytes:
    """Make the picture of a run that is shown at a time, as JPEG; parameters and errors as those of `picture_at`."""
    import cv2

    from service.export.draw_video import picture_at

    run = opened(log).run(run_id)
    image = picture_at(opened(log), run, video_of(run, folders), t_us, drawing)
    return cv2.imencode(".jpg", image)[1].tobytes()


def clip(log: str, event_id: str, folders: Iterable[Path], kept: Path, *, pad_us: int, drawing: Drawing) -> Path:
    """Make the piece of video of an event, or find the one that is kept; parameters as those of `event_window`.

    Parameters
    ----------
    kept : where the newest `MOST_KEPT` pieces lie: a player asks for one part after the other.

    Raises
    ------
    ExportError
        If it would be longer than `MOST_CLIP_US`; besides, as `event_window`, `video_of` and `picture_at`.
    """
    from service.export.draw_video import event_window, write_video

    run, (from_us, to_us) = event_window(opened(log), event_id, pad_us)
    if to_us - from_us > MOST_CLIP_US:
        expected = f"expected a clip of at most {MOST_CLIP_US / 1e6:g} s with what it is padded by"
        raise ExportError(
            f"event {event_id!r}: {expected}, got {(to_us - from_us) / 1e6:g} s (dyknow clip has no limit)"
        )
    video = video_of(run, folders)
    # What a run that goes on has not seen yet is no part of it, so more of it is another clip.
    seen_us = min(opened(log).last_us(run.id), to_us)
    made_of = msgspec.json.encode((run, event_id, pad_us, drawing, seen_us))
    path = kept / f"{sha1(made_of, usedforsecurity=False).hexdigest()}.mp4"
    if path.exists():
        return path
    with suppress(FileNotFoundError):  # what another process has removed meanwhile
        for old in sorted(kept.iterdir(), key=lambda one: one.stat().st_mtime_ns)[: 1 - MOST_KEPT]:
            old.unlink()
    part = path.with_suffix(f".{os.getpid()}.mp4")
    write_video(opened(log), run, video, part, (from_us, to_us), drawing=drawing)
    return part.replace(path)
