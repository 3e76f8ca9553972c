"""Is a video sent only where it may be, and are its chapters in its own times?"""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.api.app import create_app
from service.records.runs import InputFile
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, run

BYTES = bytes(range(256))
HOUR_US = 3_600_000_000


def video(path: Path, size_bytes: int = len(BYTES)) -> InputFile:
    return InputFile(path=str(path), size_bytes=size_bytes, digest="d", first_pts_us=2 * SECOND_US)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """Runs of a file that may be sent, and of others; the folder that is allowed is named by a link."""
    folder = tmp_path_factory.mktemp("media")
    inside, outside = folder / "in", folder / "out"
    for one in (inside, outside, inside / "below"):
        one.mkdir()
    for place in (inside / "a.mp4", inside / "below" / "a.mp4", outside / "a.mp4", inside / "a.txt"):
        place.write_bytes(BYTES)
    (inside / "link.mp4").symlink_to(outside / "a.mp4")
    (inside / "folder.mp4").mkdir()
    (folder / "allowed").symlink_to(inside)
    files = {
        "good": video(inside / "a.mp4"),
        "below": video(inside / "below" / "a.mp4"),
        "outside": video(outside / "a.mp4"),
        "around": video(inside / ".." / "out" / "a.mp4"),
        "linked": video(inside / "link.mp4"),
        "changed": video(inside / "a.mp4", 7),
        "gone": video(inside / "b.mp4"),
        "text": video(inside / "a.txt"),
        "folder": video(inside / "folder.mp4", os.stat(inside / "folder.mp4").st_size),
    }
    url = str(folder / "a.db")
    with open_log(url, "w") as log:
        for name, file in {**files, "none": None}.items():
            writer = log.begin_run(run(name, file=file))
            long = overtake(HOUR_US, roles={"overtaker": "a<b>", "overtaken": "c&d"})
            writer.append_events([overtake(SECOND_US), overtake(70 * SECOND_US, 70 * SECOND_US), long])
            writer.finish("finished")
    with Client(create_app(url, shipped=(), media_folders=[folder / "allowed"])) as client:
        yield client


@pytest.mark.parametrize("name", ["good", "below"])
def test_a_video_in_an_allowed_folder_is_sent(client: Client, name: str) -> None:
    answer = client.get(f"/api/v1/runs/{name}/video")
    assert (answer.status_code, answer.headers["content-type"], answer.content) == (200, "video/mp4", BYTES)


def test_a_part_of_a_video_is_sent(client: Client) -> None:
    answer = client.get("/api/v1/runs/good/video", headers={"Range": "bytes=10-19"})
    assert (answer.status_code, answer.headers["content-range"]) == (206, "bytes 10-19/256")
    assert answer.content == BYTES[10:20]
    assert client.get("/api/v1/runs/good/video", headers={"Range": "bytes=256-"}).status_code == 416


def test_head_tells_the_size_of_a_video(client: Client) -> None:
    answer = client.request("HEAD", "/api/v1/runs/good/video")
    assert (answer.status_code, answer.headers["content-length"], answer.content) == (200, "256", b"")


@pytest.mark.parametrize("name", ["outside", "around", "linked", "changed", "gone", "text", "folder", "none"])
def test_what_may_not_be_sent_is_not_there(client: Client, name: str) -> None:
    answer = client.get(f"/api/v1/runs/{name}/video")
    assert answer.status_code == 404
    assert answer.json()["detail"].startswith(f"run {name!r}: expected one whose file is a video")


def test_without_a_folder_nothing_is_sent(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(BYTES)
    with open_log(str(tmp_path / "a.db"), "w") as log:
        log.begin_run(run(file=video(tmp_path / "a.mp4"))).finish("finished")
    with Client(create_app(str(tmp_path / "a.db"), shipped=())) as client:
        assert client.get("/api/v1/runs/r1/video").status_code == 404


def test_chapters_are_in_the_times_of_the_video(client: Client) -> None:
    answer = client.get("/api/v1/runs/good/chapters.vtt")
    assert answer.headers["content-type"].startswith("text/vtt")
    assert answer.text == (
        "WEBVTT\n"
        "\n00:03.000 --> 00:06.000\novertake: overtaker car7, overtaken car3\n"
        "\n01:12.000 --> 01:13.000\novertake: overtaker car7, overtaken car3\n"
        "\n01:00:02.000 --> 01:00:05.000\novertake: overtaker a&lt;b&gt;, overtaken c&amp;d\n"
    )
    assert client.get("/api/v1/events/export?format=vtt&run=good").text == answer.text
    assert client.get("/api/v1/runs/r9/chapters.vtt").status_code == 404
