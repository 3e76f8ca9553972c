"""`dyknow monitor`, and `dyknow process --monitors`."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from tests.service.runs.graph.test_stream_processes import APART, LIMIT, run_race, write_race, written


def test_verdicts_are_listed_and_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = run_race(tmp_path, "")
    assert run(["monitor", url, str(written(tmp_path, "b.monitors", LIMIT + APART))]) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines()[0].split() == ["time", "monitor", "verdict", "roles", "since"]
    assert "00:04.600  apart    violated  a=car1 b=car2  00:00.400" in shown.out
    assert "00:07.000  limit    violated  car=car1       00:03.000" in shown.out
    assert shown.err == "limit: 2 violated, 0 satisfied, 1 undecided\napart: 2 violated, 0 satisfied, 4 undecided\n"


@pytest.mark.long
def test_json_is_one_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = run_race(tmp_path, "")
    assert run(["monitor", url, str(written(tmp_path, "b.monitors", LIMIT)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["monitors"] == [
        {"monitor": "limit", "running": 0, "violated": 2, "satisfied": 0, "undecided": 1},
    ]
    assert found["events"][1] == {
        "monitor": {"name": "limit", "version": found["events"][0]["monitor"]["version"]},
        "outcome": "violated",
        "roles": {"car": "car1"},
        "since_us": 3_000_000,
        "t_us": 7_000_000,
    }


def test_an_unknown_name_shows_where_and_what_was_meant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    race, log = write_race(tmp_path / "race.csv"), tmp_path / "log.db"
    path = written(tmp_path, "b.monitors", LIMIT.replace("speed[", "spead["))
    assert run(["process", str(race), "--log", str(log), "--monitors", str(path)]) == 3
    shown = capsys.readouterr().err
    assert shown.startswith("error[F0201]: expected a known feature, got 'spead'")
    assert "did you mean 'speed'?" in shown
    assert not log.exists()


def test_a_run_that_is_not_in_the_log_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = run_race(tmp_path, "")
    assert run(["monitor", url, str(written(tmp_path, "b.monitors", LIMIT)), "--run", "none"]) == 3
    assert "expected a run 'none'" in capsys.readouterr().err


@pytest.mark.long
def test_several_files_of_monitors_run_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    race, log = write_race(tmp_path / "race.csv"), tmp_path / "log.db"
    paths = [written(tmp_path, "b.monitors", LIMIT), written(tmp_path, "c.monitors", APART)]
    options = [part for path in paths for part in ("--monitors", str(path))]
    assert run(["process", str(race), "--log", str(log), *options]) == 0
    assert run(["events", str(log), "--type", "limit_violated", "--type", "apart_violated", "--format", "csv"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "role.car" in next(line for line in lines if "role." in line)
    assert sum("_violated" in line for line in lines) == 4
