"""Are runs begun over HTTP, and can everything be done with their jobs that commands do?"""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from importlib import resources
from pathlib import Path

import pytest

from service.api.app import create_app
from service.api.messages.problems import without_folders
from service.api.source_files import SourceFolders
from service.cli.app import run as run_cli
from service.runs.jobs.worker import work
from service.runs.requests import LiveRequest, read_request
from service.store.databases.location import database_of
from service.store.entries import Source
from service.store.log import open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from service.store.registers.jobs import Jobs
from service.store.registers.sources import Sources
from tests.service.http import Client
from tests.service.logs import write_log

NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }"


def log_with(brief: Path, path: Path) -> str:
    """Make a log with a short file of tracks as its source."""
    written = write_log(path, [])
    with open_log(written) as opened:
        sources = Sources(opened)
        sources.add(Source("tracks", str(brief), "", 1, 1))
    return written


@pytest.fixture
def url(tmp_path: Path, brief: Path) -> str:
    return log_with(brief, tmp_path / "a.db")


def asking(url: str, brief: Path) -> Client:
    return Client(create_app(url, shipped=(), folders=SourceFolders(allowed=(brief.parent,))))


@pytest.fixture
def client(url: str, brief: Path) -> Iterator[Client]:
    with asking(url, brief) as opened:
        yield opened


@pytest.fixture(scope="module")
def refused(brief: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """Give one client to all tests whose questions are refused: nothing gets into its log."""
    with asking(log_with(brief, tmp_path_factory.mktemp("refused") / "a.db"), brief) as opened:
        yield opened


def begin(client: Client, **order: object) -> dict[str, object]:
    answer = client.request("POST", "/api/v1/runs", json={"source": "tracks", **order})
    assert answer.status_code == 202, answer.text
    body: dict[str, object] = answer.json()
    assert answer.headers["location"] == f"/api/v1/jobs/{body['id']}"
    return body


def test_a_run_is_begun_and_its_events_are_there(client: Client, url: str, brief: Path) -> None:
    job = begin(client, site=str(brief.parent / "site.toml"))
    assert (job["state"], job["input"], job["run"], job["attempts"]) == ("waiting", "a.csv", None, 0)
    work(url, stays=False, tell=lambda _: None)
    done = client.get(f"/api/v1/jobs/{job['id']}").json()
    assert (done["state"], done["attempts"]) == ("finished", 1)
    assert client.get("/api/v1/jobs").json()["items"] == [done]
    with open_log(url) as log:
        assert done["run"] in [one.id for one in log.runs()]
    assert client.get(f"/api/v1/cars?run={done['run']}").json()["items"]


def test_the_same_request_is_the_same_job(client: Client) -> None:
    first, second, other = begin(client), begin(client), begin(client, final=True)
    assert first == second
    assert other["id"] != first["id"]
    assert [one["id"] for one in client.get("/api/v1/jobs").json()["items"]] == [first["id"], other["id"]]


def test_jobs_are_listed_page_by_page(client: Client) -> None:
    begun = [begin(client, min_confidence=number / 10)["id"] for number in range(5)]
    listed, path = [], "/api/v1/jobs?limit=2"
    for count in (2, 2, 1):
        page = client.get(path)
        assert len(page.json()["items"]) == count
        listed += [one["id"] for one in page.json()["items"]]
        path = page.headers.get("link", "").partition("<")[2].partition(">")[0]
    assert (listed, page.json()["next_cursor"], path) == (begun, None, "")
    assert client.get("/api/v1/jobs?limit=5").json()["next_cursor"] is None
    of_events = client.get("/api/v1/events?cursor=" + client.get("/api/v1/jobs?limit=1").json()["next_cursor"])
    assert (of_events.status_code, of_events.json()["type"]) == (400, "urn:dyknow:problem:bad-cursor")
    assert [client.get(f"/api/v1/jobs?{one}").status_code for one in ("limit=0", "cursor=x", "state=failed")] == [
        422,
        400,
        422,
    ]


def test_messages_tell_of_files_their_names_alone(client: Client, url: str, brief: Path) -> None:
    bad = brief.with_name("bad.csv")
    bad.write_text("no table")
    with open_log(url) as log:
        sources = Sources(log)
        sources.add(Source("bad", str(bad), "", 1, 1))
    job = begin(client, source="bad")
    work(url, stays=False, tell=lambda _: None)
    failed = client.get(f"/api/v1/jobs/{job['id']}").json()
    assert (failed["state"], failed["message"].partition(":")[0]) == ("failed", "bad.csv")
    with closing(Jobs(database_of(url))) as jobs:
        assert jobs.find(str(job["id"])).message == f"{brief.parent}/{failed['message']}"
    problem = client.get("/api/v1/cars?run=none").json()
    assert problem["detail"].startswith("log 'a.db': expected a run 'none'")


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/srv/my videos/a b.mp4: expected a video", "a b.mp4: expected a video"),
        ("log '/srv/my logs/a.db': expected x, got '/x/y'", "log 'a.db': expected x, got 'y'"),
        ("read (/etc/a/b.toml:3) at 5/6 km/h", "read (b.toml:3) at 5/6 km/h"),
        ("http://localhost/a/b and //a/b stay, and a/b/c", "http://localhost/a/b and //a/b stay, and a/b/c"),
        ("", ""),
    ],
)
def test_folders_are_left_out_of_texts(text: str, left: str) -> None:
    assert without_folders(text) == left


@pytest.mark.long
def test_a_run_may_have_monitors_and_declarations_of_its_own(client: Client, url: str, brief: Path) -> None:
    texts = {"a.monitors": "monitor slow per ?car in Car: always speed[?car] < 1 m/s\n"}
    texts["a.kpl"] = resources.files("service.runs.graph").joinpath("trajectories.kpl").read_text()
    texts["a.linkage"] = resources.files("anchoring.hypotheses").joinpath("default.linkage").read_text()
    named = {}
    for name, text in texts.items():
        (brief.parent / name).write_text(text)
        named[name[2:]] = str(brief.parent / name)
    job = begin(client, monitors=[named["monitors"]], kpl=named["kpl"], linkage=named["linkage"])
    with closing(Jobs(database_of(url))) as jobs:
        request = read_request(jobs.find(str(job["id"])).request, url)
    assert [str(one) for one in (*request.monitor_files, request.kpl_file, request.linkage_file)] == [*named.values()]
    work(url, stays=False, tell=lambda _: None)
    done = client.get(f"/api/v1/jobs/{job['id']}").json()
    assert done["state"] == "finished", done
    found = client.get(f"/api/v1/runs/{done['run']}").json()
    assert [one["name"] for one in found["monitors"]] == ["slow"]


@pytest.mark.long
def test_a_run_has_the_texts_of_when_it_was_asked_for(client: Client, url: str) -> None:
    with open_log(url) as opened:
        texts = ChronicleTexts(opened)
        texts.put("near", NEAR, None)
        job = begin(client, chronicles=["near"])
        texts.put("near", f"{NEAR} # later", 1)
        assert begin(client, chronicles=["near"])["id"] != job["id"]
    work(url, stays=False, tell=lambda _: None)
    with open_log(url) as log:
        run = log.run(client.get(f"/api/v1/jobs/{job['id']}").json()["run"])
    assert [one.name for one in run.chronicles] == ["near"]
    assert [one.text for one in run.texts if one.name == "near"] == [NEAR]


def test_all_that_is_asked_for_comes_to_the_request(client: Client, url: str, brief: Path) -> None:
    asked = {"detector": "onnx:low", "rate_hz": "full", "start_utc": "2026-05-01T08:00:00Z", "min_confidence": 0.5}
    job = begin(client, **asked)
    with closing(Jobs(database_of(url))) as jobs:
        request = read_request(jobs.find(str(job["id"])).request, url)
    assert (request.input, request.detector, request.rate_hz) == (brief, "onnx:low", float("inf"))
    assert (request.start_utc_us, request.min_confidence, request.site) == (1_777_622_400_000_000, 0.5, None)


def test_a_job_is_cancelled_and_tried_again(client: Client) -> None:
    path = f"/api/v1/jobs/{begin(client)['id']}"
    refused = client.request("POST", f"{path}/retry")
    assert (refused.status_code, "expected one that failed or was cancelled" in refused.text) == (409, True)
    cancelled = client.request("POST", f"{path}/cancel")
    assert (cancelled.status_code, cancelled.json()["state"]) == (202, "cancelled")
    assert client.request("POST", f"{path}/cancel").status_code == 409
    again = client.request("POST", f"{path}/retry")
    assert (again.status_code, again.json()["state"]) == (202, "waiting")


@pytest.mark.parametrize("job", ["0" * 16, "0", "..%2f", "%00", "0" * 300])
def test_an_unknown_job_is_a_problem(refused: Client, job: str) -> None:
    for method, path in (("GET", job), ("POST", f"{job}/cancel"), ("POST", f"{job}/retry")):
        assert refused.request(method, f"/api/v1/jobs/{path}").status_code in (404, 422)


@pytest.mark.parametrize(
    ("order", "status", "detail"),
    [
        ({"source": "none"}, 404, "expected one of its sources, got 'none'"),
        ({"chronicles": ["none"]}, 404, "expected names of chronicle texts of this log, got 'none'"),
        ({"site": "/etc/passwd"}, 422, "site: expected the whole path of a file in a folder"),
        ({"site": "../site.toml"}, 422, "site: expected the whole path of a file in a folder"),
        ({"monitors": ["/etc/passwd"]}, 422, "monitors: expected the whole path of a file in a folder"),
        ({"kpl": "/etc/passwd"}, 422, "kpl: expected the whole path of a file in a folder"),
        ({"linkage": "/etc/passwd"}, 422, "linkage: expected the whole path of a file in a folder"),
        ({"detector": "file:/etc/passwd"}, 422, "detector: expected"),
        ({"detector": "onnx:../a.onnx"}, 422, "detector: expected"),
        ({"detector": "onnx:low\n"}, 422, "detector: expected"),
        ({"rate_hz": 0}, 422, "rate_hz: expected"),
        ({"min_confidence": 2}, 422, "min_confidence: expected"),
        ({"start_utc": "noon"}, 422, "start_utc: expected"),
        ({"input": "/etc/passwd"}, 422, "input: expected no such parameter"),
    ],
)
def test_a_wrong_request_is_refused(refused: Client, order: dict[str, object], status: int, detail: str) -> None:
    answer = refused.request("POST", "/api/v1/runs", json={"source": "tracks", **order})
    assert (answer.status_code, detail in answer.json()["detail"]) == (status, True), answer.text
    assert refused.get("/api/v1/jobs").json()["items"] == []


@pytest.fixture
def watched(url: str, brief: Path, tmp_path: Path) -> Iterator[Client]:
    """Give a client of a server whose operator named two cameras, which are pipes."""
    cameras = {name: str(tmp_path / name) for name in ("north", "south")}
    folders = SourceFolders(allowed=(brief.parent,), cameras=cameras, recordings=tmp_path / "recordings")
    for pipe in cameras.values():
        os.mkfifo(pipe)
    with Client(create_app(url, shipped=(), folders=folders)) as opened:
        yield opened


@pytest.mark.long
def test_a_camera_is_watched_by_its_name_until_it_is_cancelled(
    watched: Client, url: str, brief: Path, tmp_path: Path
) -> None:
    assert watched.get("/api/v1/sources").json()["cameras"] == ["north", "south"]
    site = str(brief.parent / "site.toml")
    job = begin(watched, source="north", site=site)
    assert (job["kind"], job["state"], job["input"]) == ("live", "waiting", "north")
    assert begin(watched, source="north", site=site) == job
    other = watched.request("POST", "/api/v1/runs", json={"source": "north"})
    assert (other.status_code, other.json()["type"]) == (409, "urn:dyknow:problem:taken")
    assert begin(watched, source="south")["id"] != job["id"]
    path = f"/api/v1/jobs/{job['id']}"
    with closing(Jobs(database_of(url))) as jobs:
        request = read_request(jobs.find(str(job["id"])).request, url)
        jobs.cancel(jobs.listed()[1].id)
    assert isinstance(request, LiveRequest)
    assert (request.input, request.recordings) == (str(tmp_path / "north"), tmp_path / "recordings" / "north")
    assert (request.run.site, request.run.is_live, request.run.log_url) == (Path(site), True, url)

    def cancel() -> None:
        while watched.get(path).json()["message"] != "begun":
            time.sleep(0.02)
        assert watched.request("POST", f"{path}/cancel").json()["cancel_requested"]

    canceller = threading.Thread(target=cancel)
    canceller.start()
    work(url, "live", stays=False, tell=lambda _: None)
    canceller.join()
    assert watched.get(path).json()["state"] == "cancelled"
    assert begin(watched, source="north")["id"] != job["id"]


@pytest.mark.parametrize(
    "order", [{"start_utc": "2026-05-01T08:00:00Z"}, {"chronicles": ["near"]}, {"site": "/etc/passwd"}]
)
def test_what_a_camera_has_no_use_for_is_refused(watched: Client, url: str, order: dict[str, object]) -> None:
    with open_log(url) as opened:
        ChronicleTexts(opened).put("near", NEAR, None)
    answer = watched.request("POST", "/api/v1/runs", json={"source": "north", **order})
    assert (answer.status_code, answer.json()["errors"][0]["parameter"]) == (422, *order)


@pytest.mark.parametrize("source", ["rtsp://127.0.0.1:9/1", "$HOME", "/dev/video0", "-", "east"])
def test_no_other_live_source_is_opened(watched: Client, source: str) -> None:
    answer = watched.request("POST", "/api/v1/runs", json={"source": source})
    assert (answer.status_code, answer.json()["type"]) == (404, "urn:dyknow:problem:not-in-log")


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--camera", "north=rtsp://10.0.0.3/1"], 2, "--camera: expected --recordings to go with it"),
        (["--camera", "rtsp://me:secret@10.0.0.3/1", "--recordings", "r"], 2, "expected NAME=ADDRESS, each name once"),
        (["--camera", "a=rtsp://b/1", "--camera", "a=rtsp://b/2", "--recordings", "r"], 2, "each name once, got 'a'"),
        (["--camera", "a=rtsp://me:secret@b/1", "--recordings", "r"], 3, "expected who asks from the environment"),
    ],
)
def test_cameras_that_are_named_wrong_are_told(
    url: str, options: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli(["serve", url, "--port", "0", *options]) == code
    told = " ".join(capsys.readouterr().err.split())
    assert said in told.replace("│ ", "")
    assert "secret" not in told


def test_a_source_whose_file_is_gone_begins_no_run(client: Client, url: str) -> None:
    with open_log(url) as opened:
        sources = Sources(opened)
        sources.add(Source("gone", "/videos/gone.mp4", "", 1, 1))
    answer = client.request("POST", "/api/v1/runs", json={"source": "gone"})
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:dyknow:problem:unusable-input")
