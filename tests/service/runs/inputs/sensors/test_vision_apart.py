"""Vision in a process of its own: the same rows, and the same end, whatever comes to an end first."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any  # records of many kinds

import numpy as np
import pytest

from service.errors import InputError
from service.runs.processing import Progress, RunRequest, RunSummary, process
from tests.service.logs import kept_rows
from tests.service.runs.inputs.sensors.failing import Failing
from tests.service.runs.inputs.test_detectors import SITE, make_mot, make_network, make_video
from tests.vision.support import draw_boxes, make_boxes, top_view, write_video


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_video(tmp_path_factory.mktemp("apart") / "video.mp4")


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return long_video(tmp_path_factory.mktemp("apart"))


def processed(
    video: Path,
    folder: Path,
    *,
    workers: int,
    camera: str = "",
    detector: str | None = None,
    on_progress: Callable[[Progress], None] = lambda _: None,
) -> tuple[RunSummary, dict[str, list[Any]]]:
    site, log = folder / "site.toml", folder / f"{workers}.db"
    site.write_text(SITE + camera, encoding="utf-8")
    request = RunRequest(video, site, str(log), detector=detector, workers=workers)
    summary = process(request, on_progress=on_progress)
    assert not multiprocessing.active_children()
    return summary, kept_rows(log) | {"streams": []}  # what they carried differs after an interrupt


@pytest.mark.long
@pytest.mark.parametrize("kind", ["motion", "moving", "onnx", "file"])
def test_rows_are_the_same(video: Path, tmp_path: Path, kind: str) -> None:
    camera = "moving = true\n" if kind == "moving" else ""
    detector = {"onnx": f"onnx:{make_network(tmp_path)}", "file": f"file:{make_mot(tmp_path)}"}.get(kind)
    (here, own), (there, others) = (
        processed(video, tmp_path, workers=workers, camera=camera, detector=detector) for workers in (0, 1)
    )
    assert len(own["frames"]) > 20
    assert own == others
    assert (here.status, here.warnings, here.progress.frames) == (there.status, there.warnings, there.progress.frames)


@pytest.mark.long
def test_damage_is_told_and_what_was_seen_before_it_is_kept(video: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(video.read_bytes()[:-1500])
    (here, own), (there, others) = (processed(broken, tmp_path, workers=workers) for workers in (0, 1))
    assert here.status == there.status == "broken"
    assert here.reason == there.reason
    assert own == others


@pytest.mark.long
def test_process_that_is_killed_ends_the_run_as_broken(long: Path, tmp_path: Path) -> None:
    def kill(progress: Progress) -> None:
        if progress.frames == 5:
            (child,) = multiprocessing.active_children()
            os.kill(child.pid or 0, signal.SIGKILL)

    summary, rows = processed(long, tmp_path, workers=1, on_progress=kill)
    assert summary.status == "broken"
    assert summary.reason.endswith("got the end of the process that looks at it (SIGKILL)")
    assert 5 <= len(rows["frames"]) < 400


def test_message_that_is_cut_short_is_the_end_of_the_process(
    video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(_: Connection) -> None:
        (child,) = multiprocessing.active_children()
        child.kill()
        raise OSError("got end of file during message")

    monkeypatch.setattr(Connection, "recv", cut)
    summary, _ = processed(video, tmp_path, workers=1)
    assert summary.status == "broken"
    assert summary.reason.endswith("got the end of the process that looks at it (SIGKILL)")


@pytest.mark.long
@pytest.mark.parametrize(
    "calls", [pytest.param(10, id="while frames are held"), pytest.param(150, id="later", marks=pytest.mark.slow)]
)
def test_interrupt_ends_both_where_it_ends_one(long: Path, tmp_path: Path, calls: int) -> None:
    kept = []
    for workers in (0, 1):
        left = iter(range(calls))

        def stop(_: Progress, left: Iterator[int] = left) -> None:
            if next(left, None) is None:
                os.kill(os.getpid(), signal.SIGINT)

        summary, rows = processed(long, tmp_path, workers=workers, on_progress=stop)
        assert summary.status == "interrupted"
        kept.append((summary.progress.frames, rows))
    assert kept[0] == kept[1]
    assert 0 < len(kept[0][1]["frames"]) <= calls + 1


@pytest.mark.long
def test_error_of_vision_is_raised_here(video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "service.runs.inputs.sensors.vision_apart.multiprocessing.get_context", context_sending(Failing())
    )
    with pytest.raises(InputError, match="expected vehicles, got a fair"):
        processed(video, tmp_path, workers=1)
    assert not multiprocessing.active_children()


def context_sending(sensor: object) -> Callable[[str], object]:
    """Make `get_context` send this instead of the sensor."""
    real = multiprocessing.get_context("spawn")

    class Context:
        Pipe = staticmethod(real.Pipe)

        @staticmethod
        def Process(*, args: tuple[object, ...], **rest: object) -> object:  # noqa: N802  (the name of multiprocessing)
            return real.Process(args=(sensor, args[1]), **rest)  # type: ignore[arg-type]

    return lambda _: Context


def long_video(folder: Path) -> Path:
    """Make a video that takes longer than it takes to stop who looks at it."""
    size_px = (256, 64)
    camera = top_view(size_px, 0.25)
    pictures = [
        np.rint(draw_boxes(size_px, make_boxes([(k * 0.4, 8.0, 0.0, 4.5, 2.25)]), [250.0], camera, ground=70.0)).astype(
            np.uint8
        )
        for k in range(160)
    ]
    write_video(folder / "long.mp4", 10 * pictures)
    return folder / "long.mp4"
