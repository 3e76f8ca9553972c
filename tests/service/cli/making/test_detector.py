"""`dyknow detector`: a network is installed, listed and tried; what is wrong with it is told before."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from pathlib import Path

import cv2
import numpy as np
import pytest

from service.cli.app import run
from service.runs.inputs.detectors import SHIPPED_DETECTORS, detectors_folder
from tests.service.runs.inputs.test_detectors import (
    FRAMES,
    NORTH_M,
    SIZE_PX,
    east_m,
    last_states,
    make_site,
    make_video,
)
from tests.vision.onnx_file import blob_finder, constant_answer

RECIPE = """layout = "yolo"
classes = { "0" = "car" }
score_threshold = 0.8
nms_threshold = 0.05
licence = "CC0 1.0"
source = "made by a test"
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DYKNOW_DETECTORS", str(tmp_path / "installed"))
    return tmp_path / "installed"


def fetched(folder: Path, recipe: str = RECIPE, data: bytes | None = None) -> Path:
    """Weights as somebody has fetched them, the recipe beside."""
    path = folder / "traffic.onnx"
    path.write_bytes(blob_finder(SIZE_PX, box_px=(18.0, 9.0)) if data is None else data)
    path.with_suffix(".toml").write_text(recipe, encoding="utf-8")
    return path


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 3) -> str:
    assert run([*map(str, arguments)]) == code
    return capsys.readouterr().err


@pytest.mark.long
def test_installed_network_is_found_by_its_name(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    weights = fetched(tmp_path)
    digest = sha256(weights.read_bytes()).hexdigest()
    assert run(["detector", "add", str(weights), "--sha256", digest.upper()]) == 0
    said = capsys.readouterr()
    assert said.err == "note: licence: CC0 1.0\nnote: source: made by a test\n"
    assert "--detector onnx:traffic" in said.out
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == {
        path.name: path.read_bytes() for path in (weights, weights.with_suffix(".toml"))
    }
    weights.unlink()
    video, site, log = make_video(tmp_path / "video.mp4"), make_site(tmp_path), tmp_path / "log.db"
    assert run(["process", str(video), "--site", str(site), "--log", str(log), "--detector", "onnx:traffic"]) == 0
    record, [car] = last_states(log)
    assert car == pytest.approx((east_m(FRAMES - 1), NORTH_M), abs=0.8)
    assert record.detector.startswith("onnx:traffic.onnx (ONNX Runtime ")
    assert record.detector.endswith(", cpu)")


def shipped(name: str) -> list[str]:
    """The row of a network that comes along."""
    digest = sha256((SHIPPED_DETECTORS / f"{name}.onnx").read_bytes()).hexdigest()
    classes = "0=car 1=van 2=truck 3=bus 4=motorcycle"
    source = "the DyKnow project, trained on its own rendered worlds (make detector)"
    return [name, "rows-oriented", classes, "1280 x 736", "Apache-2.0", source, digest]


def test_installed_networks_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights = fetched(tmp_path)
    assert run(["detector", "add", str(weights), "--name", "b"]) == 0
    fetched(tmp_path, RECIPE[: RECIPE.index("licence")] + "input_size_px = [256, 64]\n")
    assert run(["detector", "add", str(weights), "--name", "a"]) == 0
    assert "note: licence: none stated\nnote: source: not stated\n" in capsys.readouterr().err
    assert run(["detector", "list"]) == 0
    digest = sha256(weights.read_bytes()).hexdigest()
    assert [re.split(" {2,}", line) for line in capsys.readouterr().out.splitlines()][1:-1] == [
        ["a", "yolo", "0=car", "256 x 64", "none stated", "not stated", digest],
        shipped("above"),
        ["b", "yolo", "0=car", "as the weights", "CC0 1.0", "made by a test", digest],
    ]
    assert run(["detector", "list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["detectors"]
    assert [one["name"] for one in listed] == ["a", "above", "b", "low"]
    assert [(one["input_size_px"], one["classes"]) for one in listed[::2]] == [
        ([256, 64], {"0": "car"}),
        (None, {"0": "car"}),
    ]


def test_recipe_spoilt_since_does_not_hide_the_others(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        assert run(["detector", "add", str(fetched(tmp_path)), "--name", name]) == 0
    (folder / "a.toml").write_text("layout = 3")
    capsys.readouterr()
    assert run(["detector", "list", "--json"]) == 0
    said = capsys.readouterr()
    assert [one["name"] for one in json.loads(said.out)["detectors"]] == ["above", "b", "low"]
    assert f"warning: {folder / 'a.toml'}: layout: expected one of" in said.err


def test_boxes_of_a_frame_are_drawn_and_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights, video, out = fetched(tmp_path), make_video(tmp_path / "video.mp4"), tmp_path / "boxes.png"
    words = ["detector", "try", str(video), "--detector", f"onnx:{weights}", "--at", "1s", "--out", str(out)]
    assert run(words) == 0
    assert "boxes.png: 1 vehicle at 1.00 s, " in capsys.readouterr().out
    picture = cv2.imread(str(out))
    assert picture is not None
    assert picture.shape == (2 * SIZE_PX[1], 2 * SIZE_PX[0], 3)
    assert run([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    [box] = told["boxes"]
    left, top, right, bottom = box["bounds_px"]
    assert ((left + right) / 2, (top + bottom) / 2) == pytest.approx((east_m(25) / 0.25, 31), abs=4.5)
    assert (box["class"], told["look_ms"] > 0) == ("car", True)
    fetched(tmp_path, RECIPE.replace("0.8", "0.999").replace("source", "weak_threshold = 0.8\nsource"))
    assert run(words) == 0
    assert "boxes.png: 0 vehicles at 1.00 s, " in capsys.readouterr().out
    is_yellow = (np.abs(picture.astype(int) - [0, 235, 255]) < 40).all(axis=2)
    rows, columns = np.nonzero(is_yellow)
    assert (columns.min() / 2, columns.max() / 2) == pytest.approx((left, right), abs=2)
    assert (rows.min() / 2, rows.max() / 2) == pytest.approx((top, bottom), abs=2)


def test_wrong_digest_installs_nothing(tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights = fetched(tmp_path)
    came = sha256(weights.read_bytes()).hexdigest()
    said = refusal(capsys, "detector", "add", weights, "--sha256", "0" * 64)
    assert said == (
        f"error: {weights}: expected SHA-256 {'0' * 64}, got {came}; fetch it again, or ask whose digest it is\n"
    )
    assert not folder.exists()


NAN = constant_answer(np.full((1, 5, 3), np.nan, np.float32), SIZE_PX)


@pytest.mark.parametrize(
    ("recipe", "data", "message"),
    [
        (RECIPE.replace("yolo", "ssd"), None, "traffic.toml: layout: expected one of yolo, yolo-oriented, rows, "),
        ("layout = 'yolo'\n", None, "traffic.toml: classes: expected a table such as"),
        (RECIPE, NAN, "traffic.onnx: network output: expected finite numbers, got 15 that are not; are scale, mean"),
        (RECIPE, b"<html>", "traffic.onnx: expected an ONNX file that ONNX Runtime can compute, got"),
        (RECIPE + 'colours = "grey"\n', None, "traffic.onnx: expected an input of (1, 1, height, width)"),
    ],
    ids=["layout", "classes", "nan", "no onnx", "colours"],
)
def test_network_that_cannot_be_used_is_not_installed(
    tmp_path: Path, recipe: str, data: bytes | None, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(capsys, "detector", "add", fetched(tmp_path, recipe, data))
    assert message in said
    assert str(tmp_path) in said
    assert not detectors_folder().exists()


def test_files_that_are_not_there_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "none.onnx: expected a path that can be used" in refusal(capsys, "detector", "add", tmp_path / "none.onnx")
    weights = fetched(tmp_path)
    weights.with_suffix(".toml").unlink()
    said = refusal(capsys, "detector", "add", weights)
    assert "traffic.toml: expected the recipe of the weights (docs/detectors.md lists its fields), got No such" in said


def test_name_that_is_taken_needs_force(tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights = fetched(tmp_path)
    assert run(["detector", "add", str(weights)]) == 0
    fetched(tmp_path, RECIPE + "threads = 2\n")
    said = refusal(capsys, "detector", "add", weights)
    assert f"{folder / 'traffic.onnx'}: expected a new --name, or --force to replace it; got one that is there" in said
    assert "threads" not in (folder / "traffic.toml").read_text()
    assert run(["detector", "add", str(weights), "--force"]) == 0
    assert "threads" in (folder / "traffic.toml").read_text()
    assert sorted(path.name for path in folder.iterdir()) == ["traffic.onnx", "traffic.toml"]


@pytest.mark.parametrize("name", ["../traffic", "a.b", "", "ä"])
def test_names_are_plain_words(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(capsys, "detector", "add", fetched(tmp_path), "--name", name)
    assert f"expected --name of letters, digits, - and _, got {name!r}" in said


def test_name_that_is_not_installed_is_told_with_those_that_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = "process", make_video(tmp_path / "video.mp4"), "--log", tmp_path / "log.db", "--detector", "onnx:trafic"
    assert "--detector: expected an installed detector (above, low), got 'trafic'" in refusal(capsys, *words)
    assert run(["detector", "add", str(fetched(tmp_path))]) == 0
    said = refusal(capsys, *words)
    assert (
        "expected an installed detector (above, low, traffic), got 'trafic'; dyknow detector add FILE installs one"
        in said
    )
    assert not (tmp_path / "log.db").exists()


def test_only_networks_are_tried(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = "detector", "try", make_video(tmp_path / "video.mp4"), "--out", tmp_path / "boxes.png", "--detector"
    assert "--detector: expected onnx:NAME or onnx:PATH" in refusal(capsys, *words, "motion")
    words = *words[:3], "--out", words[2], "--detector"
    said = refusal(capsys, *words, f"onnx:{fetched(tmp_path)}")
    assert "video.mp4: expected a new file, got one that is being read" in said


def test_detectors_lie_in_the_home_of_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DYKNOW_DETECTORS")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert detectors_folder() == tmp_path / "dyknow" / "detectors"
    monkeypatch.setenv("XDG_DATA_HOME", "here")  # a relative one is none, by the standard
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert detectors_folder() == tmp_path / "home" / ".local" / "share" / "dyknow" / "detectors"
