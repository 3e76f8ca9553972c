"""What did somebody else's tracker see? Trajectory files, read as the objects of one time after another.

CSV, or JSON objects, one a line, with the columns ``t_us`` (or ``t_s``), ``id, x_m, y_m, heading_rad, speed_mps,
length_m, width_m``, and ``class``, ``sensor`` and ``sigma_m`` (standard deviation of x and of y) if there are such.
Other column names are mapped: ``{"t_s": "t", "x_m": "x"}`` reads the time from column ``t`` and x from column ``x``.
Rows may come in any order. A file is read once, so that it may be a pipe.
"""

import hashlib
import io
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from anchoring.linking.classes import CLASS_NAMES, UNKNOWN_CLASS
from anchoring.observations import Observations
from service.errors import InputError
from service.records.runs import InputKind
from service.records.times import MAX_MEDIA_US
from service.runs.graph.pipeline import TRAJECTORIES, Feed
from service.runs.inputs.input_kind import DIGEST_BYTES, STANDARD_INPUT, Asked, Input, is_read_once
from service.texts.csv_table import ROW_SUFFIXES, TIMES, read_name, read_number, read_rows, refuse_twice
from vision.objects import FloatArray

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
_SIGMA_RANGE = (0.0, 100.0)
_OPTIONAL = ("class", "sensor", "sigma_m")
_UNKNOWN = CLASS_NAMES[UNKNOWN_CLASS]
KNOWN_COLUMNS = (*TIMES, "id", *_NUMBERS, *_OPTIONAL)

Rows = dict[tuple[int, str], tuple[str, list[float], str, str, float]]
"""By time in microseconds and identifier: place in the file, values as in `Trajectories`, class, sensor, sigma_m."""


@dataclass(frozen=True, slots=True)
class TrajectoryObjects(Observations):
    """Hold all objects of one time, as a struct of arrays.

    Attributes
    ----------
    ids : n identifiers as written in the file.
    observed, clipped : (n,) all True and all False: a trajectory file holds no predictions and has no view edge.
    classes : n words of `CLASS_NAMES` as the file has them, or none at all.
    sensors : n names of the sensors that saw the objects, or none at all.
    is_lost : False: there is no view that could be lost.
    """

    is_lost: bool = False


@dataclass(frozen=True, slots=True)
class Trajectories:
    """Hold a whole trajectory file, sorted by time and identifier.

    Attributes
    ----------
    t_us : (n,) int64. ids : n identifiers. values : (n, 6) x_m, y_m, heading_rad, speed_mps, length_m, width_m.
    classes : n words of `CLASS_NAMES`, or none if the file has no column of them.
    sensors : n names of sensors, or none if the file has no column of them.
    sigma_m : (n,) how sure each position is, or none if the file has no column of it.
    warnings : columns that were not looked at, and classes that are no words of ours.
    size_bytes, digest : of the file.
    """

    t_us: NDArray[np.int64]
    ids: tuple[str, ...]
    values: FloatArray
    classes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    size_bytes: int = 0
    digest: str = ""
    sensors: tuple[str, ...] = ()
    sigma_m: FloatArray = field(default_factory=lambda: np.zeros(0))

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
            classes=self.classes[rows],
            sensors=self.sensors[rows],
            sigma_m=self.sigma_m[rows],
        )


def load_trajectories(path: Path, columns: Mapping[str, str] | None = None) -> Trajectories:
    """Read a trajectory file.

    Parameters
    ----------
    path : CSV with a header line or JSON objects, in a file, a pipe, or one of `STANDARD_INPUT`.
    columns : our column names to the file's, where they differ.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, a field is not a number or out of its range, an identifier or
        a sensor is empty or cannot be printed, or an identifier stands twice at one time. The message names file, line
        and column.
    """
    try:
        data = sys.stdin.buffer.read() if path in STANDARD_INPUT else path.read_bytes()
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: expected a readable trajectory file, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text in UTF-8, got byte {error.object[error.start]:#04x}") from error
    header, fields_of = read_rows(str(path), io.StringIO(text, newline=""))
    reader, rows = RowReader(str(path), header, columns or {}), Rows()
    for where, fields in fields_of:
        reader.add(rows, where, fields)
    if not rows:
        raise InputError(f"{path}: expected at least one row of objects, got none")
    digest = hashlib.blake2b(data, digest_size=DIGEST_BYTES).hexdigest()
    return replace(reader.gathered(rows), warnings=reader.warnings, size_bytes=len(data), digest=digest)


class RowReader:
    """Reads rows under one header, wherever they come from.

    Parameters
    ----------
    name : what messages call the table.
    columns : our column names to those of the header, where they differ.

    Raises
    ------
    InputError
        If a column is missing, or is there twice.
    """

    def __init__(self, name: str, header: Sequence[str], columns: Mapping[str, str]) -> None:
        self._name = name
        self._time_column, self._places = _places(name, header, columns)
        self._unread = tuple(_unread(name, header, self._places))
        self._words = Counter[str]()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Columns that are not looked at, and classes so far that are no words of ours."""
        return (*self._unread, *_strange(self._name, self._words))

    def add(self, rows: Rows, where: str, fields: Sequence[str], from_us: int = 0) -> int:
        """Read a row and put it to others; return its time.

        Raises
        ------
        InputError
            If a field is wrong, its time is before `from_us`, or its identifier is there at that time; the rows stay as
            they were.
        """
        places, scale = self._places, TIMES[self._time_column]
        t = _within(where, self._time_column, fields[places[self._time_column]], (0.0, MAX_MEDIA_US / scale))
        key = round(t * scale), read_name(where, "id", fields[places["id"]])
        if key[0] < from_us:
            raise InputError(f"{where}: expected a time of {from_us} us or later, got {key[0]} us")
        if key in rows:
            line = rows[key][0].rpartition(":")[2]
            raise InputError(f"{where}: expected each id once a time, got {key[1]!r} at {key[0]} us as in line {line}")
        word = fields[places["class"]].casefold() or _UNKNOWN if "class" in places else ""
        rows[key] = (
            where,
            [_within(where, one, fields[places[one]], _RANGES[one]) for one in _NUMBERS],
            word if word in CLASS_NAMES else _UNKNOWN,
            read_name(where, "sensor", fields[places["sensor"]]) if "sensor" in places else "",
            _within(where, "sigma_m", fields[places["sigma_m"]], _SIGMA_RANGE) if "sigma_m" in places else 0.0,
        )
        self._words[word] += 1
        return key[0]

    def gathered(self, rows: Rows) -> Trajectories:
        """Give rows, one or more, as arrays, sorted by time and identifier."""
        keys = sorted(rows)
        _, values, classes, sensors, sigmas_m = zip(*map(rows.__getitem__, keys), strict=True)
        return Trajectories(
            np.array([t_us for t_us, _ in keys], dtype=np.int64),
            tuple(name for _, name in keys),
            np.array(values),
            classes if "class" in self._places else (),
            sensors=sensors if "sensor" in self._places else (),
            sigma_m=np.array(sigmas_m if "sigma_m" in self._places else ()),
        )


def _places(name: str, header: Sequence[str], columns: Mapping[str, str]) -> tuple[str, dict[str, int]]:
    """Find the column of each of our names; return the time column's name and all places."""
    unknown = sorted(set(columns) - set(KNOWN_COLUMNS))
    if unknown:
        raise InputError(f"column map: expected names out of {', '.join(KNOWN_COLUMNS)}, got {unknown[0]!r}")
    theirs = {one: columns.get(one, one) for one in KNOWN_COLUMNS if columns.get(one, one) in header}
    refuse_twice(name, header, theirs.values())
    times = [one for one in TIMES if one in theirs]
    missing = [one for one in ("id", *_NUMBERS, *sorted(set(_OPTIONAL) & set(columns))) if one not in theirs]
    if not times or missing:
        wanted = ", ".join([*([] if times else ["t_us or t_s"]), *missing])
        came = ", ".join(header) or "an empty file"
        raise InputError(f"{name}:1: expected columns {wanted} (map other names with --columns), got {came}")
    for one in times[1:]:
        del theirs[one]
    return times[0], {one: header.index(their) for one, their in theirs.items()}


def _unread(name: str, header: Sequence[str], places: Mapping[str, int]) -> Iterator[str]:
    unread = [repr(column) for place, column in enumerate(header) if place not in places.values()]
    if unread:
        known = f"expected columns {', '.join(KNOWN_COLUMNS)}"
        yield f"{name}:1: {known}, got others, which are left out: {', '.join(unread)}"


def _strange(name: str, words: Mapping[str, int]) -> Iterator[str]:
    """Say which classes are none of ours: a car of such a class gets one by its size."""
    strange = [f"{word!r} ({n} rows)" for word, n in sorted(words.items()) if word and word not in CLASS_NAMES]
    if strange:
        yield f"{name}: column class: expected {', '.join(CLASS_NAMES)}, got {', '.join(strange)}: taken as {_UNKNOWN}"


def _within(where: str, column: str, text: str, limits: tuple[float, float]) -> float:
    value = read_number(where, column, text)
    if not limits[0] <= value <= limits[1]:
        raise InputError(f"{where}: column {column}: expected {limits[0]:g} to {limits[1]:g}, got {text!r}")
    return value


def is_trajectories(path: Path) -> bool:
    """Tell whether a path is read as trajectories: by its name, or since it is a pipe."""
    return path.suffix.lower() in ROW_SUFFIXES or is_read_once(path)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryInput(Input):
    """Read the objects of a trajectory file; vision is skipped."""

    kind: ClassVar[InputKind] = "trajectory"
    trajectories: Trajectories

    @classmethod
    def fits(cls, asked: Asked) -> bool:
        """Take a file of rows, unless a detector is to look at it."""
        return asked.detector is None and is_trajectories(asked.path)

    @classmethod
    def open(cls, asked: Asked) -> "TrajectoryInput":
        """Read the file."""
        read = load_trajectories(asked.path, asked.columns)
        path = Path("stdin") if asked.path in STANDARD_INPUT else asked.path
        times = len(read.times_us)
        return cls(path=path, trajectories=read, network=asked.site.network, warnings=read.warnings, frame_count=times)

    @property
    def contents(self) -> tuple[int, str]:
        """Return what was read of it: a pipe gives its bytes but once."""
        return self.trajectories.size_bytes, self.trajectories.digest

    def feed(self, *, apart: bool = False) -> Feed:
        """Give the objects of each time; nothing needs to look at them."""
        return Feed(TRAJECTORIES, self.trajectories)
