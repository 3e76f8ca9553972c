"""What a run says of its input: which file, its first time stamp, and when it was."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from service.cli.app import run
from service.export.draw_video import picture_at
from service.records.runs import CameraRecord, InputFile, RunRecord
from service.runs.inputs.input_kind import content_digest
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.logs import CAMERA, START_UTC_US, state
from tests.service.logs import run as run_record
from tests.service.tracks import write_tracks

TIMES_MS = (0, 40, 95, 120, 180, 214, 270, 300)  # uneven, as phones record
SITE = 'name = "crossing"\n[camera]\nhomography = [[0.1, 0.0, -10.0], [0.0, -0.1, 20.0], [0.0, 0.0, 1.0]]\n'
MAY_UTC = "2026-05-01T08:00:00Z"


def write_video(path: Path, *, first_ms: int, created: str = "") -> Path:
    """Write pictures that get brighter and brighter, the first of them with a time stamp of its own."""
    with av.open(str(path), "w") as container:
        if created:
            container.metadata["creation_time"] = created
        stream = container.add_stream("libx264", rate=25, options={"bf": "0", "crf": "10"})
        stream.width, stream.height, stream.pix_fmt = CAMERA.width_px, CAMERA.height_px, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        for place, t_ms in enumerate(TIMES_MS):
            picture = np.full((CAMERA.height_px, CAMERA.width_px), 60 + 10 * place, np.uint8)
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts, frame.time_base = first_ms + t_ms, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def processed(folder: Path, video: Path, *options: str, site: str = SITE) -> RunRecord:
    (folder / "site.toml").write_text(site)
    log = folder / "a.db"
    log.unlink(missing_ok=True)
    assert run(["process", str(video), "--site", str(folder / "site.toml"), "--log", str(log), *options]) == 0
    with open_log(str(log)) as opened:
        return opened.run()


def test_a_run_knows_its_video_and_the_first_time_stamp(tmp_path: Path) -> None:
    video = write_video(tmp_path / "v.mkv", first_ms=19)
    record = processed(tmp_path, video, "--rate", "full")
    assert record.file == InputFile(
        path=str(video),
        size_bytes=video.stat().st_size,
        digest=content_digest(video),
        first_pts_us=19_000,
        codec="h264",
        width_px=CAMERA.width_px,
        height_px=CAMERA.height_px,
    )
    with open_log(str(tmp_path / "a.db")) as log, log.connect() as connection:
        assert [t_us // 1000 for _, t_us in log.frames(record.id)] == list(TIMES_MS)
        assert connection.exec_driver_sql("select first_pts_us from runs").scalar() == 19_000


def test_a_trajectory_file_has_no_time_stamps_of_a_video(tmp_path: Path) -> None:
    tracks = write_tracks(tmp_path / "t.csv", frames=3)
    file = process(RunRequest(tracks, None, str(tmp_path / "a.db"))).record.file
    assert file == InputFile(path=str(tracks), size_bytes=tracks.stat().st_size, digest=content_digest(tracks))


@pytest.mark.parametrize(
    ("options", "site", "created", "start", "who"),
    [
        (["--start-utc", "2026-05-03T10:00:00+02:00"], f"start_utc = {MAY_UTC}\n", MAY_UTC, "2026-05-03", "option"),
        ([], "start_utc = 2026-05-02T08:00:00Z\n", MAY_UTC, "2026-05-02", "site"),
        ([], "", MAY_UTC, "2026-05-01", "video"),
        ([], "", "1904-01-01T00:00:00Z", "1970-01-01", "unknown"),
        ([], "", "", "1970-01-01", "unknown"),
    ],
)
def test_the_start_is_that_of_the_first_who_knows(
    *,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    site: str,
    created: str,
    start: str,
    who: str,
) -> None:
    video = write_video(tmp_path / "v.mp4", first_ms=0, created=created)
    record = processed(tmp_path, video, *options, site=site + SITE)
    assert record.start_from == who
    assert f"media time 0:   {start}T0" in capsys.readouterr().out


def test_another_start_is_another_run(tmp_path: Path) -> None:
    tracks, log = write_tracks(tmp_path / "t.csv", frames=3), str(tmp_path / "a.db")
    ids = {process(RunRequest(tracks, None, log, start_utc_us=us)).run for us in (None, 0, START_UTC_US)}
    assert len(ids) == 3


@pytest.mark.parametrize("text", ["12.5s", "yesterday", "0001-01-01T00:00:00Z"])
def test_a_start_that_is_no_time_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> None:
    tracks = write_tracks(tmp_path / "t.csv", frames=3)
    assert run(["process", str(tracks), "--log", str(tmp_path / "a.db"), "--start-utc", text]) == 2
    assert f"got '{text}'" in capsys.readouterr().err


@pytest.mark.long
def test_a_late_first_time_stamp_moves_no_overlay(tmp_path: Path) -> None:
    camera = CameraRecord(CAMERA.pixel_from_ground, CAMERA.width_px, CAMERA.height_px)
    url = str(tmp_path / "log.db")
    with open_log(url, "w") as log:
        writer = log.begin_run(run_record(camera=camera))
        for place, t_ms in enumerate(TIMES_MS):
            writer.append_states([state(1000 * t_ms, "car1", 5.0 * place, 5.0)])
        writer.finish("finished")
    for t_ms in TIMES_MS:
        drawn = [
            _drawn(write_video(tmp_path / f"{first_ms}.mkv", first_ms=first_ms), url, 1000 * t_ms)
            for first_ms in (0, 19)
        ]
        assert np.array_equal(*drawn), t_ms


def _drawn(video: Path, url: str, at_us: int) -> np.ndarray:
    with open_log(url) as log:
        return picture_at(log, log.run(None), video, at_us)
