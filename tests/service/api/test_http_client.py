"""Does the example of a client do with a real server what it says?"""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from examples.http_client import DyKnow, JobError, ProblemError
from tests.service.logs import overtake, write_log
from tests.vision.support import write_video

pytestmark = pytest.mark.long

SERVE = [sys.executable, "-c", "from service.cli.app import main; main()", "serve"]
NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }"


@pytest.fixture(scope="module")
def server(tracks: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[DyKnow]:
    """A server, with its worker, of a log with one event."""
    folder = tmp_path_factory.mktemp("served")
    write_log(folder / "a.db", [overtake()])
    (folder / "videos").mkdir()
    options = ["--port", "0", "--uploads", str(folder / "videos"), "--allow-folder", str(tracks.parent)]
    with subprocess.Popen([*SERVE, str(folder / "a.db"), *options], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        address = re.search(r"http://\S+?(?=/api)", process.stderr.readline())
        assert address is not None
        try:
            with DyKnow(address[0]) as client:
                yield client
        finally:
            process.terminate()
            process.stderr.read()  # whatever it says, it is not kept from ending


def test_a_run_is_begun_and_asked_about(server: DyKnow, tracks: Path) -> None:
    server.ask("POST", "sources", json={"name": "tracks", "file": str(tracks)})
    job = server.run("tracks", site=str(tracks.parent / "site.toml"))
    assert server.run("tracks", site=str(tracks.parent / "site.toml")) == job
    run = server.wait(job)
    found = list(server.events(run=run, limit=2))
    assert len(found) > 2  # on several pages
    assert len({one["id"] for one in found}) == len(found)
    assert {one["run"] for one in found} == {run}
    one = next(event for event in found if event["type"] == "overtake")
    assert server.why(one["id"])["event"] == one["id"]
    missed = server.why_not("overtake", run=run, limit=1, **{"role.overtaker": one["roles"]["overtaker"]})
    assert missed["recognised"] >= 1
    tried = server.try_text(NEAR, run=run, to="5s")
    assert tried["count"] == len(tried["items"]) > 0


def test_events_are_streamed_from_a_number_on(server: DyKnow) -> None:
    (event,) = server.events(run="r1")
    assert next(server.stream(last_event_id=event["seq"] - 1)) == event


@pytest.mark.long
def test_a_video_is_uploaded_and_what_is_wrong_is_told(server: DyKnow, tmp_path: Path) -> None:
    write_video(tmp_path / "grey.mp4", [np.full((64, 96), 40, np.uint8)] * 5)
    assert server.upload(tmp_path / "grey.mp4") == "grey.mp4"
    with pytest.raises(ProblemError, match=r"409 Conflict: source: expected a new name, got 'grey.mp4'") as refused:
        server.upload(tmp_path / "grey.mp4")
    assert refused.value.problem["type"] == "urn:dyknow:problem:taken"
    with pytest.raises(JobError, match=r"failed: .*grey\.mp4"):  # nothing moves in it
        server.wait(server.run("grey.mp4"))
    with pytest.raises(ProblemError, match="404 Not Found: event: expected the id"):
        server.why("none")
    with pytest.raises(ProblemError, match="last_event_id: expected"):
        next(server.stream(last_event_id=10**9))
