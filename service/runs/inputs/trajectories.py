"""What did somebody else's tracker see? Trajectory files, read as the objects of one time after another.

A CSV file with the columns ``t_us`` (or ``t_s``), ``id, x_m, y_m, heading_rad, speed_mps, length_m, width_m``. Other
column names are mapped: ``{"t_s": "t", "x_m": "x"}`` reads the time from column ``t`` and x from column ``x``.
"""

import csv
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dyknow.streams.sample import Sample
from service.errors import InputError
from service.records import InputKind
from service.runs.inputs.input_kind import Asked, Input
from service.runs.pipeline import TRAJECTORIES, Feed
from service.times import MAX_MEDIA_US

FloatArray = NDArray[np.float64]

TRAJECTORY_SUFFIXES = (".csv",)
# What each number may be, both ends included; the limits are far beyond traffic, to catch other units and sentinels.
_RANGES = {
    "x_m": (-1e7, 1e7),
    "y_m": (-1e7, 1e7),
    "heading_rad": (-6.3, 6.3),  # degrees are the usual mistake
    "speed_mps": (-200.0, 200.0),
    "length_m": (0.01, 200.0),
    "width_m": (0.01, 50.0),
}
_NUMBERS = tuple(_RANGES)
_TIMES = {"t_us": 1, "t_s": 1_000_000}
KNOWN_COLUMNS = (*_TIMES, "id", *_NUMBERS)


@dataclass(frozen=True, slots=True)
class TrajectoryObjects:
    """Hold all objects of one time, as a struct of arrays.

    Attributes
    ----------
    ids : n identifiers as written in the file.
    centre_m, velocity_mps : (n, 2), local east/north frame.
    heading_rad, length_m, width_m : (n,).
    observed, clipped : (n,) all True and all False: a trajectory file holds no predictions and has no view edge.
    is_lost : False: there is no view that could be lost.
    """

    t_us: int
    ids: tuple[str, ...]
    centre_m: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    observed: NDArray[np.bool_]
    clipped: NDArray[np.bool_]
    is_lost: bool = False


@dataclass(frozen=True, slots=True)
class Trajectories:
    """Hold a whole trajectory file, sorted by time and identifier.

    Attributes
    ----------
    t_us : (n,) int64. ids : n identifiers. values : (n, 6) x_m, y_m, heading_rad, speed_mps, length_m, width_m.
    """

    t_us: NDArray[np.int64]
    ids: tuple[str, ...]
    values: FloatArray

    @property
    def times_us(self) -> NDArray[np.int64]:
        """Return the distinct times, ascending."""
        return np.unique(self.t_us)

    def __iter__(self) -> Iterator[TrajectoryObjects]:
        """Yield the objects of each distinct time, in order."""
        times_us, starts = np.unique(self.t_us, return_index=True)
        ends = np.append(starts[1:], len(self.t_us))
        for t_us, start, end in zip(times_us.tolist(), starts.tolist(), ends.tolist(), strict=True):
            yield self._objects(t_us, slice(start, end))

    def _objects(self, t_us: int, rows: slice) -> TrajectoryObjects:
        x_m, y_m, heading_rad, speed_mps, length_m, width_m = self.values[rows].T
        n = len(x_m)
        return TrajectoryObjects(
            t_us=t_us,
            ids=self.ids[rows],
            centre_m=np.column_stack((x_m, y_m)),
            velocity_mps=np.column_stack((speed_mps * np.cos(heading_rad), speed_mps * np.sin(heading_rad))),
            heading_rad=heading_rad.copy(),
            length_m=length_m.copy(),
            width_m=width_m.copy(),
            observed=np.ones(n, dtype=np.bool_),
            clipped=np.zeros(n, dtype=np.bool_),
        )


def load_trajectories(path: Path, columns: Mapping[str, str] | None = None) -> Trajectories:
    """Read a trajectory file.

    Parameters
    ----------
    path : a CSV file with a header line.
    columns : our column names to the file's, where they differ.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, a field is not a number or out of its range, or one identifier
        stands twice at one time. The message names the file, the line and the column.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _read(path, csv.reader(file), dict(columns or {}))
    except OSError as error:
        raise InputError(f"{path}: expected a readable trajectory file, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected a UTF-8 CSV file, got byte {error.object[error.start]:#04x}") from error
    except csv.Error as error:
        raise InputError(f"{path}: expected a CSV file, got {error}") from error


def _read(path: Path, lines: Iterator[list[str]], columns: Mapping[str, str]) -> Trajectories:
    header = [name.strip() for name in next(lines, [])]
    time_column, places = _places(path, header, columns)
    keys: dict[tuple[int, str], int] = {}
    values: list[list[float]] = []
    for number, fields in enumerate(lines, start=2):
        if not fields:
            continue
        if len(fields) != len(header):
            raise InputError(f"{path}:{number}: expected {len(header)} fields, got {len(fields)}")
        key = _time_us(path, number, time_column, fields[places[time_column]]), fields[places["id"]].strip()
        if key in keys:
            raise InputError(
                f"{path}:{number}: expected each id once a time, got {key[1]!r} at {key[0]} us as in line {keys[key]}"
            )
        keys[key] = number
        values.append([_number(path, number, name, fields[places[name]]) for name in _NUMBERS])
    if not keys:
        raise InputError(f"{path}: expected at least one row of objects, got none")
    t_us, ids = np.array([t_us for t_us, _ in keys], dtype=np.int64), np.array([name for _, name in keys])
    order = np.lexsort((ids, t_us))
    return Trajectories(t_us[order], tuple(ids[order].tolist()), np.array(values)[order])


def _places(path: Path, header: list[str], columns: Mapping[str, str]) -> tuple[str, dict[str, int]]:
    """Find the column of each of our names; return the time column's name and all places."""
    unknown = sorted(set(columns) - set(KNOWN_COLUMNS))
    if unknown:
        raise InputError(f"column map: expected names out of {', '.join(KNOWN_COLUMNS)}, got {unknown[0]!r}")
    at = {name: header.index(columns.get(name, name)) for name in KNOWN_COLUMNS if columns.get(name, name) in header}
    times = [name for name in _TIMES if name in at]
    missing = [name for name in ("id", *_NUMBERS) if name not in at]
    if not times or missing:
        wanted = ", ".join([*([] if times else ["t_us or t_s"]), *missing])
        came = ", ".join(header) or "an empty file"
        raise InputError(f"{path}:1: expected columns {wanted} (map other names with --columns), got {came}")
    return times[0], at


def _time_us(path: Path, line: int, column: str, text: str) -> int:
    scale = _TIMES[column]
    return round(_within(path, line, column, text, (0.0, MAX_MEDIA_US / scale)) * scale)


def _number(path: Path, line: int, column: str, text: str) -> float:
    return _within(path, line, column, text, _RANGES[column])


def _within(path: Path, line: int, column: str, text: str, limits: tuple[float, float]) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}:{line}: column {column}: expected a finite number, got {text!r}")
    if not limits[0] <= value <= limits[1]:
        raise InputError(f"{path}:{line}: column {column}: expected {limits[0]:g} to {limits[1]:g}, got {text!r}")
    return value


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryInput(Input):
    """Read the objects of a trajectory file; vision is skipped."""

    kind: ClassVar[InputKind] = "trajectory"
    trajectories: Trajectories

    @classmethod
    def fits(cls, asked: Asked) -> bool:
        """Take a CSV file, unless a detector is to look at it."""
        return asked.detector is None and asked.path.suffix.lower() in TRAJECTORY_SUFFIXES

    @classmethod
    def open(cls, asked: Asked) -> "TrajectoryInput":
        """Read the file."""
        trajectories = load_trajectories(asked.path, asked.columns)
        return cls(path=asked.path, trajectories=trajectories, network=asked.network)

    @property
    def frame_count(self) -> int:
        """Return the number of distinct times."""
        return len(self.trajectories.times_us)

    def feed(self) -> Feed:
        """Give the objects of each time; nothing needs to look at them."""
        return Feed(TRAJECTORIES, (Sample(objects.t_us, objects.t_us, objects) for objects in self.trajectories))
