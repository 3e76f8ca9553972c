"""A column `sensor` of a trajectory file makes one car of what several sensors see of it."""

from pathlib import Path

import pytest

from anchoring.hypotheses.language import default_text
from service.cli import printing
from service.cli.app import run
from service.store.log import open_log
from tests.service.tracks import HEADER


def drive(folder: Path, *, with_sensors: bool = True) -> Path:
    """Write a car that two sensors see, of which the first does so for 3 of 6 s."""
    rows = [
        f"{100_000 * k},{sensor[0]}1,{1.5 * k + off_m},0.0,0.0,15.0,4.5,1.8" + f",{sensor}" * with_sensors
        for k in range(60)
        for sensor, off_m, last in (("colour", 0.0, 30), ("thermal", 0.4, 60))
        if k < last
    ]
    path = folder / "drive.csv"
    path.write_text("\n".join([HEADER + ",sensor" * with_sensors, *rows, ""]))
    return path


def test_two_sensors_make_one_car_and_the_log_tells_how(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(tmp_path / "log.db")
    assert run(["process", str(drive(tmp_path)), "--log", log]) == printing.OK
    with open_log(log) as opened:
        run_id = opened.runs()[0].id
        assert [one.car for one in opened.cars(run_id)] == ["car1"]
        assert all(one.linked for one in opened.states(run_id))
        kinds = [(one.kind, one.lower) for one in opened.links(run_id) if one.level == "world"]
    ends = [one for one in kinds if one[0] != "validated"]
    assert ends == [
        ("established", "c1"),
        ("joined", "t1"),
        ("parted", "t1"),
        ("lost", "c1"),
        ("reestablished", "t1"),
    ]
    capsys.readouterr()
    assert run(["objects", log, "car1", "--json"]) == printing.OK
    told = capsys.readouterr().out
    assert "joined: they are seen in one place" in told


def test_a_linkage_text_without_the_words_joins_nothing(tmp_path: Path) -> None:
    log, mine = str(tmp_path / "log.db"), tmp_path / "mine.linkage"
    mine.write_text(default_text().replace(": one vision_object per sensor", ""))
    assert run(["process", str(drive(tmp_path)), "--log", log, "--linkage", str(mine)]) == printing.OK
    with open_log(log) as opened:
        assert not [one for one in opened.links(opened.runs()[0].id) if one.kind == "joined"]
