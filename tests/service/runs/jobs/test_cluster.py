"""Does a Ray cluster process each job once, as workers do? On a real one, of this machine."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import pytest

from service.cli.app import run as run_cli
from service.runs.jobs.cluster import asks_for_gpu
from service.runs.jobs.worker import work
from service.runs.live.recording_writer import left_behind
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.conftest import NewLog
from tests.service.logs import kept_rows
from tests.service.runs.jobs.test_jobs import WORK, add, opened, until
from tests.service.runs.live.test_watched_jobs import only_job, patient_camera, queue
from tests.service.runs.live.test_watching import events, recorded_bytes, reprocessed, sent_at

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed; `make test-cluster` does it")


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def answers(port: int) -> bool:
    with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Start a cluster of two cores; give its address."""
    port = free_port()
    ports = [f"--port={port}", f"--ray-client-server-port={free_port()}"]
    options = ["--num-cpus=2", "--include-dashboard=false", "--disable-usage-stats", "--block"]
    start = [str(Path(sys.executable).with_name("ray")), "start", "--head", *ports, *options]
    with subprocess.Popen(start, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as head:
        until(lambda: head.poll() is not None or answers(port))
        assert head.poll() is None
        yield f"127.0.0.1:{port}"
        head.terminate()


def begin(url: str, address: str) -> "subprocess.Popen[str]":
    """Begin to place the jobs of a log."""
    return subprocess.Popen([*WORK, url, "--once", "--cluster", address], stderr=subprocess.PIPE, text=True)


def place_all(url: str, address: str) -> list[str]:
    """Place the jobs of a log, and wait for their end; give what was told."""
    with begin(url, address) as placing:
        _, told = placing.communicate()
    assert placing.returncode == 0, told
    return told.splitlines()


def process_of(job: str) -> int:
    """Find the process of Ray's that is at a job, which it has in its title."""
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if place.read_bytes().startswith(f"ray::job {job}".encode()):
                return int(place.parent.name)
    raise AssertionError(f"expected a process at job {job}, got none")


def sorted_rows(url: str) -> dict[str, list[str]]:
    """Read all rows of a log, without the numbers of events and runs, which go by the order of writing."""
    rows = kept_rows(url)
    rows["events"] = [(row[1], *row[3:-1], {**json.loads(row[-1]), "seq": None}) for row in rows["events"]]
    return {kind: sorted(map(repr, found)) for kind, found in rows.items()}


@needs_ray
@pytest.mark.slow
def test_a_cluster_processes_jobs_as_a_worker_does(new_log: NewLog, tracks: Path, address: str) -> None:
    url, plain, broken = new_log(), new_log(), tracks.parent / "broken.csv"
    broken.write_text("t_us,id\n0,a\n")
    for one in (url, plain):
        with opened(one) as jobs:
            good = [add(jobs, tracks, min_confidence=floor) for floor in (0.0, 0.1, 0.2)]
            bad = add(jobs, broken)
    work(plain, stays=False, tell=lambda _: None)
    told = place_all(url, address)
    with opened(url) as jobs:
        assert [(one.state, one.attempts) for one in map(jobs.find, good)] == [("finished", 1)] * 3
        assert jobs.find(bad).state == "failed"
    assert sorted_rows(url) == sorted_rows(plain)
    for name in good:
        assert [line.split(": ")[0] for line in told if name in line] == [
            f"job {name} is placed", f"job {name}", f"job {name} is finished",
        ]  # fmt: skip
    assert place_all(url, address) == []


@needs_ray
@pytest.mark.slow
def test_a_killed_process_of_the_cluster_loses_nothing_and_doubles_nothing(
    new_log: NewLog, scene: Path, address: str
) -> None:
    url, whole = new_log(), new_log()
    process(RunRequest(scene / "truth.csv", scene / "site.toml", whole))
    with opened(url) as jobs:
        name = add(jobs, scene / "truth.csv")
        with begin(url, address) as placing:
            until(lambda: " s of input" in jobs.find(name).message)
            os.kill(process_of(name), signal.SIGKILL)
            placing.communicate()
        assert placing.returncode == 0
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("finished", 2)
    assert sorted_rows(url) == sorted_rows(whole)


@needs_ray
@pytest.mark.slow
def test_a_live_source_is_watched_again_when_its_process_is_killed(scene: Path, tmp_path: Path, address: str) -> None:
    url, sent = str(tmp_path / "live.db"), sent_at(0, scene, tmp_path)
    with patient_camera(sent) as camera:
        assert queue(camera, url, tmp_path, "--site", str(scene / "site.toml")) == 0
        name = only_job(url).id
        with begin(url, address) as placing:
            until(lambda: recorded_bytes(tmp_path) > 0.9 * len(sent))
            os.kill(process_of(name), signal.SIGKILL)
            until(lambda: recorded_bytes(tmp_path) > 1.8 * len(sent))
            until(lambda: left_behind(tmp_path / "recordings") == [])
            assert run_cli(["jobs", "cancel", url, name]) == 0
            placing.communicate()
    assert placing.returncode == 0
    assert only_job(url).state == "cancelled"
    with open_log(url) as log:
        assert [one.status for one in log.runs()] == ["finished"] * 2
    assert sorted(events(url)) == sorted(events(reprocessed(tmp_path, scene))) != []


@needs_ray
@pytest.mark.slow
def test_who_places_and_is_ended_lets_the_jobs_wait_again(new_log: NewLog, scene: Path, address: str) -> None:
    url = new_log()
    with opened(url) as jobs:
        names = [add(jobs, scene / "truth.csv", min_confidence=floor) for floor in (0.0, 0.1, 0.2)]
        with begin(url, address) as placing:
            until(lambda: any(" s of input" in jobs.find(name).message for name in names))
            placing.send_signal(signal.SIGTERM)
            placing.communicate()
        assert placing.returncode == 130
        assert [(jobs.find(name).state, jobs.find(name).attempts) for name in names] == [("waiting", 0)] * 3


@needs_ray
@pytest.mark.slow
@pytest.mark.parametrize("named", ["127.0.0.1:{port}", "ray://127.0.0.1:{port}", "nowhere"])
def test_a_cluster_that_does_not_answer_is_told_in_a_line(new_log: NewLog, named: str) -> None:
    url, where = new_log(), named.format(port=free_port())
    with opened(url):
        pass
    with begin(url, where) as placing:
        _, told = placing.communicate()
    assert (placing.returncode, told.count("\n")) == (3, 1)
    assert told.startswith(f"error: cluster '{where}': expected the address of a Ray cluster that answers")


def test_without_ray_the_extra_is_named(
    new_log: NewLog, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with opened(url := new_log()):
        pass
    monkeypatch.setitem(sys.modules, "ray", None)
    assert run_cli(["worker", url, "--cluster", "auto"]) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert "cluster 'auto': expected the extra 'cluster' (pip install 'dyknow[cluster]'), got" in line


@pytest.mark.parametrize(
    ("providers", "asks"),
    [('["cuda", "cpu"]', True), ('["cuda"]', True), ('["cpu", "cuda"]', False), ('["cpu"]', False), ("wrong", False)],
)
def test_what_cuda_computes_first_asks_for_a_gpu(tmp_path: Path, providers: str, *, asks: bool) -> None:
    weights, site = tmp_path / "net.onnx", tmp_path / "site.toml"
    weights.write_bytes(b"")
    recipe = f'layout = "rows"\nproviders = {providers}\n[classes]\n0 = "car"\n'
    weights.with_suffix(".toml").write_text(recipe)
    site.write_text('name = "a"\n[detector]\nuse = "onnx:net.onnx"\n')
    assert asks_for_gpu(RunRequest(tmp_path / "a.mp4", site, "a.db")) is asks
    assert asks_for_gpu(RunRequest(tmp_path / "a.mp4", site, "a.db", detector=f"onnx:{weights}")) is asks
    assert asks_for_gpu(RunRequest(tmp_path / "a.mp4", site, "a.db", detector="motion")) is False
    assert asks_for_gpu(RunRequest(tmp_path / "a.mp4", None, "a.db")) is False
