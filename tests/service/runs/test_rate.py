"""How many frames a run looks at: by option, by site file or as usual; and what the log and its exports make of it."""

from pathlib import Path

import numpy as np
import pytest

from service.cli.app import run
from service.export.drawing import OverlayReader
from service.store.log import open_log
from tests.service.runs.inputs.test_detectors import FRAMES, SITE, make_ground_csv, make_video


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_video(tmp_path_factory.mktemp("rate") / "video.mp4")


def processed(video: Path, folder: Path, *options: str, rate: str = "") -> Path:
    site, log = folder / "site.toml", folder / "log.db"
    site.write_text(SITE + (f"rate_hz = {rate}\n" if rate else ""), encoding="utf-8")
    assert run(["process", str(video), "--site", str(site), "--log", str(log), *options]) == 0
    return log


@pytest.mark.long
@pytest.mark.parametrize(
    ("site_rate", "options", "every"),
    [
        ("", (), 2),
        ("5", (), 5),
        ('"full"', (), 1),
        ("5", ("--rate", "full"), 1),
        ("", ("--rate", "8"), 3),
        ("", ("--rate", "30"), 1),
    ],
)
def test_every_nth_frame_is_looked_at_and_keeps_its_number(
    video: Path, tmp_path: Path, site_rate: str, options: tuple[str, ...], every: int
) -> None:
    log = processed(video, tmp_path, *options, rate=site_rate)
    with open_log(str(log)) as opened:
        frames, run_id = list(opened.frames(opened.run().id)), opened.run().id
        of_source, covered_us = list(opened.source_frames(run_id)), opened.covered_us(run_id)
    assert frames == [(nth + 1, 40_000 * nth) for nth in range(0, FRAMES, every)]
    assert of_source == [(nth + 1, 40_000 * nth) for nth in range(FRAMES)]
    assert covered_us == (0, frames[-1][1])


@pytest.mark.long
def test_rates_are_other_runs_and_the_log_tells_them(video: Path, tmp_path: Path) -> None:
    log = processed(video, tmp_path)
    for rate in ("12.5", "full"):
        processed(video, tmp_path, "--rate", rate)
    with open_log(str(log)) as opened:
        assert [dict(record.settings).get("rate_hz") for record in opened.runs()] == [None, "12.5", "inf"]


@pytest.mark.long
def test_more_than_the_video_has_is_told(video: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    processed(video, tmp_path, "--rate", "30")
    expected = "warning: video.mp4: 30 frames a second were asked for, and the video has 25: all are looked at\n"
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize("rate", ["0", "-1", "nan", "fast", ""])
def test_rate_that_is_none_is_refused(
    video: Path, tmp_path: Path, rate: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["process", str(video), "--log", str(tmp_path / "log.db"), "--rate", rate]) == 2
    assert f"--rate: expected frames a second, above 0, or full; got {rate!r}" in capsys.readouterr().err


def test_rate_is_for_videos(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "site.toml").write_text(SITE, encoding="utf-8")
    given = ["--detections", str(make_ground_csv(tmp_path)), "--site", str(tmp_path / "site.toml"), "--rate", "5"]
    assert run(["process", *given, "--log", str(tmp_path / "log.db")]) == 3
    assert "found.csv: expected a video to go with a rate, got detections" in capsys.readouterr().err


def test_boxes_of_an_export_have_the_numbers_of_the_videos_frames(
    video: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = processed(video, tmp_path)
    capsys.readouterr()
    assert run(["tracks", str(log), "--format", "mot"]) == 0
    numbers = np.array([int(line.split(",")[0]) for line in capsys.readouterr().out.splitlines()])
    assert len(numbers) > 20
    assert (numbers % 2 == 1).all()


@pytest.mark.long
def test_cars_are_drawn_where_they_are_between_two_looks(video: Path, tmp_path: Path) -> None:
    with open_log(str(processed(video, tmp_path))) as log:
        states = list(log.states(log.run().id))
    t_us = states[len(states) // 2].t_us
    reader = OverlayReader(states, [])
    (before,), (between,), (after,) = (
        reader.at(one, looked_us=t_us).cars for one in (t_us, t_us + 40_000, t_us + 80_000)
    )
    assert between.x_m == pytest.approx((before.x_m + after.x_m) / 2, abs=0.05)
    assert not reader.at(t_us + 200_000, looked_us=t_us + 200_000).cars
