"""Frames that vision holds at its start: caught up with one by one, whatever text declares the streams."""

import math
import os
import signal
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.runs.graph.pipeline import VIDEO, shipped_kpl
from service.runs.processing import Progress, RunRequest, RunSummary, process
from service.store.log import open_log
from tests.service.runs.inputs.test_detectors import FRAMES, make_site, make_video
from vision.errors import VideoBroken
from vision.video.frames import Frame, VideoSource

pytestmark = pytest.mark.long


def process_clip(
    folder: Path, on_progress: Callable[[Progress], None] = lambda _: None, *, kpl: Path | None = None
) -> RunSummary:
    """Process a clip that ends while vision still learns the road."""
    video, site = make_video(folder / "video.mp4"), make_site(folder)
    request = RunRequest(video, site, str(folder / "log.db"), kpl_file=kpl, rate_hz=math.inf)
    return process(request, on_progress=on_progress)


def times_in_log(folder: Path) -> tuple[int, list[int]]:
    """Count the frames in the log, and give the numbers of those with objects."""
    with open_log(str(folder / "log.db")) as log:
        run = log.run(None).id
        frames = len(list(log.frames(run)))
        return frames, sorted({one.t_us // 40_000 for one in log.states(run)})


def rows(log: Path) -> dict[str, list[tuple[object, ...]]]:
    """Read all tables but the costs."""
    with sqlite3.connect(log) as connection:
        names = [name for (name,) in connection.execute("select name from sqlite_master where type = 'table'")]
        return {name: connection.execute(f"select * from {name}").fetchall() for name in names if name != "costs"}


def test_progress_stands_while_frames_are_held_and_then_goes_on_frame_by_frame(tmp_path: Path) -> None:
    told: list[int] = []
    summary = process_clip(tmp_path, lambda progress: told.append(progress.frames))
    assert told == [*[0] * FRAMES, *range(1, FRAMES)]
    assert (summary.status, summary.progress.frames, summary.progress.media_us) == (
        "finished",
        FRAMES,
        (FRAMES - 1) * 40_000,
    )


def test_text_of_the_user_runs_as_the_shipped_one(tmp_path: Path) -> None:
    kpl = tmp_path / "same.kpl"
    kpl.write_text(shipped_kpl(VIDEO).text)
    told: list[list[int]] = [[], []]
    logs = []
    for number, text in enumerate((None, kpl)):
        process_clip(tmp_path, lambda progress, n=number: told[n].append(progress.frames), kpl=text)
        logs.append(rows(tmp_path / "log.db"))
        (tmp_path / "log.db").unlink()
    assert told[0] == told[1]
    assert logs[0] == logs[1]


def test_stream_of_frames_carries_frames_as_they_come(tmp_path: Path) -> None:
    summary = process_clip(tmp_path)
    frames, objects = summary.streams[:2]
    assert (frames.rate_hz, objects.updates, objects.lag_us) == (25.0, FRAMES, 0)
    assert f"Frame(index={FRAMES - 1}" in str(frames.last_value)


def test_interrupt_is_heeded_between_two_held_frames(tmp_path: Path) -> None:
    def stop(progress: Progress) -> None:
        if progress.frames == 30:
            os.kill(os.getpid(), signal.SIGINT)

    summary = process_clip(tmp_path, stop)
    assert (summary.status, summary.progress.frames) == ("interrupted", 30)
    assert summary.reason == f"input at {29 * 40_000} us: expected to go on to its end, got an interrupt"
    assert times_in_log(tmp_path)[1][-1] == 29


def test_interrupt_while_frames_are_held_does_not_wait_for_them(tmp_path: Path) -> None:
    calls = 0

    def stop(_: Progress) -> None:
        nonlocal calls
        calls += 1
        if calls == 10:
            os.kill(os.getpid(), signal.SIGINT)

    summary = process_clip(tmp_path, stop)
    assert (summary.status, summary.progress.frames, calls) == ("interrupted", 0, 10)
    assert summary.reason == "input at 0 us: expected to go on to its end, got an interrupt"
    assert times_in_log(tmp_path) == (10, [])


def test_what_is_held_when_the_video_breaks_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = VideoSource.frames

    def breaking(
        video: VideoSource, prepare: Callable[[Frame], Frame] | None = None, *, rate_hz: float = math.inf
    ) -> Iterator[Frame]:
        for frame in read(video, prepare, rate_hz=rate_hz):
            if frame.index == 50:
                raise VideoBroken(path="v.mp4", t_us=49 * 40_000, frame_index=50, reason="damage")
            yield frame

    monkeypatch.setattr(VideoSource, "frames", breaking)
    summary = process_clip(tmp_path)
    assert (summary.status, summary.progress.frames) == ("broken", 50)
    assert "damage" in summary.reason
    frames, with_cars = times_in_log(tmp_path)
    assert (frames, with_cars[-1]) == (50, 49)
