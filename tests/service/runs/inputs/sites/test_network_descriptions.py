from __future__ import annotations

from pathlib import Path

import pytest

from service.errors import SiteError
from service.texts.toml_tables import read_toml
from vision.networks.onnx.settings import OnnxSettings


def read_onnx_settings(path: Path) -> OnnxSettings:
    return read_toml(path, OnnxSettings, what="TOML that describes the weights")


def written(folder: Path, text: str) -> Path:
    path = folder / "net.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_fields_are_read(tmp_path: Path) -> None:
    text = """
        layout = "rows-oriented"
        classes = { "2" = "car", "7" = "truck" }
        input_size_px = [640, 384]
        score_threshold = 0.4
        nms_threshold = 0.6
        colours = "bgr"
        scale = 1
        mean = 0.5
        deviation = 0.25
        tiles = [2, 1]
        overlap = 0.1
        output = "boxes"
        providers = ["openvino", "cpu"]
        threads = 2
        licence = "MIT"
        source = "made here"
    """
    assert read_onnx_settings(written(tmp_path, text)) == OnnxSettings(
        layout="rows-oriented",
        classes={2: "car", 7: "truck"},
        input_size_px=(640, 384),
        score_threshold=0.4,
        nms_threshold=0.6,
        colours="bgr",
        scale=1.0,
        mean=0.5,
        deviation=0.25,
        tiles=(2, 1),
        overlap=0.1,
        output="boxes",
        providers=("openvino", "cpu"),
        threads=2,
        licence="MIT",
        source="made here",
    )


BASE = 'layout = "yolo"\nclasses = { "0" = "car" }\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('layout = "yolo"', r"classes: expected a table such as .*, got no such field"),
        ("layout = ", r"expected TOML in UTF-8, got"),
        (
            BASE + "treshold = 1",
            r"treshold: expected one of layout, .*; got an unknown field; did you mean nms_",
        ),
        ('layout = "ssd"\nclasses = { "0" = "car" }', r"layout: expected one of yolo, .*, got 'ssd'"),
        ("layout = 3\n" + 'classes = { "0" = "car" }', r"layout: expected one of yolo, .*, got 3"),
        ('layout = "yolo"\nclasses = ["car"]', r"classes: expected a table such as .*, got \['car'\]"),
        ('layout = "yolo"\nclasses = { "0" = "horse" }', r"classes: expected a table .*, got 0 = 'horse'"),
        ('layout = "yolo"\nclasses = { "x" = "car" }', r"classes: expected a table .*, got x = 'car'"),
        (BASE + "score_threshold = 1.5", r"score_threshold: expected a number from 0 to 1, got 1.5"),
        (BASE + "score_threshold = nan", r"score_threshold: expected a number from 0 to 1, got nan"),
        (BASE + "scale = inf", r"scale: expected a finite number, got inf"),
        (BASE + 'scale = "1/255"', r"scale: expected a finite number, got '1/255'"),
        (BASE + "deviation = 0", r"deviation: expected a number above 0, got 0"),
        (BASE + "tiles = [0, 1]", r"tiles: expected columns and rows from 1 to 16, got \[0, 1\]"),
        (BASE + "tiles = 2", r"tiles: expected columns and rows from 1 to 16, got 2"),
        (BASE + "input_size_px = [640]", r"input_size_px: expected 1 to 8192, twice, got \[640\]"),
        (BASE + "providers = []", r"providers: expected a list out of cpu, cuda, openvino, .*, got \[\]"),
        (BASE + 'providers = ["gpu"]', r"providers: expected a list out of cpu, .*, got \['gpu'\]"),
        (BASE + "threads = 0", r"threads: expected a whole number from 1 to 64, got 0"),
        (BASE + "overlap = 1.0", r"overlap: expected a number from 0 to 0.9, got 1.0"),
    ],
)
def test_wrong_fields_are_told(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SiteError, match=rf"net.toml: {message}"):
        read_onnx_settings(written(tmp_path, text))


def test_missing_description_is_told(tmp_path: Path) -> None:
    with pytest.raises(SiteError, match=r"expected TOML that describes the weights, got No such file"):
        read_onnx_settings(tmp_path / "net.toml")
