"""`dyknow trajectories`: what it writes, and what it refuses."""

from pathlib import Path

import pytest

from service.cli import printing
from service.cli.app import run


def test_a_scenario_is_written_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "scene" / "t.csv"
    arguments = ["trajectories", "meeting_only", "--out", str(out), "--seconds", "2", "--view", "--gap", "60:0.3"]
    assert run(arguments) == printing.OK
    told = capsys.readouterr().out
    assert "gaps, 0 swaps" in told
    assert f"dyknow process {out} --site {tmp_path / 'scene' / 'site.toml'}" in told
    assert out.read_text(encoding="utf-8").startswith("t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m\n0,t1,")


def test_a_folder_is_disturbed_without_simulating_again(tmp_path: Path) -> None:
    assert run(["trajectories", "meeting_only", "--out", str(tmp_path / "a/t.csv"), "--seconds", "2"]) == printing.OK
    noisy = ["trajectories", str(tmp_path / "a"), "--out", str(tmp_path / "b/t.csv"), "--position-noise-m", "0.3"]
    assert run(noisy) == printing.OK
    exact, disturbed = ((tmp_path / name / "t.csv").read_text(encoding="utf-8").splitlines() for name in "ab")
    assert len(exact) == len(disturbed)
    assert exact != disturbed


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nowhere"], printing.INVALID, "scenario: expected one of"),
        (["meeting_only", "--gap", "2"], printing.USAGE, "expected RATE:SECONDS, as 0.5:2, got '2'"),
        (["meeting_only", "--miss", "2"], printing.INVALID, "miss_share: expected 0 to 1, got 2.0"),
        (["meeting_only", "--rate-hz", "7"], printing.INVALID, "rate: expected a divisor of 1000"),
        (["meeting_only", "--seconds", "nan"], printing.USAGE, "'--seconds'"),
        (["meeting_only", "--seed", "-1"], printing.USAGE, "'--seed'"),
        ([".", "--view"], printing.USAGE, "expected a scenario for --view and --option"),
    ],
)
def test_wrong_arguments_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, message: str
) -> None:
    assert run(["trajectories", *arguments, "--out", str(tmp_path / "t.csv")]) == code
    assert message in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["truth.csv", "camera.csv", "site.toml", "tracks.txt"])
def test_a_name_that_is_none_of_a_trajectory_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / name).write_text("mine")
    assert run(["trajectories", "meeting_only", "--seconds", "1", "--out", str(tmp_path / name)]) == printing.USAGE
    assert "--out: expected a path that ends in .csv and none of" in " ".join(capsys.readouterr().err.split())
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]


def test_the_truth_of_a_video_is_never_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, other = tmp_path / "scene", tmp_path / "other"
    make = ["trajectories", "meeting_only", "--seconds", "1", "--out"]
    assert run([*make, str(other / "t.csv")]) == printing.OK
    scene.mkdir()
    (scene / "video.mp4").write_text("a video")
    (scene / "truth.csv").write_text("its truth")
    for source in ("meeting_only", str(other)):
        assert run(["trajectories", source, "--out", str(scene / "t.csv")]) == printing.INVALID
        assert "expected a folder without a scene's video, got one with video.mp4" in capsys.readouterr().err
    assert (scene / "truth.csv").read_text() == "its truth"
    assert not (scene / "site.toml").exists()
