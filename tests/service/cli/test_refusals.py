"""Command lines that would do harm, or nothing, are refused in words."""

from pathlib import Path

import pytest

from service.cli.app import run


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.strip()


def test_drawing_over_the_video_itself_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    video = tmp_path / "video.mp4"
    video.write_bytes(b"x")
    assert run(["draw", str(video), str(tmp_path / "log.db"), "--out", str(video)]) == 3
    assert "expected a new file, got one that is being read" in capsys.readouterr().err


def test_drawing_into_a_missing_folder_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "none" / "x.png"
    assert run(["draw", str(tmp_path / "video.mp4"), str(tmp_path / "log.db"), "--out", str(out)]) == 3
    assert "expected a file in an existing folder" in capsys.readouterr().err


def test_scene_in_place_of_a_file_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("x")
    assert run(["generate", "rural_overtaking", "--out", str(taken), "--seconds", "1"]) == 3
    assert "taken: expected a path that can be used" in capsys.readouterr().err
