"""What do the numbers of a network's output mean? Boxes in the pixels of its input, by the declared layout."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vision.errors import VisionError
from vision.networks.box_detector import CLASS_NAMES, ImageBoxes
from vision.networks.onnx.settings import Layout
from vision.objects import FloatArray, IntArray

ROW_COLUMNS: Mapping[str, int] = {"rows": 6, "rows-oriented": 7}


def decode(output: NDArray[np.float32], layout: Layout, classes: Mapping[int, str], least_score: float) -> ImageBoxes:
    """Read the boxes of vehicles out of an output.

    Parameters
    ----------
    output : as the network gave it.
    layout : what its axes mean, see `OnnxSettings.layout`.
    classes : number of the network's class to our word; others are dropped.
    least_score : boxes with a lower score are dropped, and so are those with a number that is not finite.

    Returns
    -------
    Boxes in pixels of the input.

    Raises
    ------
    VisionError
        If the output has another shape than its layout, fewer classes than declared, or holds no finite number.

    Examples
    --------
    >>> rows = np.array([[10.0, 20.0, 30.0, 28.0, 0.9, 2.0], [0.0, 0.0, 5.0, 5.0, 0.8, 0.0]], np.float32)
    >>> boxes = decode(rows, "rows", {2: "car"}, 0.5)
    >>> boxes.centre_px.tolist(), boxes.size_px.tolist()
    ([[20.0, 24.0]], [[20.0, 8.0]])
    """
    table = _table(output, layout, classes)
    if table.size and not np.isfinite(table).any():
        fix = "are scale, mean and deviation right?"
        raise VisionError(f"network output: expected finite numbers, got {table.size} that are not; {fix}")
    is_finite = np.isfinite(table).all(axis=1)
    table = table[is_finite]
    boxes = _of_scores(table, layout, classes) if layout.startswith("yolo") else _of_rows(table, layout, classes)
    is_good = (boxes.score >= least_score) & (boxes.class_number >= 0) & (boxes.size_px > 0).all(axis=1)
    return boxes.select(is_good)


def _table(output: NDArray[np.float32], layout: Layout, classes: Mapping[int, str]) -> FloatArray:
    """Bring the output to one row for each candidate."""
    shape = tuple(output.shape)
    table = np.asarray(output, np.float64)
    if table.ndim == 3 and table.shape[0] == 1:
        table = table[0]
    if layout in ROW_COLUMNS:
        if table.ndim == 2 and table.shape[1] == ROW_COLUMNS[layout]:
            return table
        raise VisionError(f"network output: expected (n, {ROW_COLUMNS[layout]}) for layout {layout!r}, got {shape!r}")
    least = 5 + max(classes) + (layout == "yolo-oriented")
    if table.ndim == 2 and table.shape[0] >= least:
        return table.T
    raise VisionError(
        f"network output: expected (at least {least}, n) for layout {layout!r} with class {max(classes)}, got {shape!r}"
    )


def _of_scores(table: FloatArray, layout: Layout, classes: Mapping[int, str]) -> ImageBoxes:
    is_oriented = layout == "yolo-oriented"
    scores = table[:, 4:-1] if is_oriented else table[:, 4:]
    best = np.argmax(scores, axis=1)
    return ImageBoxes(
        centre_px=table[:, :2],
        size_px=table[:, 2:4],
        angle_rad=table[:, -1] if is_oriented else np.zeros(len(table)),
        is_oriented=np.full(len(table), is_oriented),
        score=np.clip(scores[np.arange(len(table)), best], 0.0, 1.0),
        class_number=our_class(best, classes),
    )


def _of_rows(table: FloatArray, layout: Layout, classes: Mapping[int, str]) -> ImageBoxes:
    is_oriented = layout == "rows-oriented"
    return ImageBoxes(
        centre_px=table[:, :2] if is_oriented else (table[:, :2] + table[:, 2:4]) / 2,
        size_px=table[:, 2:4] if is_oriented else table[:, 2:4] - table[:, :2],
        angle_rad=table[:, 6] if is_oriented else np.zeros(len(table)),
        is_oriented=np.full(len(table), is_oriented),
        score=np.clip(table[:, 4], 0.0, 1.0),
        class_number=our_class(table[:, 5], classes),
    )


def our_class(numbers: IntArray | FloatArray, classes: Mapping[int, str]) -> IntArray:
    """Translate the numbers of somebody's classes into ours.

    Parameters
    ----------
    numbers : (n,).
    classes : number to word of `CLASS_NAMES`.

    Returns
    -------
    (n,) row of `CLASS_NAMES`; -1 for what is no vehicle.

    Examples
    --------
    >>> our_class(np.array([0, 2]), {2: "car"}).tolist()
    [-1, 0]
    """
    ours = np.full(len(numbers), -1, np.intp)
    for number, word in classes.items():
        ours[numbers == number] = CLASS_NAMES.index(word)
    return ours
