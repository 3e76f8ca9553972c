"""Is the picture over HTTP the frame of that time, with what the log holds of it, and only where it may be sent?"""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from service.api.app import create_app
from service.cli import app
from service.records.runs import InputFile
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, run, state
from tests.vision.support import ByteArray, write_video
from vision.video.frames import open_video

STEP_US = 40_000
COUNT = 80
PATH = "/api/v1/runs/r1/frame"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A car that drives 2 m in each frame, on a video whose grey tells the frame, and a run that does not fit it."""
    folder = tmp_path_factory.mktemp("frames")
    video = folder / "video.mp4"
    write_video(video, [np.full((360, 640), 60 + 2 * number, np.uint8) for number in range(COUNT)])
    (folder / "broken.mp4").write_bytes(b"no video")
    with open_log(str(folder / "log.db"), "w") as log:
        for name, file in (("r1", video), ("r2", folder / "broken.mp4"), ("r3", Path("/etc/hosts"))):
            writer = log.begin_run(run(name, file=InputFile(path=str(file), size_bytes=file.stat().st_size, digest="")))
            for number in range(COUNT):
                writer.append_frames([number * STEP_US])
                writer.append_states([state(number * STEP_US, "car1", 0.5 * number, 10.0)])
            writer.append_events([overtake(2 * SECOND_US, 2 * SECOND_US)])
            writer.finish("finished")
    return folder


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[Client]:
    with Client(create_app(str(folder / "log.db"), shipped=(), media_folders=[folder])) as client:
        yield client


def picture(client: Client, query: str) -> ByteArray:
    answer = client.get(f"{PATH}?{query}")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/jpeg"), answer.text
    read = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert read is not None
    return np.asarray(read, np.uint8)


def coloured(image: ByteArray) -> np.ndarray:
    """Columns with a colour, in the rows of the road; the video is grey."""
    road = image[image.shape[0] // 5 : image.shape[0] // 3].astype(int)
    return np.flatnonzero((road.max(axis=-1) - road.min(axis=-1) > 60).any(axis=0))


@pytest.mark.parametrize("number", [0, 37, COUNT - 1])
def test_the_picture_is_the_frame_that_a_player_shows(client: Client, folder: Path, number: int) -> None:
    frame = [*open_video(folder / "video.mp4")][number]
    between_us = frame.t_us + (STEP_US // 2 if number < COUNT - 1 else 0)
    plain = picture(client, f"t_us={between_us}&overlay=none")
    assert np.abs(plain.astype(int) - frame.to_bgr()).max() <= 3


def test_the_overlay_is_what_is_drawn_on_a_video(client: Client, folder: Path) -> None:
    out = folder / "drawn.png"
    draw = "draw", str(folder / "video.mp4"), str(folder / "log.db"), "--from", "2s", "--run", "r1", "--out"
    assert app.run([*draw, str(out)]) == 0
    drawn, sent = cv2.imread(str(out)), picture(client, f"t_us={2 * SECOND_US}")
    assert drawn is not None
    assert np.abs(drawn.astype(int) - sent).mean() < 3
    assert len(coloured(sent)) > 20
    assert app.run([*draw, str(folder / "drawn.mp4")]) == 0
    first = next(iter(open_video(folder / "drawn.mp4"))).to_bgr()
    assert np.abs(first.astype(int) - drawn).mean() < 6


def test_an_event_that_goes_on_is_named(client: Client) -> None:
    before, after = (picture(client, f"t_us={us}")[:40] for us in (SECOND_US, 2 * SECOND_US))
    assert (before.max(), after.max() > 200) == (before.min(), True)


def test_a_smaller_picture_has_cars_in_their_places(client: Client) -> None:
    large, small = picture(client, "t_us=1s"), picture(client, "t_us=1s&width=320")
    assert (large.shape, small.shape) == ((360, 640, 3), (180, 320, 3))
    assert coloured(small)[0] == pytest.approx(coloured(large)[0] / 2, abs=1)
    assert picture(client, "t_us=1s&width=5000").shape == large.shape


@pytest.mark.parametrize(
    ("path", "status", "told"),
    [
        ("r1/frame?t_us=99s", 404, "expected a time in its video, of which it covers 00:00.000 to 00:03.160"),
        ("r1/frame", 422, "t_us: expected a value, got none"),
        ("r1/frame?t_us=1s&width=0", 422, "width: expected greater than or equal to 16, got '0'"),
        ("r1/frame?t_us=1s&overlay=maybe", 422, "overlay: expected 'none', 'boxes' or 'symbols', got 'maybe'"),
        ("r1/frame?t_us=-1", 422, "t_us: expected microseconds of media time"),
        ("r2/frame?t_us=1s", 409, "video 'broken.mp4': expected a video file, got unreadable content"),
        ("r3/frame?t_us=1s", 404, "run 'r3': expected one whose file is a video"),
        ("r9/frame?t_us=1s", 404, "expected a run 'r9'"),
    ],
)
def test_what_cannot_be_shown_is_a_problem(client: Client, folder: Path, path: str, status: int, told: str) -> None:
    answer = client.get(f"/api/v1/runs/{path}")
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")
    assert told in answer.json()["detail"]
    assert str(folder) not in answer.text.replace(str(folder / "log.db"), "")


def test_without_a_folder_no_picture_is_sent(folder: Path) -> None:
    with Client(create_app(str(folder / "log.db"), shipped=())) as client:
        assert client.get(f"{PATH}?t_us=1s").status_code == 404
