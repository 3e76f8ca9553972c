from __future__ import annotations

import numpy as np

from tests.cases import for_each
from tests.vision.onnx_file import blob_finder, model, node
from vision.networks.onnx_header import OnnxHeader, read_header


def test_input_and_operator_set_are_read_past_the_weights() -> None:
    assert read_header(blob_finder((64, 48))) == OnnxHeader(13, "images", (1, 3, 48, 64))


def test_open_axes_are_zero() -> None:
    data = model([node("Relu", ["images"], "out")], {}, image=[1, 3, (1 << 64) - 1, 0], outputs={"out": [1]})
    assert read_header(data).input_shape == (1, 3, 0, 0)


@for_each("seed", range(200))
def test_damaged_files_raise_value_errors_only(seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = bytearray(blob_finder((16, 16)))
    for place in rng.integers(0, len(data), 3):
        data[place] = int(rng.integers(0, 256))
    cut = bytes(data[: int(rng.integers(1, len(data) + 1))])
    try:
        header = read_header(cut)
    except ValueError:
        return
    assert all(0 <= size < 1 << 32 for size in header.input_shape)
