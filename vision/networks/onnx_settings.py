"""How does a network want its pictures, and what do its numbers mean? The TOML beside the weights.

A file of weights does not say whether it takes red or blue first, which of its classes are vehicles, or which of its
columns is the score. `traffic.toml` beside `traffic.onnx` does; docs/detectors.md lists the fields.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

from vision.errors import VisionError
from vision.networks.box_detector import CLASS_NAMES

Layout = Literal["yolo", "yolo-oriented", "rows", "rows-oriented"]
Colours = Literal["rgb", "bgr", "grey"]
Runtime = Literal["auto", "opencv", "onnxruntime"]

MAX_INPUT_PX = 8192
MAX_TILES = 16


@dataclass(frozen=True, slots=True)
class OnnxSettings:
    """What must be known about a network besides its weights.

    Attributes
    ----------
    layout : of the output. ``yolo``: (4 + classes, n), columns x, y, width, height and a score for each class;
        ``yolo-oriented``: the same with the angle as last row; ``rows``: (n, 6) left, top, right, bottom, score, class;
        ``rows-oriented``: (n, 7) x, y, width, height, score, class, angle. A first axis of 1 may stand before each.
    classes : number of the network's class to our word (`CLASS_NAMES`); what is not listed is no vehicle.
    input_size_px : (width, height); None to take them from the weights.
    score_threshold : boxes with a lower score are dropped.
    nms_threshold : of two boxes that share more than this part of their union, the one with the lower score goes.
    colours : order of the input's planes.
    scale, mean, deviation : the input is (value * scale - mean) / deviation, values from 0 to 255.
    tiles : (columns, rows) into which the picture is cut, each of which is looked at by itself.
    overlap : part of a tile that it shares with the next one; at least the longest vehicle should fit.
    runtime : what runs the network; ``auto`` is ONNX Runtime where it is installed, else OpenCV.
    output : name of the output, for a network with several.
    """

    layout: Layout
    classes: Mapping[int, str]
    input_size_px: tuple[int, int] | None = None
    score_threshold: float = 0.25
    nms_threshold: float = 0.5
    colours: Colours = "rgb"
    scale: float = 1 / 255
    mean: float = 0.0
    deviation: float = 1.0
    tiles: tuple[int, int] = (1, 1)
    overlap: float = 0.2
    runtime: Runtime = "auto"
    output: str = ""

    def __post_init__(self) -> None:
        for name, choices in (("layout", get_args(Layout)), ("colours", get_args(Colours))):
            _expect(name, getattr(self, name) in choices, f"one of {', '.join(choices)}", getattr(self, name))
        _expect("runtime", self.runtime in get_args(Runtime), f"one of {', '.join(get_args(Runtime))}", self.runtime)
        named = bool(self.classes) and all(word in CLASS_NAMES for word in self.classes.values())
        _expect("classes", named, f"numbers of classes, each with one of {', '.join(CLASS_NAMES)}", dict(self.classes))
        for name in ("score_threshold", "nms_threshold"):
            _expect(name, 0 <= getattr(self, name) <= 1, "a number from 0 to 1", getattr(self, name))
        _expect("overlap", 0 <= self.overlap <= 0.9, "a number from 0 to 0.9", self.overlap)
        for name in ("scale", "mean", "deviation"):
            _expect(name, math.isfinite(getattr(self, name)), "a finite number", getattr(self, name))
        _expect("deviation", self.deviation > 0, "a number above 0", self.deviation)
        size = self.input_size_px
        _expect("input_size_px", size is None or _is_pair(size, MAX_INPUT_PX), f"1 to {MAX_INPUT_PX}, twice", size)
        _expect("tiles", _is_pair(self.tiles, MAX_TILES), f"columns and rows from 1 to {MAX_TILES}", self.tiles)


def _is_pair(pair: tuple[int, int], most: int) -> bool:
    return len(pair) == 2 and all(1 <= one <= most for one in pair)


def _expect(name: str, is_met: bool, expected: str, came: object) -> None:
    if not is_met:
        raise VisionError(f"{name}: expected {expected}, got {came!r}")


def read_onnx_settings(path: Path) -> OnnxSettings:
    """Read the TOML that describes a network.

    Parameters
    ----------
    path : fields as the attributes of `OnnxSettings`; ``classes`` is a table, ``{ "2" = "car" }``.

    Raises
    ------
    VisionError
        If the file is missing or no TOML, or a field is missing, wrong or unknown.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise VisionError(f"{path}: expected TOML that describes the weights, got {error.strerror or error}") from error
    except ValueError as error:
        raise VisionError(f"{path}: expected TOML in UTF-8, got {error}") from error
    known = [field.name for field in fields(OnnxSettings)]
    for name in ("layout", "classes"):
        if name not in values:
            raise VisionError(f"{path}: {name}: expected the field, got none")
    for name in values:
        if name not in known:
            raise VisionError(f"{path}: {name}: expected one of {', '.join(known)}, got an unknown field")
    try:
        # Any: the types of fields differ, and each was checked by its name.
        checked: dict[str, Any] = {name: _value(name, value) for name, value in values.items()}
        return OnnxSettings(**checked)
    except VisionError as error:
        raise VisionError(f"{path}: {error}") from error


def class_words(value: object) -> dict[int, str]:
    """Read a table of classes, as TOML gives it.

    Parameters
    ----------
    value : ``{"2": "car"}``.

    Raises
    ------
    VisionError
        If a key is no number from 0 up, or a value none of `CLASS_NAMES`.

    Examples
    --------
    >>> class_words({"2": "car"})
    {2: 'car'}
    """
    expected = f'a table such as {{ "2" = "car" }} with words out of {", ".join(CLASS_NAMES)}'
    if not isinstance(value, dict) or not value:
        raise VisionError(f"classes: expected {expected}, got {value!r}")
    for number, word in value.items():
        if not (number.isascii() and number.isdecimal()) or word not in CLASS_NAMES:
            raise VisionError(f"classes: expected {expected}, got {number} = {word!r}")
    return {int(number): str(word) for number, word in value.items()}


def _value(name: str, value: object) -> object:
    """Check the type of one field and give it the type that the settings have."""
    if name == "classes":
        return class_words(value)
    if name in ("input_size_px", "tiles"):
        if isinstance(value, list) and all(type(one) is int for one in value):
            return tuple(value)
        raise VisionError(f"{name}: expected two whole numbers, got {value!r}")
    if name in ("layout", "colours", "runtime", "output"):
        if isinstance(value, str):
            return value
        raise VisionError(f"{name}: expected a text, got {value!r}")
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    raise VisionError(f"{name}: expected a number, got {value!r}")
