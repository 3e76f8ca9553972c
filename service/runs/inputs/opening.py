"""What can be processed? A table of the kinds of input; the first that fits what the user asks for opens it."""

import re
from pathlib import Path

from service.errors import InputError
from service.runs.inputs.detection_input import DetectionInput
from service.runs.inputs.input_kind import STANDARD_INPUT, Asked, Input
from service.runs.inputs.recorded_rows import RecordedRows
from service.runs.inputs.trajectories import TrajectoryInput
from service.runs.inputs.video_input import VideoInput

_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/")

KINDS: tuple[type[Input], ...] = (TrajectoryInput, RecordedRows, DetectionInput, VideoInput)


def open_input(asked: Asked) -> Input:
    """Open a file by its kind: ``.csv`` is trajectories, everything else must be a video.

    Raises
    ------
    InputError
        If the file is missing, does not go with the site, the detector, the column map or a rate, or no camera is
        known and too little moves to guess a scale.
    VideoError
        If it is not a video that can be read.
    VisionError
        If the detector cannot be used.
    """
    path = asked.path
    if any("\udc80" <= letter <= "\udcff" for letter in path.name):  # how Python spells a byte that is no text
        raise InputError(f"input: expected a file name in UTF-8, got {path.name!r}")
    _refuse_live(path)
    kind = next(kind for kind in KINDS if kind.fits(asked))
    if asked.rate_hz is not None and kind is not VideoInput:
        raise InputError(f"{path}: expected a video to go with a rate, got {kind.kind}")
    return kind.open(asked)


def _refuse_live(path: Path) -> None:
    """Refuse what is no file: an address, in which a path has lost a slash, a device, or nothing at all."""
    if path in STANDARD_INPUT:
        return
    is_address = not path.exists() and _ADDRESS.match(str(path))
    if is_address or path.is_char_device() or path.is_block_device():
        shown = str(path).replace(":/", "://", 1) if is_address else str(path)
        expected = "expected a file (dyknow watch reads live video)"
        raise InputError(f"{shown}: {expected}, got {'an address' if is_address else 'a device'}")
    if not path.exists():
        raise InputError(f"{path}: expected a video or trajectory file, got no such file")
