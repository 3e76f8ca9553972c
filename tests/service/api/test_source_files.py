"""Are videos uploaded whole or not at all, and can no client reach a file that is not for it?"""

import base64
import hashlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from service.api.app import create_app
from service.api.source_files import MOST_UPLOADS, SourceFolders
from service.cli.app import run as run_cli
from service.store.entries import Source
from service.store.log import open_log
from service.store.registers.sources import Sources
from tests.service.conftest import NewLog
from tests.service.http import Client, serving
from tests.service.logs import write_log
from tests.service.runs.jobs.test_jobs import until
from tests.vision.support import write_video

SOURCES = "/api/v1/sources"
PLAYLIST = b"#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\n%s\n#EXT-X-ENDLIST\n"
CONCAT = b"ffconcat version 1.0\nfile %s\n"
SDP = b"v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 9 RTP/AVP 96\na=rtpmap:96 H264/90000\n"


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("video") / "v.mp4"
    write_video(path, [np.full((64, 96), 40, np.uint8)] * 5)
    return path


def folders_in(folder: Path) -> SourceFolders:
    for name in ("uploads", "allowed"):
        (folder / name).mkdir()
    return SourceFolders(folder / "uploads", 0.001, (folder / "allowed",))


@pytest.fixture
def folders(tmp_path: Path) -> SourceFolders:
    return folders_in(tmp_path)


@pytest.fixture
def client(tmp_path: Path, folders: SourceFolders) -> Iterator[Client]:
    with Client(create_app(write_log(tmp_path / "a.db", []), shipped=(), folders=folders)) as opened:
        yield opened


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Client, SourceFolders]]:
    """Give one client to all tests whose files are refused: nothing gets into its log and folders."""
    folder = tmp_path_factory.mktemp("refused")
    folders = folders_in(folder)
    with Client(create_app(write_log(folder / "a.db", []), shipped=(), folders=folders)) as opened:
        yield opened, folders


def uploaded(folders: SourceFolders) -> list[str]:
    assert folders.uploads is not None
    return sorted(os.listdir(folders.uploads))


def put(client: Client, name: str, body: bytes, **headers: str) -> tuple[int, str]:
    answer = client.request("PUT", f"{SOURCES}/{name}/video", content=body, headers=headers)
    return answer.status_code, answer.text


def test_a_video_is_uploaded_listed_and_removed(client: Client, folders: SourceFolders, video: Path) -> None:
    body, digest = video.read_bytes(), hashlib.sha256(video.read_bytes())
    fits = f"md5=:AAAA:, sha-256=:{base64.b64encode(digest.digest()).decode()}:"
    answer = client.request("PUT", f"{SOURCES}/a.mp4/video", content=body, headers={"Content-Digest": fits})
    assert (answer.status_code, answer.headers["location"]) == (201, f"{SOURCES}/a.mp4")
    told = answer.json()
    assert (told["name"], told["file"], told["digest"], told["size"]) == (
        "a.mp4",
        "a.mp4",
        digest.hexdigest(),
        len(body),
    )
    assert client.get(SOURCES).json()["items"] == [client.get(f"{SOURCES}/a.mp4").json()] == [told]
    assert (folders.path_of(Source(**told)).read_bytes(), uploaded(folders)) == (body, ["a.mp4"])
    assert client.request("DELETE", f"{SOURCES}/a.mp4").status_code == 204
    assert (client.get(f"{SOURCES}/a.mp4").status_code, uploaded(folders)) == (404, [])


def test_a_name_is_taken_once(client: Client, folders: SourceFolders, video: Path) -> None:
    assert put(client, "a", video.read_bytes())[0] == 201
    status, text = put(client, "a", video.read_bytes() + b"\0\0\0\x08free")
    assert (status, "expected a new name, got 'a', which is taken" in text) == (409, True)
    assert folders.path_of(Source("a", "a", "", 0, 0)).read_bytes() == video.read_bytes()
    assert uploaded(folders) == ["a"]


def test_a_file_of_another_log_is_not_replaced(client: Client, folders: SourceFolders, video: Path) -> None:
    other = folders.path_of(Source("a", "a", "", 0, 0))
    other.write_text("of another log")
    assert put(client, "a", video.read_bytes())[0] == 409
    assert (other.read_text(), uploaded(folders), client.get(SOURCES).json()["items"]) == ("of another log", ["a"], [])


def test_a_name_of_a_file_in_its_place_is_taken(client: Client, folders: SourceFolders, video: Path) -> None:
    (allowed,) = folders.allowed
    (allowed / "v.mp4").write_bytes(video.read_bytes())
    assert client.request("POST", SOURCES, json={"name": "a", "file": f"{allowed}/v.mp4"}).status_code == 201
    assert (put(client, "a", video.read_bytes())[0], uploaded(folders)) == (409, [])


@pytest.mark.parametrize(
    ("name", "body", "status", "detail"),
    [
        ("a.mp4", b"", 415, "no container of a video"),
        ("a.mp4", b"no video", 415, "no container of a video"),
        ("a.m3u8", PLAYLIST, 415, "no container of a video"),
        ("a", PLAYLIST, 415, "no container of a video"),
        ("a.ffconcat", CONCAT, 415, "no container of a video"),
        ("a.sdp", SDP, 415, "no container of a video"),
        ("a.csv", b"", 422, "expected one that does not end in"),
        ("site.TOML", b"", 422, "expected one that does not end in"),
        ("a.mp4", b"\0" * 1_000_001, 413, ""),
    ],
)
def test_what_is_refused_leaves_nothing(
    refused: tuple[Client, SourceFolders], *, video: Path, name: str, body: bytes, status: int, detail: str
) -> None:
    client, folders = refused
    came, text = put(client, name, body.replace(b"%s", os.fsencode(video)))
    assert (came, detail in text) == (status, True), text
    assert "upload-" not in text
    assert (client.get(SOURCES).json()["items"], uploaded(folders)) == ([], [])


@pytest.mark.parametrize("digest", [f"sha-256=:{'A' * 43}=:", "sha-256=AAAA", "sha-256=:AAAA:"])
def test_a_digest_that_does_not_fit_is_refused(refused: tuple[Client, SourceFolders], video: Path, digest: str) -> None:
    client, folders = refused
    status, text = put(client, "a", video.read_bytes(), **{"Content-Digest": digest})
    assert (status, "Content-Digest: expected" in text, uploaded(folders)) == (422, True, [])


@pytest.mark.parametrize(
    "name", ["%2e%2e", "%2e%2e%2fa", "%2fetc%2fpasswd", "a%00", "a" * 300, "a%0A", ".a", "a%5cb", "%ff", "-a", "a%25d"]
)
def test_no_name_leads_out_of_the_folder(refused: tuple[Client, SourceFolders], video: Path, name: str) -> None:
    client, folders = refused
    assert put(client, name, video.read_bytes())[0] in (404, 422)
    for method in ("GET", "DELETE"):
        assert client.request(method, f"{SOURCES}/{name}").status_code in (404, 422)
    assert uploaded(folders) == []


def test_an_upload_that_is_cut_leaves_nothing(tmp_path: Path, folders: SourceFolders, video: Path) -> None:
    url = write_log(tmp_path / "a.db", [])
    with serving(create_app(url, shipped=(), folders=folders)) as (_, address):
        where = urlsplit(address)
        with socket.create_connection((where.hostname, where.port)) as connection:
            length = 10 * video.stat().st_size
            head = f"PUT {SOURCES}/a.mp4/video HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}\r\n\r\n"
            connection.sendall(head.encode() + video.read_bytes())
            until(lambda: bool(uploaded(folders)))
            assert uploaded(folders)[0].startswith(".upload-")
        until(lambda: not uploaded(folders))
    with open_log(url) as opened:
        sources = Sources(opened)
        assert sources.listed() == []


def test_a_few_are_received_at_once(tmp_path: Path, folders: SourceFolders) -> None:
    with serving(create_app(write_log(tmp_path / "a.db", []), shipped=(), folders=folders)) as (_, address):
        where = urlsplit(address)
        begun = [socket.create_connection((where.hostname, where.port)) for _ in range(MOST_UPLOADS + 1)]
        for number, connection in enumerate(begun):
            head = f"PUT {SOURCES}/a{number}/video HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n1"
            connection.sendall(head.encode())
            count = min(number + 1, MOST_UPLOADS)
            until(lambda: len(uploaded(folders)) == count)  # noqa: B023  # it is over before the next one
        answer = begun[-1].recv(1000)
        assert answer.startswith(b"HTTP/1.1 503")
        assert b"retry-after" in answer
        for connection in begun:
            connection.close()
        until(lambda: not uploaded(folders))


def test_a_server_without_a_folder_takes_no_uploads(tmp_path: Path, video: Path) -> None:
    with Client(create_app(write_log(tmp_path / "a.db", []), shipped=())) as client:
        status, text = put(client, "a", video.read_bytes())
        assert (status, "--uploads" in text) == (403, True)
        named = client.request("POST", SOURCES, json={"name": "a", "file": str(video)})
        assert (named.status_code, client.get(SOURCES).json()["items"]) == (422, [])


def test_a_file_of_an_allowed_folder_is_named(client: Client, folders: SourceFolders, video: Path) -> None:
    (allowed,) = folders.allowed
    (allowed / "deep").mkdir()
    file = allowed / "deep" / "v.mp4"
    file.write_bytes(video.read_bytes())
    (allowed / "link").symlink_to(file)
    for name, path in [("a", file), ("b", allowed / "link"), ("c", allowed / "deep" / ".." / "deep" / "v.mp4")]:
        answer = client.request("POST", SOURCES, json={"name": name, "file": str(path)})
        assert (answer.status_code, answer.json()["file"]) == (201, str(file.resolve())), answer.text
    assert client.request("POST", SOURCES, json={"name": "a", "file": str(file)}).status_code == 409
    assert client.request("DELETE", f"{SOURCES}/a").status_code == 204
    assert file.exists()


def test_a_file_of_an_allowed_folder_is_a_video_or_trajectories(client: Client, folders: SourceFolders) -> None:
    (allowed,) = folders.allowed
    for name, status in (("t.csv", 201), ("t.txt", 415)):
        (allowed / name).write_text("t_s,id,x_m,y_m\n")
        answer = client.request("POST", SOURCES, json={"name": name, "file": str(allowed / name)})
        assert answer.status_code == status, answer.text


def test_no_path_leads_out_of_the_allowed_folders(
    client: Client, folders: SourceFolders, video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (allowed,) = folders.allowed
    (allowed / "out").symlink_to(video)
    (allowed / "up").symlink_to(tmp_path)
    (allowed / "circle").symlink_to(allowed / "circle")
    (tmp_path / "allowed2").mkdir()
    (tmp_path / "allowed2" / "v.mp4").write_bytes(video.read_bytes())
    os.mkfifo(allowed / "pipe")
    (allowed / "v.mp4").write_bytes(video.read_bytes())
    monkeypatch.chdir(allowed)
    paths = [
        *("/etc/passwd", "../../etc/passwd", "v.mp4", "", ".", "/", "a\0b", f"{allowed}/v.mp4\0", "/dev/zero"),
        *(f"{allowed}/{name}" for name in ("out", "up/a.db", "circle", "pipe", "none", "", "../a.db", "a" * 300)),
        *(str(video), f"{tmp_path}/allowed2/v.mp4", f"file://{allowed}/v.mp4", "http://127.0.0.1:1/v.mp4", "a" * 5000),
    ]
    for path in paths:
        answer = client.request("POST", SOURCES, json={"name": "a", "file": path})
        assert answer.status_code == 422, (path, answer.text)
        assert answer.json()["detail"].startswith("file: expected "), path
    assert client.get(SOURCES).json()["items"] == []


@pytest.mark.parametrize("name", ["", "..", "a/b", "a\0", "a" * 65, ".a", "a\n"])
def test_a_named_file_has_a_plain_name(client: Client, folders: SourceFolders, video: Path, name: str) -> None:
    (allowed,) = folders.allowed
    (allowed / "v.mp4").write_bytes(video.read_bytes())
    answer = client.request("POST", SOURCES, json={"name": name, "file": str(allowed / "v.mp4")})
    assert (answer.status_code, client.get(SOURCES).json()["items"]) == (422, []), answer.text


def test_what_a_job_needs_stays(client: Client, folders: SourceFolders, video: Path) -> None:
    assert put(client, "a", video.read_bytes())[0] == 201
    job = client.request("POST", "/api/v1/runs", json={"source": "a"}).json()["id"]
    kept = client.request("DELETE", f"{SOURCES}/a")
    assert (kept.status_code, "a job waits for" in kept.text, uploaded(folders)) == (409, True, ["a"])
    assert client.request("POST", f"/api/v1/jobs/{job}/cancel").status_code == 202
    assert client.request("DELETE", f"{SOURCES}/a").status_code == 204


def test_sources_are_kept_on_both_databases(new_log: NewLog) -> None:
    with open_log(write_log(new_log(), [])) as opened:
        sources = Sources(opened)
        for name in ("b", "a"):
            sources.add(Source(name, f"/videos/{name}", "", 5, 7))
        assert [one.name for one in sources.listed()] == ["a", "b"]
        sources.remove("a")
        assert [one.name for one in sources.listed()] == ["b"]
        assert sources.find("b") == Source("b", "/videos/b", "", 5, 7)


def test_a_file_that_cannot_be_placed_is_no_source(new_log: NewLog) -> None:
    def fail() -> None:
        raise OSError("no room")

    with open_log(write_log(new_log(), [])) as opened:
        sources = Sources(opened)
        with pytest.raises(OSError, match="no room"):
            sources.add(Source("a", "a", "0a", 5, 7), fail)
        assert sources.listed() == []


def test_folders_that_are_none_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_log(tmp_path / "a.db", [])
    for option in ("--uploads", "--allow-folder"):
        assert run_cli(["serve", url, option, str(tmp_path / "none")]) == 3
        assert f"{tmp_path / 'none'}: expected a folder, got none" in capsys.readouterr().err
