"""What do the lines of a detection file say? Readers of MOT text and of CSV, with the line of every error."""

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vision.errors import VisionError
from vision.networks.box_detector import CLASS_NAMES, UNKNOWN, GroundBoxes, ImageBoxes
from vision.networks.settings import NetworkSettings
from vision.networks.stored_detections import StoredDetections
from vision.objects import FloatArray

DETECTION_SUFFIXES = (".txt", ".csv")
# How files without scores say so, in the column for them.
NO_SCORE = -1.0
FAR_PX, FAR_M, LONG_M = 1e6, 1e7, 200.0
MAX_T_US, MAX_FRAME = 10**14, 10**9
MOT_LEAST = 6
# Stricter than float(), which takes 1_0, words such as nan, and the digits of any script.
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)

TIMES: Mapping[str, float] = {"t_us": 1.0, "t_s": 1e6, "frame": 1.0}
UPRIGHT = ("left_px", "top_px", "width_px", "height_px")
ORIENTED = ("x_px", "y_px", "length_px", "width_px", "angle_rad")
GROUND = ("x_m", "y_m")
GROUND_EXTRA = ("heading_rad", "length_m", "width_m")
KNOWN_COLUMNS = (*TIMES, *UPRIGHT, *ORIENTED[:3], ORIENTED[4], *GROUND, *GROUND_EXTRA, "score", "class")
_LIMITS: Mapping[str, tuple[float, float]] = {
    "left_px": (-FAR_PX, FAR_PX),
    "top_px": (-FAR_PX, FAR_PX),
    "x_px": (-FAR_PX, FAR_PX),
    "y_px": (-FAR_PX, FAR_PX),
    "width_px": (1e-3, FAR_PX),
    "height_px": (1e-3, FAR_PX),
    "length_px": (1e-3, FAR_PX),
    "angle_rad": (-6.3, 6.3),  # degrees are the usual mistake
    "x_m": (-FAR_M, FAR_M),
    "y_m": (-FAR_M, FAR_M),
    "heading_rad": (-6.3, 6.3),
    "length_m": (0.01, LONG_M),
    "width_m": (0.01, LONG_M),
    "score": (-1e6, 1e6),
}


@dataclass(frozen=True, slots=True)
class ReadingRules:
    """What must be known about a file of detections besides.

    Attributes
    ----------
    columns : our column names to the file's, where they differ.
    classes : number of the file's class to our word; empty to take all rows for vehicles.
    score_threshold : rows with a lower score are left out; a score of -1 stands for none, and counts as 1.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    classes: Mapping[int, str] = field(default_factory=dict)
    score_threshold: float = 0.25


@dataclass(slots=True)
class _Rows:
    """What was read so far: keys, numbers, scores and classes of the rows that are kept."""

    keys: list[int] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    class_numbers: list[int] = field(default_factory=list)

    def add(self, key: int, values: list[float], score: float, class_number: int | None, rules: ReadingRules) -> None:
        """Keep a row, unless it is too unsure or no vehicle."""
        sure = 1.0 if score == NO_SCORE else score
        if class_number is not None and sure >= rules.score_threshold:
            self.keys.append(key)
            self.values.append(values)
            self.scores.append(min(max(sure, 0.0), 1.0))
            self.class_numbers.append(class_number)


# Rows, what their numbers are, and whether their keys are numbers of frames.
_Read = tuple[_Rows, tuple[str, ...], bool]


def read_detections(
    path: Path, rules: ReadingRules | None = None, settings: NetworkSettings | None = None
) -> StoredDetections:
    """Read a file of detections: ``.txt`` is MOT text, ``.csv`` is CSV.

    Parameters
    ----------
    path : of the file.
    rules : what must be known about it besides.
    settings : as of `StoredDetections`.

    Raises
    ------
    VisionError
        If the file cannot be read, a column is missing, or a field is not what it should be. The message names the
        file, the line and the field.
    """
    rules = rules if rules is not None else ReadingRules()
    if path.suffix.lower() not in DETECTION_SUFFIXES:
        raise VisionError(f"{path}: expected MOT text (.txt) or CSV (.csv), got {path.suffix or 'no suffix'!r}")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = csv.reader(file)
            read = _read_csv if path.suffix.lower() == ".csv" else _read_mot
            return _stored(*read(path, lines, rules), settings)
    except OSError as error:
        raise VisionError(f"{path}: expected a readable file of detections, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise VisionError(f"{path}: expected UTF-8, got byte {error.object[error.start]:#04x}") from error
    except csv.Error as error:
        raise VisionError(f"{path}: expected fields between commas, got {error}") from error


def _read_mot(path: Path, lines: Iterator[list[str]], rules: ReadingRules) -> _Read:
    if rules.columns:
        raise VisionError(f"{path}: expected a .csv file to go with a column map, got MOT text")
    rows = _Rows()
    for number, fields in enumerate(lines, start=1):
        if not fields or not "".join(fields).strip():
            continue
        if len(fields) < MOT_LEAST:
            raise VisionError(f"{path}:{number}: expected {MOT_LEAST} to 10 fields, got {len(fields)}")
        where = f"{path}:{number}"
        frame = _whole(where, "frame", fields[0], 1, MAX_FRAME)
        values = [_number(where, name, text) for name, text in zip(UPRIGHT, fields[2:6], strict=True)]
        score = _number(where, "score", fields[6]) if len(fields) > 6 else NO_SCORE
        class_number = _mot_class(where, fields, rules)
        # The first row of MOT text is the first frame; pixels count from the corner of the first one there.
        rows.add(frame - 1, [values[0] - 1, values[1] - 1, *values[2:]], score, class_number, rules)
    return rows, UPRIGHT, True


def _mot_class(where: str, fields: list[str], rules: ReadingRules) -> int | None:
    """Read the class, which differs from data set to data set: without a table of classes all rows are vehicles."""
    if not rules.classes or len(fields) <= 7:
        return CLASS_NAMES.index(UNKNOWN)
    return _class(where, fields[7], rules)


def _read_csv(path: Path, lines: Iterator[list[str]], rules: ReadingRules) -> _Read:
    header = [name.strip() for name in next(lines, [])]
    places = _places(path, header, rules.columns)
    time = next(name for name in TIMES if name in places)
    names = _shape(path, header, places)
    rows = _Rows()
    for number, fields in enumerate(lines, start=2):
        if not fields:
            continue
        where = f"{path}:{number}"
        if len(fields) != len(header):
            raise VisionError(f"{where}: expected {len(header)} fields, got {len(fields)}")
        values = [_number(where, name, fields[places[name]]) for name in names]
        score = _number(where, "score", fields[places["score"]]) if "score" in places else NO_SCORE
        class_number = _class(where, fields[places["class"]], rules) if "class" in places else len(CLASS_NAMES) - 1
        rows.add(_key(where, time, fields[places[time]]), values, score, class_number, rules)
    return rows, names, time == "frame"


def _places(path: Path, header: list[str], columns: Mapping[str, str]) -> dict[str, int]:
    unknown = sorted(set(columns) - set(KNOWN_COLUMNS))
    if unknown:
        raise VisionError(f"column map: expected names out of {', '.join(KNOWN_COLUMNS)}, got {unknown[0]!r}")
    wanted = {name: columns.get(name, name) for name in KNOWN_COLUMNS}
    places = {name: header.index(theirs) for name, theirs in wanted.items() if theirs in header}
    if not any(name in places for name in TIMES):
        raise VisionError(f"{path}:1: expected a column t_us, t_s or frame, got {', '.join(header) or 'an empty file'}")
    return places


def _shape(path: Path, header: list[str], places: Mapping[str, int]) -> tuple[str, ...]:
    """Tell which columns hold the boxes: on the ground before pixels, oriented before upright."""
    if all(name in places for name in GROUND):
        return (*GROUND, *(name for name in GROUND_EXTRA if name in places))
    for names in (ORIENTED, UPRIGHT):
        if all(name in places for name in names):
            return names
    shapes = " or ".join(", ".join(names) for names in (GROUND, ORIENTED, UPRIGHT))
    raise VisionError(f"{path}:1: expected columns {shapes}, got {', '.join(header)}")


def _stored(
    rows: _Rows, names: tuple[str, ...], is_by_frame: bool, settings: NetworkSettings | None
) -> StoredDetections:
    keys = np.array(rows.keys, np.int64)
    order = np.argsort(keys, kind="stable")
    values = np.array(rows.values, np.float64).reshape(len(keys), len(names))[order]
    column = {name: values[:, place] for place, name in enumerate(names)}
    scores, classes = np.array(rows.scores)[order], np.array(rows.class_numbers, np.intp)[order]
    boxes = _on_ground(column, scores, classes) if "x_m" in column else _in_image(column, scores, classes)
    return StoredDetections(keys[order], boxes, is_by_frame=is_by_frame, settings=settings)


def _on_ground(column: Mapping[str, FloatArray], scores: FloatArray, classes: NDArray[np.intp]) -> GroundBoxes:
    unknown = np.full(len(scores), np.nan)
    heading_rad, length_m, width_m = (column.get(name, unknown) for name in GROUND_EXTRA)
    return GroundBoxes(np.column_stack([column["x_m"], column["y_m"]]), heading_rad, length_m, width_m, scores, classes)


def _in_image(column: Mapping[str, FloatArray], scores: FloatArray, classes: NDArray[np.intp]) -> ImageBoxes:
    count = len(scores)
    if "angle_rad" in column:
        centre_px = np.column_stack([column["x_px"], column["y_px"]])
        size_px = np.column_stack([column["length_px"], column["width_px"]])
        return ImageBoxes(centre_px, size_px, column["angle_rad"], np.ones(count, np.bool_), scores, classes)
    size_px = np.column_stack([column["width_px"], column["height_px"]])
    # Left and top are the corner of a pixel, whose centre is half a pixel farther in.
    centre_px = np.column_stack([column["left_px"], column["top_px"]]) + size_px / 2 - 0.5
    return ImageBoxes(centre_px, size_px, np.zeros(count), np.zeros(count, np.bool_), scores, classes)


def _key(where: str, name: str, text: str) -> int:
    if name == "frame":
        return _whole(where, name, text, 0, MAX_FRAME)
    scale = TIMES[name]
    return round(_within(where, name, text, (0.0, MAX_T_US / scale)) * scale)


def _class(where: str, text: str, rules: ReadingRules) -> int | None:
    """Read a class, a word of ours or a number; None if the number stands for no vehicle."""
    word = text.strip()
    if word in CLASS_NAMES:
        return CLASS_NAMES.index(word)
    if not word or word == "-1":
        return CLASS_NAMES.index(UNKNOWN)
    if word.isascii() and word.isdecimal() and rules.classes:
        ours = rules.classes.get(int(word))
        return None if ours is None else CLASS_NAMES.index(ours)
    expected = f"one of {', '.join(CLASS_NAMES)}, or a number and a table of classes"
    raise VisionError(f"{where}: class: expected {expected}, got {text!r}")


def _whole(where: str, name: str, text: str, least: int, most: int) -> int:
    value = _within(where, name, text, (least, most))
    if value != round(value):
        raise VisionError(f"{where}: {name}: expected a whole number, got {text!r}")
    return round(value)


def _number(where: str, name: str, text: str) -> float:
    return _within(where, name, text, _LIMITS[name])


def _within(where: str, name: str, text: str, limits: tuple[float, float]) -> float:
    if not _DECIMAL.fullmatch(text.strip()):
        raise VisionError(f"{where}: {name}: expected a finite number, got {text!r}")
    value = float(text)
    if not limits[0] <= value <= limits[1]:
        raise VisionError(f"{where}: {name}: expected {limits[0]:g} to {limits[1]:g}, got {text!r}")
    return value
