"""Writes small ONNX networks byte by byte, so that tests need no package that can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
Attribute = int | Sequence[int]

FLOAT, INT64 = 1, 7
_INT, _INTS = 2, 7  # AttributeProto.AttributeType


def varint(value: int) -> bytes:
    """Seven bits a byte, the lowest first."""
    out = bytearray()
    while True:
        value, low = value >> 7, value & 0x7F
        out.append(low | (0x80 if value else 0))
        if not value:
            return bytes(out)


def number(field: int, value: int) -> bytes:
    return varint(field << 3) + varint(value)


def chunk(field: int, value: bytes | str) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return varint(field << 3 | 2) + varint(len(data)) + data


def tensor(name: str, values: FloatArray | IntArray) -> bytes:
    """A TensorProto with its values as raw bytes."""
    kind = INT64 if values.dtype == np.int64 else FLOAT
    shape = b"".join(number(1, size) for size in values.shape)
    little = values.astype("<i8" if kind == INT64 else "<f4")
    return shape + number(2, kind) + chunk(8, name) + chunk(9, little.tobytes())


def attribute(name: str, value: Attribute) -> bytes:
    if isinstance(value, int):
        return chunk(1, name) + number(3, value) + number(20, _INT)
    return chunk(1, name) + b"".join(number(8, one) for one in value) + number(20, _INTS)


def node(kind: str, inputs: Sequence[str], output: str, **attributes: Attribute) -> bytes:
    ins = b"".join(chunk(1, name) for name in inputs)
    said = b"".join(chunk(5, attribute(name, value)) for name, value in attributes.items())
    return ins + chunk(2, output) + chunk(3, output) + chunk(4, kind) + said


def value_info(name: str, shape: Sequence[int]) -> bytes:
    dims = b"".join(chunk(1, number(1, size) if size else b"") for size in shape)  # 0: any
    return chunk(1, name) + chunk(2, chunk(1, number(1, FLOAT) + chunk(2, dims)))


def model(
    nodes: Sequence[bytes],
    weights: Mapping[str, FloatArray | IntArray],
    *,
    image: Sequence[int],
    outputs: Mapping[str, Sequence[int]],
    opset: int = 13,
) -> bytes:
    """A ModelProto with one input `images`."""
    graph = (
        b"".join(chunk(1, one) for one in nodes)
        + chunk(2, "test")
        + b"".join(chunk(5, tensor(name, values)) for name, values in weights.items())
        + chunk(11, value_info("images", image))
        + b"".join(chunk(12, value_info(name, shape)) for name, shape in outputs.items())
    )
    return number(1, 8) + chunk(7, graph) + chunk(8, chunk(1, "") + number(2, opset))


STRIDE, KERNEL = 4, 8
# What stands behind the box and the scores of other classes: score, and class and angle where the layout has them.
BEHIND_BOX = {"yolo": 1, "yolo-oriented": 2, "rows": 2, "rows-oriented": 3}


def blob_finder(
    size_px: tuple[int, int],
    *,
    box_px: tuple[float, float] = (16.0, 8.0),
    classes: int = 1,
    pictures: int = 1,
    tables: int | None = None,
    layout: str = "yolo",
) -> bytes:
    """A network `[1, 3, h, w]` -> `[1, 4 + classes, n]` that finds bright patches: a mean filter at a stride.

    Its score is the mean brightness (0 to 1) of 8 x 8 px; the box around it has a fixed size. The last class answers.
    Its first axes are `pictures` and `tables`, 0 for any number; exports may say any and mean 1. Layouts other than
    `yolo` have one class, 0, and angle 0.
    """
    width, height = size_px
    columns, rows = (width - KERNEL) // STRIDE + 1, (height - KERNEL) // STRIDE + 1
    channels = 3 + classes + BEHIND_BOX[layout]
    kernel = np.zeros((channels, 3, KERNEL, KERNEL), np.float32)
    kernel[3 + classes] = 1 / (3 * KERNEL * KERNEL)
    places = np.zeros((1, channels, rows, columns), np.float32)
    places[0, 0] = np.arange(columns) * STRIDE + (KERNEL - 1) / 2
    places[0, 1] = (np.arange(rows) * STRIDE + (KERNEL - 1) / 2)[:, None]
    places[0, 2], places[0, 3] = box_px
    if layout == "rows":
        places[0, :2] -= places[0, 2:4] / 2
        places[0, 2:4] += places[0, :2]
    nodes = [
        node("Conv", ["images", "kernel"], "mean", kernel_shape=[KERNEL, KERNEL], strides=[STRIDE, STRIDE]),
        node("Add", ["mean", "places"], "placed"),
        node("Reshape", ["placed", "shape"], "boxes"),
    ]
    tables = pictures if tables is None else tables
    shape = np.array([tables, channels, rows * columns], np.int64)  # 0: as many as came
    weights = {"kernel": kernel, "places": places, "shape": shape}
    if layout.startswith("yolo"):
        return model(nodes, weights, image=[pictures, 3, height, width], outputs={"boxes": shape.tolist()})
    nodes.append(node("Transpose", ["boxes"], "rows", perm=[0, 2, 1]))
    outputs = {"rows": [tables, rows * columns, channels]}
    return model(nodes, weights, image=[pictures, 3, height, width], outputs=outputs)


def constant_answer(rows: FloatArray, size_px: tuple[int, int]) -> bytes:
    """A network that answers every picture with the same rows, whatever their shape."""
    width, height = size_px
    answer = np.asarray(rows, np.float32)
    nothing = [
        # The picture must be used, or readers drop it: its mean, times zero.
        node("ReduceMean", ["images"], "mean", axes=[1, 2, 3], keepdims=1),
        node("Mul", ["mean", "zero"], "nothing"),
        node("Reshape", ["nothing", "shape"], "flat"),
        node("Add", ["answer", "flat"], "out"),
    ]
    shape = np.ones(answer.ndim, np.int64)
    weights = {"zero": np.zeros((1, 1, 1, 1), np.float32), "answer": answer, "shape": shape}
    return model(nothing, weights, image=[1, 3, height, width], outputs={"out": list(answer.shape)})
