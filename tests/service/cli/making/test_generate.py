"""`dyknow generate` hands its options to the scene, and refuses what it cannot read before anything is written."""

import tomllib
from pathlib import Path

import pytest

from service.cli.app import run


@pytest.mark.long
def test_the_options_reach_the_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "scene"
    arguments = "rural_overtaking --seed 2 --seconds 1 --camera uav --poses --thermal --weather overcast --size 128x72"
    faults = ["--degrade", "every=5", "--occluders", "bridge, gantry", "--option", "platoons=1"]
    assert run(["generate", *arguments.split(), *faults, "--out", str(out)]) == 0
    camera = tomllib.loads((out / "site.toml").read_text(encoding="utf-8"))["camera"]
    assert (camera["moving"], camera["poses"], camera["thermal"]["video"]) == (True, "camera.csv", "thermal.mp4")
    assert "thermal.mp4" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--size", "128"], "expected WIDTHxHEIGHT in pixels, as 1280x720, got '128'"),
        (["--option", "platoons"], "expected NAME=VALUE, got 'platoons'"),
        (["--degrade", "rain=1"], "degrade: expected some of noise, drop"),
        (["--occluders", "wall"], "occluders: expected none, all or some of trees, bridge, gantry, got 'wall'"),
        (["--size", "8194x64"], "image width: expected an even number of pixels from 64 to 8192, got 8194"),
        (
            ["--camera", "oblique", "--poses"],
            "poses: expected the camera 'uav' for a site file with poses, got 'oblique'",
        ),
        (["--fps", "30"], "rate: expected a divisor of 1000 from 10 up, in frames per second, got 30"),
    ],
    ids=["size", "option", "degrade", "occluders", "too large", "poses", "fps"],
)
def test_what_cannot_be_read_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    out = tmp_path / "scene"
    assert run(["generate", "rural_overtaking", "--out", str(out), *arguments]) != 0
    shown = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert message in shown
    assert not out.exists()
