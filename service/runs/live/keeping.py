"""How long is what was recorded kept? Until it is too old, or there is too much; recordings go whole, oldest first.

A mark in a recording says that its run came to its end. What was killed left one without, which is processed first.
"""

import shutil
import time
from pathlib import Path

from vision.video.recording import INDEX, is_growing, parts_so_far

_MARK = "processed"


def remove_old(folder: Path, *, age_us: int, size_bytes: int) -> list[Path]:
    """Remove recordings that are processed.

    Parameters
    ----------
    folder : of recordings.
    age_us : older ones go, by when their last file began.
    size_bytes : where there is more in all, the oldest go.

    Returns
    -------
    What was removed.
    """
    now_us = time.time_ns() // 1000
    sizes = {one: sum(file.stat().st_size for file in one.iterdir()) for one in recordings(folder)}
    removed = []
    for one in list(sizes):
        parts = parts_so_far(one)
        is_old = not parts or now_us - parts[-1].utc_us > age_us
        if (is_old or sum(sizes.values()) > size_bytes) and (one / _MARK).exists():
            shutil.rmtree(one)
            del sizes[one]
            removed.append(one)
    return removed


def recordings(folder: Path) -> list[Path]:
    """List the recordings in a folder, oldest first."""
    return sorted(path.parent for path in folder.glob(f"*/{INDEX}"))


def left_behind(folder: Path) -> list[Path]:
    """List the recordings that nobody writes and whose run did not come to its end, oldest first."""
    return [one for one in recordings(folder) if not is_growing(one) and not (one / _MARK).exists()]


def mark_processed(recording: Path) -> None:
    """Note that the run over a recording came to its end."""
    (recording / _MARK).touch()
