"""The recipes of docs/extending.md: the files they name, and the smallest additions made."""

import re
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from data_gen.scenarios import catalogue
from data_gen.scenarios.motorway import motorway
from service.cli import app
from tests.docs.commands import ROOT
from vision import ImageBoxes
from vision.camera import box_camera
from vision.video.frame import Frame

PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


def test_every_file_of_the_recipes_is_there() -> None:
    named = set(re.findall(r"`((?:\w+/)+[\w.]+)`", PAGE))
    assert len(named) > 30
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize(("title", "most"), [("A relation between cars", 4), ("A form of KPL", 9), ("An operator", 12)])
def test_additions_touch_as_few_files_as_promised(title: str, most: int) -> None:
    recipe = PAGE.split(f"## {title}")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in recipe.splitlines() if line.startswith("| `")]
    assert 0 < sum(len(re.findall(r"`[\w/.]+`", row)) for row in rows) <= most


def test_a_command_is_a_function_and_a_row(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def hello(name: str) -> None:
        print(f"hello {name}")

    monkeypatch.setattr(app, "COMMANDS", {**app.COMMANDS, "hello": (hello, "dyknow hello car7")})
    assert app.run(["hello", "car7"]) == 0
    assert capsys.readouterr().out == "hello car7\n"


def test_a_scenario_is_a_function_and_a_row(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    entry = catalogue.SCENARIOS["motorway"]
    monkeypatch.setattr(catalogue, "SCENARIOS", MappingProxyType({**catalogue.SCENARIOS, "ours": entry}))
    assert catalogue.scenario_named("ours").network_file == catalogue.scenario_named("motorway").network_file
    assert entry.make is motorway
    out = tmp_path / "tracks.csv"
    assert app.run(["trajectories", "ours", "--out", str(out), "--seconds", "2"]) == 0
    assert out.stat().st_size > 100


def test_a_detector_is_a_class_with_one_method() -> None:
    class Passing:
        """Sees one car that drives to the right at 20 m/s, at 0.2 m a pixel."""

        def detect(self, instant: Frame) -> ImageBoxes:
            left_px = 100 + 4.0 * instant.index
            return ImageBoxes(
                centre_px=np.array([[left_px, 200.0]]),
                size_px=np.array([[22.5, 9.0]]),
                angle_rad=np.zeros(1),
                is_oriented=np.zeros(1, np.bool_),
                score=np.array([0.9]),
                class_number=np.zeros(1, np.intp),
            )

    pixel_from_ground = np.array([[5.0, 0.0, 0.0], [0.0, -5.0, 359.0], [0.0, 0.0, 1.0]])
    road = np.array([[0.0, 20.0], [128.0, 20.0], [128.0, 40.0], [0.0, 40.0]])
    camera = box_camera(Passing(), [road], (640, 360), pixel_from_ground=pixel_from_ground)
    grey, colourless = np.full((360, 640), 90, np.uint8), np.full((180, 320), 128, np.uint8)
    frames = [Frame(index, 40_000 * index, grey, colourless, colourless) for index in range(50)]
    seen = [objects for frame in frames for objects in camera.observe(frame)]
    assert seen[-1].ids == ("v1",)
    assert seen[-1].velocity_mps[0] == pytest.approx([20.0, 0.0], abs=0.5)
