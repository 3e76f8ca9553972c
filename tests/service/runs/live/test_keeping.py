"""Which recordings go when they are old, or too many?"""

import time
from contextlib import closing
from pathlib import Path

from service.runs.live.recording_writer import RecordingWriter, left_behind, mark_processed, remove_old
from vision.video.recording import INDEX, Part

HOUR_US = 3_600_000_000


def recorded(folder: Path, name: str, *, hours_ago: float, size_bytes: int = 1000, is_processed: bool = True) -> Path:
    made = folder / name
    made.mkdir(parents=True)
    began_us = time.time_ns() // 1000 - round(hours_ago * HOUR_US)
    (made / INDEX).write_text(Part("000000.ts", 0, 0, began_us).as_line() + "\n")
    (made / "000000.ts").write_bytes(bytes(size_bytes))
    if is_processed:
        mark_processed(made)
    return made


def test_what_is_older_goes(tmp_path: Path) -> None:
    old, _ = recorded(tmp_path, "a", hours_ago=3), recorded(tmp_path, "b", hours_ago=1)
    assert remove_old(tmp_path, age_us=2 * HOUR_US, size_bytes=10**9) == [old]
    assert [one.name for one in tmp_path.iterdir()] == ["b"]


def test_of_too_much_the_oldest_goes(tmp_path: Path) -> None:
    first, second, _ = (recorded(tmp_path, name, hours_ago=0, size_bytes=1000) for name in "abc")
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=2500) == [first]
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=2500) == []
    assert second.exists()


def test_what_waits_to_be_processed_or_is_written_stays(tmp_path: Path) -> None:
    waits = recorded(tmp_path, "a", hours_ago=5, is_processed=False)
    with closing(RecordingWriter(tmp_path / "b")) as growing:
        (growing.folder / INDEX).write_text(Part("000000.ts", 0, 0, 0).as_line() + "\n")
        assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=0) == []
        assert left_behind(tmp_path) == [waits]
    assert left_behind(tmp_path) == [waits, growing.folder]
    mark_processed(waits)
    assert left_behind(tmp_path) == [growing.folder]
    assert remove_old(tmp_path, age_us=HOUR_US, size_bytes=0) == [waits]


def test_a_folder_that_is_no_recording_stays(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "file").write_text("x")
    assert remove_old(tmp_path, age_us=0, size_bytes=0) == []
    assert (tmp_path / "mine" / "file").exists()
