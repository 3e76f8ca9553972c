"""Which recordings go when they are old, or too many?"""

import time
from pathlib import Path

import pytest

from service.errors import InputError
from service.live.keeping import remove_old
from service.live.recording_writer import RecordingWriter
from vision.video.recording import INDEX, Part

HOUR_US = 3_600_000_000


def recorded(folder: Path, name: str, *, hours_ago: float, size_bytes: int = 1000) -> Path:
    made = folder / name
    made.mkdir(parents=True)
    began_us = time.time_ns() // 1000 - round(hours_ago * HOUR_US)
    (made / INDEX).write_text(Part("000000.ts", 0, 0, began_us).as_line() + "\n")
    (made / "000000.ts").write_bytes(bytes(size_bytes))
    return made


def test_what_is_older_goes(tmp_path: Path) -> None:
    old, new = recorded(tmp_path, "a", hours_ago=3), recorded(tmp_path, "b", hours_ago=1)
    assert remove_old(tmp_path, age_us=2 * HOUR_US, size_bytes=10**9, after=new) == [old]
    assert [one.name for one in tmp_path.iterdir()] == ["b"]


def test_of_too_much_the_oldest_goes(tmp_path: Path) -> None:
    first, second, third = (recorded(tmp_path, name, hours_ago=0, size_bytes=1000) for name in "abc")
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=2500, after=third) == [first]
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=2500, after=third) == []
    assert second.exists()


def test_what_waits_to_be_processed_or_is_written_stays(tmp_path: Path) -> None:
    done, waits = recorded(tmp_path, "a", hours_ago=5), recorded(tmp_path, "b", hours_ago=4)
    with RecordingWriter(done):
        assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=0, after=done) == []
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=0, after=done) == [done]
    assert waits.exists()


def test_a_folder_that_is_no_recording_stays(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "file").write_text("x")
    assert remove_old(tmp_path, age_us=0, size_bytes=0, after=tmp_path / "z") == []
    assert (tmp_path / "mine" / "file").exists()


def test_two_do_not_write_one_recording(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path), pytest.raises(InputError, match="expected nobody to write it"):
        RecordingWriter(tmp_path)
