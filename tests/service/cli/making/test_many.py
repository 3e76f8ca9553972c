"""Many inputs in one command: which they are, what each gets, and what becomes of those that cannot be read."""

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from service.cli.app import run
from service.cli.making.many import QUEUE, expanded, logs_of, site_beside
from service.runs.jobs.worker import work
from service.store.entries import Job
from service.store.log import open_log
from tests.service.conftest import first_seconds
from tests.service.runs.inputs.sensors.test_vision_apart import long_video
from tests.service.runs.inputs.test_detectors import SITE, make_video
from tests.service.runs.jobs.test_jobs import is_free, opened, until
from vision.video.recording import INDEX

PROCESS = [sys.executable, "-c", "from service.cli.app import main; main()", "process"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with two videos, their site, and two files that are none."""
    first = make_video(tmp_path / "one.mp4")
    (tmp_path / "two.MP4").write_bytes(first.read_bytes())
    (tmp_path / "bad.mp4").write_text("this is no video")
    (tmp_path / "notes.txt").write_text("nor is this")
    (tmp_path / "site.toml").write_text(SITE, encoding="utf-8")
    return tmp_path


def test_folders_and_patterns_are_expanded_and_names_stay(folder: Path) -> None:
    one, two, bad = (folder / name for name in ("one.mp4", "two.MP4", "bad.mp4"))
    assert expanded([folder]) == [bad, one, two]
    assert expanded([folder / "t*", one, folder / "o*"]) == [two, one]
    assert expanded([folder / "gone.mp4"]) == [folder / "gone.mp4"]
    (folder / INDEX).touch()  # a recording is one input
    assert expanded([folder]) == [folder]


def test_empty_folder_and_pattern_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, what in (("", "videos in the folder"), ("*.mp4", "files that the pattern fits")):
        assert run(["process", str(tmp_path / name), "--logs", str(tmp_path / "logs")]) == 2
        assert f"expected {what}, got none" in " ".join(capsys.readouterr().err.split())


def test_site_of_the_same_name_goes_before_that_of_the_folder(folder: Path) -> None:
    own = folder / "one.toml"
    own.write_text(SITE, encoding="utf-8")
    assert [site_beside(folder / name) for name in ("one.mp4", "two.MP4")] == [own, folder / "site.toml"]
    assert site_beside(folder / "deeper" / "one.mp4") is None


def test_inputs_that_would_share_a_log_are_refused() -> None:
    with pytest.raises(typer.BadParameter, match=r"expected inputs of different names, got a/v.mp4 and b/v.avi"):
        logs_of([Path("a/v.mp4"), Path("b/v.avi")], Path("logs"))


def listed(log: Path) -> list[Job]:
    with opened(str(log)) as jobs:
        return jobs.listed()


@pytest.mark.long
def test_each_gets_a_log_and_one_that_cannot_be_read_stops_no_other(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "one.mp4").unlink()
    logs = folder / "logs"
    assert run(["process", str(folder), "--logs", str(logs), "--rate", "full", "--jobs", "2", "--workers", "0"]) == 3
    told = capfd.readouterr()
    assert "1 of 2 finished" in told.out
    assert "expected a video file, got unreadable content" in told.out
    assert "(2 of 2): " in told.err
    with open_log(str(logs / "two.db")) as log:
        record = log.run()
        assert (record.source, record.status, record.site) == ("two.MP4", "finished", "Test road")
        assert dict(record.settings)["rate_hz"] == "inf"
    assert [(Path(one.input).name, one.state, one.run) for one in listed(logs / QUEUE)] == [
        ("bad.mp4", "failed", None), ("two.MP4", "finished", record.id),
    ]  # fmt: skip


@pytest.mark.long
def test_several_in_one_log_are_its_jobs_and_the_same_again_are_the_same_jobs(
    small_scene: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for name, seconds in (("short", 2), ("shorter", 1)):
        (tmp_path / name).mkdir()
        first_seconds(small_scene, tmp_path / name, seconds)
    log = tmp_path / "a.db"
    given = ["process", str(tmp_path / "*" / "a.csv"), "--log", str(log), "--json", "--jobs", "1"]
    assert run(given) == 0
    *told, last = map(json.loads, capfd.readouterr().out.splitlines())
    assert last == {"type": "summary", "inputs": 2, "finished": 2}
    with open_log(str(log)) as opened_log:
        runs = {one.id for one in opened_log.runs()}
    assert {one["run"] for one in told} == runs
    assert [(one["type"], one["state"], one["attempts"]) for one in told] == [("job", "finished", 1)] * 2
    assert all(" frames, " in one["message"] and " cars, " in one["message"] for one in told)
    first = [one.id for one in listed(log)]
    assert run(given) == 0
    *again, last = map(json.loads, capfd.readouterr().out.splitlines())
    assert {one["run"] for one in again} == runs
    assert {one["message"] for one in again} == {one["message"] for one in told}
    assert [one.id for one in listed(log)] == first
    assert run([*given, "--queue"]) == 0
    assert [one.id for one in listed(log)] == first


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], "expected one of --log and --logs, got neither"),
        (["--log", "a.db", "--logs", "b"], "expected one of --log and --logs, got both"),
        (["--log", "a.db", "--detections", "c.txt"], "--detections: expected one input to go with a file of boxes"),
        (
            ["--logs", "b", "--detections", "c.txt"],
            "--detections: expected one input to go with a file of boxes, got 2",
        ),
        (["--logs", "b", "--jobs", "0"], "Invalid value for '--jobs'"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    options: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["process", "one.mp4", "two.mp4", *options]) == 2
    assert expected in " ".join(capsys.readouterr().err.split())


def test_one_that_is_missing_is_told_before_anything_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = folder / "a.db"
    assert run(["process", str(folder / "one.mp4"), str(folder / "gone.mp4"), "--log", str(log)]) == 3
    assert "gone.mp4: expected a file, got 'No such file or directory'" in capsys.readouterr().err
    assert not log.exists()


@pytest.fixture
def begun(tmp_path: Path) -> "Callable[[], subprocess.Popen[str]]":
    """Begin to process three videos of a minute, one at a time, into one log; the first one is under way then."""
    video = long_video(tmp_path)
    (tmp_path / "site.toml").write_text(SITE, encoding="utf-8")
    for name in ("second", "third"):
        (tmp_path / f"{name}.mp4").write_bytes(video.read_bytes())
    options = ["--log", str(tmp_path / "a.db"), "--jobs", "1", "--json", "--workers", "0"]

    def begin() -> "subprocess.Popen[str]":
        child = subprocess.Popen([*PROCESS, str(tmp_path), *options], stdout=subprocess.PIPE, text=True)
        until(lambda: (tmp_path / "a.db").exists() and any(" s of input" in one.message for one in listed_now()))
        return child

    def listed_now() -> list[Job]:
        with opened(str(tmp_path / "a.db")) as jobs:
            return jobs.listed()

    return begin


@pytest.mark.slow
def test_a_signal_cancels_all_and_the_same_again_goes_on(
    begun: "Callable[[], subprocess.Popen[str]]", tmp_path: Path
) -> None:
    with begun() as child:
        child.send_signal(signal.SIGTERM)
        out, _ = child.communicate()
    *told, last = map(json.loads, out.splitlines())
    assert child.returncode == 128 + signal.SIGTERM
    assert last["finished"] == 0
    assert sorted((one["state"], one["attempts"]) for one in told) == [
        ("cancelled", 0),
        ("cancelled", 0),
        ("cancelled", 1),
    ]
    with open_log(str(tmp_path / "a.db")) as log:
        assert [one.status for one in log.runs()] == ["interrupted"]
    with begun() as child:
        out, _ = child.communicate()
    assert child.returncode == 0
    assert json.loads(out.splitlines()[-1])["finished"] == 3
    with open_log(str(tmp_path / "a.db")) as log:
        assert [one.status for one in log.runs()] == ["finished"] * 3


@pytest.mark.slow
def test_what_a_killed_command_left_is_for_any_worker(
    begun: "Callable[[], subprocess.Popen[str]]", tmp_path: Path
) -> None:
    url = str(tmp_path / "a.db")
    with begun() as child:
        child.kill()
    for one in listed(tmp_path / "a.db"):
        until(lambda one=one: is_free(url, one.id))  # its worker goes with it
    work(url, stays=False, tell=lambda _: None)
    assert [(one.state, one.attempts) for one in listed(tmp_path / "a.db")] == [("finished", 1)] * 3
