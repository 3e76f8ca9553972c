"""Is the clip of an event its frames and no others, with their own times, and only where the video may be sent?"""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest
from fastapi import FastAPI

from service.api.app import create_app
from service.api.processes.pictures import MOST_KEPT
from service.cli import app
from service.records.runs import InputFile
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, run, state
from tests.vision.support import write_video
from vision.video.frames import Frame, open_video

COUNT = 200
PATH = "/api/v1/events/{}/clip.mp4"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A car that drives on a video whose grey tells the frame, and runs of other inputs."""
    folder = tmp_path_factory.mktemp("clips")
    video = folder / "video.mp4"
    write_video(video, [np.full((360, 640), 30 + 7 * number % 200, np.uint8) for number in range(COUNT)])
    (folder / "broken.mp4").write_bytes(b"no video")
    (folder / "rows.csv").write_text("t_us\n")
    with open_log(str(folder / "log.db"), "w") as log:
        for name in ("video.mp4", "broken.mp4", "rows.csv", "/etc/hosts"):
            path = folder / name
            file = InputFile(path=str(path), size_bytes=path.stat().st_size, digest="")
            kind = "trajectory" if name == "rows.csv" else "video"
            small = {"camera": None} if kind == "trajectory" else {}
            writer = log.begin_run(run(path.stem, file=file, input_kind=kind, input=name, **small))
            for number in range(COUNT):
                writer.append_frames([40_000 * number])
                writer.append_states([state(40_000 * number, "car1", -9.0 + 0.05 * number, 15.0)])
            writer.append_events([overtake(2 * SECOND_US + 1, 4 * SECOND_US), overtake(5 * SECOND_US, 5 * SECOND_US)])
            writer.append_events([overtake(0, 100 * SECOND_US)])
            writer.finish("finished")
    return folder


@pytest.fixture(scope="module")
def served(folder: Path) -> FastAPI:
    return create_app(str(folder / "log.db"), shipped=(), media_folders=[folder])


@pytest.fixture(scope="module")
def client(served: FastAPI) -> Iterator[Client]:
    with Client(served) as client:
        yield client


def frames(client: Client, folder: Path, event: str, query: str = "") -> list[Frame]:
    answer = client.get(f"{PATH.format(event)}?{query}")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "video/mp4"), answer.text
    (folder / "clip.mp4").write_bytes(answer.content)
    return list(open_video(folder / "clip.mp4"))


def source_frames(folder: Path, from_us: int, to_us: int) -> list[Frame]:
    return [one for one in open_video(folder / "video.mp4") if from_us <= one.t_us < to_us]


@pytest.mark.parametrize(
    ("event", "query", "window_us"),
    [
        ("video-1", "pad_us=0", (2 * SECOND_US + 1, 4 * SECOND_US)),
        ("video-1", "pad_us=0.5s", (3 * SECOND_US // 2 + 1, 9 * SECOND_US // 2)),
        ("video-2", "pad_us=0", (5 * SECOND_US, 6 * SECOND_US)),  # it has no length, and is shown for a second
        ("video-1", "", (1, 6 * SECOND_US)),
        ("video-2", "pad_us=9s", (0, 8 * SECOND_US)),
    ],
)
def test_a_clip_has_the_frames_of_its_event(
    client: Client, folder: Path, event: str, query: str, window_us: tuple[int, int]
) -> None:
    found, wanted = frames(client, folder, event, f"{query}&overlay=none"), source_frames(folder, *window_us)
    assert [one.t_us for one in found] == [one.t_us - wanted[0].t_us for one in wanted]
    for one, other in zip(found, wanted, strict=True):
        assert abs(float(one.luma.mean()) - float(other.luma.mean())) < 3


def test_uneven_times_are_kept(tmp_path: Path) -> None:
    # Ticks of a thirtieth of a second do not fit microseconds.
    pictures = [np.full((64, 64), 100, np.uint8)] * 9
    write_video(tmp_path / "v.mp4", pictures, rate_hz=30, times=[0, 1, 2, 40, 41, 43, 99, 100, 130])
    wanted = [one.t_us for one in open_video(tmp_path / "v.mp4") if one.t_us >= SECOND_US]
    size = (tmp_path / "v.mp4").stat().st_size
    with open_log(str(tmp_path / "a.db"), "w") as log:
        file = InputFile(path=str(tmp_path / "v.mp4"), size_bytes=size, digest="")
        writer = log.begin_run(run(file=file))
        writer.append_events([overtake(SECOND_US, 5 * SECOND_US)])
        writer.finish("finished")
    out = str(tmp_path / "c.mp4")
    asked = ["clip", str(tmp_path / "a.db"), "r1-1", "--out", out, "--pad", "0", "--overlay", "none"]
    assert app.run(asked) == 0
    assert [one.t_us for one in open_video(out)] == [t_us - wanted[0] for t_us in wanted]


@pytest.mark.long
def test_browsers_play_it_and_seek_in_it(client: Client, folder: Path) -> None:
    frames(client, folder, "video-1", "pad_us=2s")
    content = (folder / "clip.mp4").read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")
    with av.open(str(folder / "clip.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        packets = [one for one in container.demux(stream) if one.size]
    keys = [number for number, one in enumerate(packets) if one.is_keyframe]
    assert max(other - one for one, other in pairwise([*keys, len(packets)])) <= 25
    assert [one.pts for one in packets] == [one.dts for one in packets]


def test_a_part_of_a_clip_is_sent_and_head_tells_its_size(client: Client) -> None:
    whole = client.get(PATH.format("video-1"))
    part = client.get(PATH.format("video-1"), headers={"Range": "bytes=10-99", "If-Range": whole.headers["etag"]})
    assert (part.status_code, part.content) == (206, whole.content[10:100])
    head = client.request("HEAD", PATH.format("video-1"))
    assert (head.status_code, int(head.headers["content-length"])) == (200, len(whole.content))
    assert client.get(PATH.format("video-1"), headers={"Range": "bytes=99999999-"}).status_code == 416


@pytest.mark.long
def test_boxes_have_no_names(client: Client, folder: Path) -> None:
    shown = {}
    for form in ("none", "boxes", "symbols"):
        picture = frames(client, folder, "video-1", f"overlay={form}")[60].to_bgr().astype(int)
        road, top = picture[44:58], picture[10:24]
        shown[form] = bool((np.ptp(road, axis=-1) > 60).any()), bool((np.ptp(top, axis=(0, 1)) > 60).any())
    assert shown == {"none": (False, False), "boxes": (True, False), "symbols": (True, True)}


@pytest.mark.long
def test_a_smaller_clip_is_smaller(client: Client, folder: Path) -> None:
    assert frames(client, folder, "video-1", "width=101")[0].luma.shape == (56, 100)


@pytest.mark.long
def test_only_the_newest_clips_are_kept(served: FastAPI, client: Client) -> None:
    for pad_us in range(MOST_KEPT + 2):
        assert client.get(f"{PATH.format('video-2')}?pad_us={pad_us}&overlay=none").status_code == 200
    assert len([*served.state.clips.iterdir()]) == MOST_KEPT


@pytest.mark.parametrize(
    ("path", "status", "told"),
    [
        ("video-9", 404, "event: expected the id of an event in this log, got 'video-9'"),
        ("rows-1", 409, "event 'rows-1': expected one of a run on a video, got one on 'rows.csv'"),
        ("hosts-1", 404, "run 'hosts': expected one whose file is a video"),
        ("broken-1", 409, "video 'broken.mp4': expected a video file, got unreadable content"),
        ("video-3", 409, "expected a clip of at most 60 s with what it is padded by, got 102 s"),
        ("video-1?pad_us=58s", 409, "got 62 s"),
        ("video-1?pad_us=-1", 422, "pad_us: expected microseconds of media time"),
        ("video-1?overlay=all", 422, "overlay: expected 'none', 'boxes' or 'symbols', got 'all'"),
        ("video-1?speed=2", 422, "speed: expected no such parameter"),
    ],
)
def test_what_cannot_be_cut_is_a_problem(client: Client, path: str, status: int, told: str) -> None:
    event, _, query = path.partition("?")
    answer = client.get(f"{PATH.format(event)}?{query}")
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")
    assert told in answer.json()["detail"]


@pytest.mark.long
def test_the_command_cuts_what_the_server_cuts(
    client: Client, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, out = str(folder / "log.db"), folder / "cut.mp4"
    assert app.run(["clip", log, "video-1", "--out", str(out), "--pad", "1s", "--overlay", "boxes"]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    assert out.read_bytes() == client.get(f"{PATH.format('video-1')}?pad_us=1s&overlay=boxes").content
    (folder / "moved.mp4").write_bytes((folder / "video.mp4").read_bytes())
    assert app.run(["clip", log, "hosts-1", "--out", str(out), "--video", str(folder / "moved.mp4")]) == 0
    for arguments, told in (
        (["video-9", "--out", "x.mp4"], "expected the id of an event in this log, got 'video-9'"),
        (["video-1", "--out", "x.avi"], "--out: expected a path ending in .mp4, got 'x.avi'"),
        (["video-1", "--out", str(folder / "video.mp4")], "expected a new file, got one that is being read"),
        (["hosts-1", "--out", "x.mp4"], "expected a video file, got unreadable content"),
    ):
        assert app.run(["clip", log, *arguments]) == 3
        assert told in capsys.readouterr().err
