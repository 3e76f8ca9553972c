"""`dyknow trajectories`: what it writes, and what it refuses."""

from pathlib import Path

import pytest

from service.cli import exit_codes
from service.cli.app import run


def test_a_scenario_is_written_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "scene" / "t.csv"
    arguments = ["trajectories", "meeting_only", "--out", str(out), "--seconds", "2", "--view", "--gap", "60:0.3"]
    assert run(arguments) == exit_codes.OK
    told = capsys.readouterr().out
    assert "gaps, 0 swaps" in told
    assert f"dyknow process {out} --site {tmp_path / 'scene' / 'site.toml'}" in told
    assert out.read_text(encoding="utf-8").startswith("t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m\n0,t1,")


def test_a_folder_is_disturbed_without_simulating_again(tmp_path: Path) -> None:
    assert run(["trajectories", "meeting_only", "--out", str(tmp_path / "a/t.csv"), "--seconds", "2"]) == exit_codes.OK
    noisy = ["trajectories", str(tmp_path / "a"), "--out", str(tmp_path / "b/t.csv"), "--position-noise-m", "0.3"]
    assert run(noisy) == exit_codes.OK
    exact, disturbed = ((tmp_path / name / "t.csv").read_text(encoding="utf-8").splitlines() for name in "ab")
    assert len(exact) == len(disturbed)
    assert exact != disturbed


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nowhere"], exit_codes.INVALID, "scenario: expected one of"),
        (["meeting_only", "--gap", "2"], exit_codes.USAGE, "expected RATE:SECONDS, as 0.5:2, got '2'"),
        (["meeting_only", "--miss", "2"], exit_codes.INVALID, "miss_share: expected 0 to 1, got 2.0"),
        (["meeting_only", "--rate-hz", "7"], exit_codes.INVALID, "rate: expected a divisor of 1000"),
        ([".", "--view"], exit_codes.USAGE, "expected a scenario for --view and --option"),
    ],
)
def test_wrong_arguments_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, message: str
) -> None:
    assert run(["trajectories", *arguments, "--out", str(tmp_path / "t.csv")]) == code
    assert message in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())
