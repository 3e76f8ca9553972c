"""`dyknow demo`, shortened."""

from pathlib import Path

import pytest

from service.cli.app import run


def test_demo_prints_recognised_overtakes_beside_the_truth(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["demo", "--out", str(tmp_path / "demo"), "--seconds", "20"]) == 0
    printed = capsys.readouterr().out
    assert "overtakes sim" in printed
    assert "recall    1.000" in printed
    assert "x real time" in printed
    assert "curl 'http://127.0.0.1:8420/api/v1/events?type=overtake&limit=3'" in printed
    assert (tmp_path / "demo" / "log.db").exists()
