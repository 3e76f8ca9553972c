"""What goes wrong between camera and file? Noise, lost and repeated frames, uneven rates, gaps, strong compression.

The faults are real ones of the file: a lost frame leaves a hole in the time stamps, a repeated one shows the picture
before it under a new time stamp. Truth is not touched; it has rows for every simulated time.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from data_gen.errors import DataGenError

USUAL_CRF = 20
_SLOWEST_STEP = 5


@dataclass(frozen=True, slots=True)
class Degradation:
    """Which faults a video has; the default has none."""

    noise: float = 0.0
    """Standard deviation of noise on top of the sensor's, in steps of luma."""
    drop: float = 0.0
    """Part of the frames that is lost, 0 to 1."""
    duplicate: float = 0.0
    """Part of the frames that shows the picture before it, 0 to 1."""
    every: int = 1
    """Only each so many-th frame is kept: 5 makes 5 frames per second of 25."""
    vfr: int = 1
    """In each second every frame, or every second one, ... or every so many-th one is kept, at random."""
    gaps_us: tuple[tuple[int, int], ...] = field(default=())
    """Start and end of stretches without frames, half-open."""
    crf: int = USUAL_CRF
    """Constant rate factor of the encoder; 18 looks flawless, 35 is poor."""


def parse_degradation(text: str) -> Degradation:
    """Read a list of faults.

    Parameters
    ----------
    text : `name=value` pairs with commas between them; empty is no fault. A gap is `gap=START+LENGTH` in seconds and
        may come several times.

    Returns
    -------
    The faults.

    Raises
    ------
    DataGenError
        If a name is unknown or comes twice, or a value is out of range.

    Examples
    --------
    >>> parse_degradation("noise=2,drop=0.05,gap=10+2")
    Degradation(noise=2.0, drop=0.05, duplicate=0.0, every=1, vfr=1, gaps_us=((10000000, 12000000),), crf=20)
    >>> parse_degradation("drop=2")
    Traceback (most recent call last):
    ...
    data_gen.errors.DataGenError: degrade, drop: expected a number from 0 to 0.9, got '2'
    """
    values: dict[str, Any] = {}  # whole numbers or not, as the limits of the names say
    gaps: list[tuple[int, int]] = []
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, _, value = item.partition("=")
        if name == "gap":
            gaps.append(_gap(value))
        elif name not in _LIMITS:
            raise DataGenError(f"degrade: expected some of {', '.join((*_LIMITS, 'gap'))}, got {name!r}")
        elif name in values:
            raise DataGenError(f"degrade, {name}: expected it once, got it again as {value!r}")
        else:
            values[name] = _read(name, value)
    return Degradation(gaps_us=tuple(sorted(gaps)), **values)


@dataclass(frozen=True, slots=True)
class PlannedFrame:
    """One frame of the file."""

    number: int
    """Which time stamp it has: that of this simulated step."""
    shows: int
    """Which step's picture it shows; the one of the frame before it if it is a repeated one."""


def plan_frames(
    degradation: Degradation, count: int, *, step_us: int, rng: np.random.Generator
) -> tuple[PlannedFrame, ...]:
    """Decide which frames the file has.

    Parameters
    ----------
    degradation : the faults.
    count : simulated steps.
    step_us : between two of them.
    rng : source of every choice; consumed alike by every degradation, so that faults can be compared one by one.

    Returns
    -------
    The frames in order; the first step always has one.

    Examples
    --------
    >>> plan_frames(Degradation(every=2), 5, step_us=40_000, rng=np.random.default_rng(0))
    (PlannedFrame(number=0, shows=0), PlannedFrame(number=2, shows=2), PlannedFrame(number=4, shows=4))
    """
    chances = rng.random((count, 2))
    second_rng = rng.spawn(1)[0]
    steps_a_second = max(1, 1_000_000 // step_us)
    # One draw a second, from a generator of its own: a longer clip begins with the shorter one's rates.
    paces = [int(second_rng.integers(1, _SLOWEST_STEP + 1)) for _ in range(-(-count // steps_a_second))]
    frames: list[PlannedFrame] = []
    for number in range(count):
        pace = min(paces[number // steps_a_second], degradation.vfr)
        is_lost = chances[number, 0] < degradation.drop or number % degradation.every or number % pace
        in_gap = any(start_us <= number * step_us < end_us for start_us, end_us in degradation.gaps_us)
        if number == 0 or not (is_lost or in_gap):
            repeats = bool(frames) and chances[number, 1] < degradation.duplicate
            frames.append(PlannedFrame(number, frames[-1].shows if repeats else number))
    return tuple(frames)


def _gap(value: str) -> tuple[int, int]:
    start, plus, length = value.partition("+")
    try:
        start_us, length_us = round(float(start) * 1e6), round(float(length) * 1e6)
    except (ValueError, OverflowError) as error:
        raise DataGenError(f"degrade, gap: expected START+LENGTH in seconds, as 10+2, got {value!r}") from error
    if not plus or start_us <= 0 or length_us <= 0:
        raise DataGenError(f"degrade, gap: expected START+LENGTH in seconds, both above 0, got {value!r}")
    return start_us, start_us + length_us


def _read(name: str, value: str) -> float:
    low, high, kind = _LIMITS[name]
    try:
        number = kind(value)
    except ValueError:
        number = float("nan")
    if not low <= number <= high:
        expected = "a whole number" if kind is int else "a number"
        raise DataGenError(f"degrade, {name}: expected {expected} from {low:g} to {high:g}, got {value!r}")
    return number


_LIMITS: Mapping[str, tuple[float, float, type[int] | type[float]]] = {
    "noise": (0, 20, float),
    "drop": (0, 0.9, float),
    "duplicate": (0, 0.9, float),
    "every": (1, 25, int),
    "vfr": (1, _SLOWEST_STEP, int),
    "crf": (0, 51, int),
}
