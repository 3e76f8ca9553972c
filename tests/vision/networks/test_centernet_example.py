"""The example that makes an ONNX file of a package of TensorFlow.js, on a few layers whose answer is known."""

from __future__ import annotations

import io
import json
import runpy
import sys
import tarfile
from base64 import b64encode
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.texts.toml_tables import read_toml
from tests.vision.support import make_frame
from vision.networks.onnx.detector import OnnxDetector
from vision.networks.onnx.settings import OnnxSettings

pytest.importorskip("onnx", reason="comes with the extra `train`")

SCRIPT = Path(__file__).parents[3] / "examples" / "centernet_to_onnx.py"
CAR, SIDES_PX = 2, (16.0, 8.0, 24.0, 12.0)  # left, top, right, bottom of the peak
SPOT_PX = 200, 120


def first_tap(outputs: int, inputs: int) -> np.ndarray:
    """A kernel of 3 x 3 that takes its first cell alone, so that the side on which a picture is padded shows."""
    kernel = np.zeros((3, 3, inputs, outputs), np.float16)
    kernel[0, 0] = 1 / inputs
    return kernel


WEIGHTS = {
    "dim": first_tap(1, 3),
    "none": np.zeros(1, np.float16),
    "half": first_tap(1, 1),
    "heat_kernel": np.zeros((1, 1, 1, 80), np.float16),
    "heat_bias": np.full(80, -9.0, np.float16),
    "sides_kernel": np.zeros((1, 1, 1, 4), np.float16),
    "sides_bias": np.array(SIDES_PX, np.float16) / np.float16(16),
    "tower_0/mul/y": np.array(16.0, np.float16),
    "zero": np.array(0.0, np.float16),
    "twice": np.array([128, 128], np.int32),
    "last": np.array(3, np.int32),
    "over": np.array([1, 2], np.int32),
}
WEIGHTS["heat_kernel"][..., CAR] = 1 / 32  # 250 is 7.8


def layer(
    kind: str, name: str, *inputs: str, stride: int = 1, padding: str = "SAME", fused: str = ""
) -> dict[str, object]:
    said = {
        "strides": {"list": {"i": ["1", str(stride), str(stride), "1"]}},
        "padding": {"s": b64encode(padding.encode()).decode()},
        "fused_ops": {"list": {"s": [b64encode(one.encode()).decode() for one in fused.split()]}},
    }
    return {"op": kind, "name": name, "input": list(inputs), "attr": said}


LAYERS = [
    {"op": "Placeholder", "name": "tower_0/images", "attr": {}},
    *({"op": "Const", "name": name, "attr": {}} for name in WEIGHTS),
    layer("_FusedConv2D", "halved", "tower_0/images", "dim", "none", stride=2, fused="BiasAdd Relu"),
    layer("FusedDepthwiseConv2dNative", "fourth", "halved", "half", "none", stride=2, fused="BiasAdd"),
    layer("DepthwiseConv2dNative", "eighth", "fourth", "half", stride=2),
    layer("ResizeBilinear", "doubled", "eighth", "twice"),
    layer("Mean", "mean", "doubled", "over"),
    layer("Relu6", "level", "mean"),
    layer("Mul", "nothing", "level", "zero"),
    layer("Add", "spot", "fourth", "nothing"),
    layer("_FusedConv2D", "heat", "spot", "heat_kernel", "heat_bias", padding="VALID", fused="BiasAdd"),
    layer("ConcatV2", "both", "spot", "doubled", "last"),
    layer("Relu", "bright", "both"),
    layer("Sigmoid", "scores", "heat"),
    layer("_FusedConv2D", "lengths", "spot", "sides_kernel", "sides_bias", padding="VALID", fused="BiasAdd"),
    layer("Mul", "tower_0/mul", "lengths", "tower_0/mul/y"),
    layer("Identity", "tower_0/keypoints", "scores"),
    layer("Identity", "tower_0/wh", "tower_0/mul"),
    layer("TopKV2", "of the tail", "tower_0/keypoints"),  # written anew, never read
]


def package(folder: Path, layers: list[dict[str, object]]) -> Path:
    """What `npm pack` gives: a graph of TensorFlow.js and its weights, as float16."""
    entries = [
        {"name": name, "shape": list(array.shape), "dtype": "int32"}
        if array.dtype == np.int32
        else {"name": name, "shape": list(array.shape), "dtype": "float32", "quantization": {"dtype": "float16"}}
        for name, array in WEIGHTS.items()
    ]
    graph = {"modelTopology": {"node": layers}, "weightsManifest": [{"weights": entries}]}
    data = b"".join(array.tobytes() for array in WEIGHTS.values())
    path = folder / "package.tgz"
    with tarfile.open(path, "w:gz") as archive:
        for name, content in (("json", json.dumps(graph).encode()), ("bin", data)):
            entry = tarfile.TarInfo(f"package/models/centernet.{name}")
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return path


def convert(package: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the script as from the command line."""
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), str(package), str(out)])
    runpy.run_path(str(SCRIPT), run_name="__main__")


def test_network_and_recipe_find_the_spot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "net.onnx"
    convert(package(tmp_path, LAYERS), out, monkeypatch)
    recipe = read_toml(out.with_suffix(".toml"), OnnxSettings, what="a recipe")
    assert (recipe.layout, recipe.classes[CAR]) == ("rows", "car")
    assert "none stated" in recipe.licence
    rows, columns = np.mgrid[:512, :512]
    distance = np.hypot(columns - SPOT_PX[0], rows - SPOT_PX[1])
    luma = 16 + 219 * np.exp(-((distance / 12) ** 2))
    detector = OnnxDetector(out, replace(recipe, score_threshold=0.2), (512, 512))
    [[left, top, right, bottom]] = detector.detect(make_frame(luma.astype(np.float32))).bounds_px().tolist()
    around = [SPOT_PX[0] - SIDES_PX[0], SPOT_PX[1] - SIDES_PX[1], SPOT_PX[0] + SIDES_PX[2], SPOT_PX[1] + SIDES_PX[3]]
    assert [left, top, right, bottom] == pytest.approx(around, abs=1e-3)


@pytest.mark.parametrize("kind", ["file", "package", "layers"])
def test_other_packages_are_refused_after_the_licence_was_told(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = package(tmp_path, [*LAYERS[: len(WEIGHTS) + 1], layer("Softmax", "soft", "tower_0/images")])
    if kind == "file":
        path.write_text("no package")
    elif kind == "package":
        with tarfile.open(path, "w:gz"):
            pass
    message = r"package.tgz: expected @vladmandic/human 3.3.6 as `npm pack` gives it, got"
    if kind == "layers":
        message = r"layer soft: expected one that @vladmandic/human 3.3.6 has, got Softmax"
    with pytest.raises(SystemExit, match=message):
        convert(path, tmp_path / "net.onnx", monkeypatch)
    assert capsys.readouterr().err.startswith("licence: MIT for the package; none stated at")
    assert not (tmp_path / "net.onnx").exists()
