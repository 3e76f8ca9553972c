"""Many inputs in one command: which they are, what each gets, and what becomes of those that cannot be read."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import typer

from service.cli.app import run
from service.cli.making.many import COMMAND, expanded, jobs_of, site_beside
from service.store.log import open_log
from tests.service.runs.inputs.sensors.test_vision_apart import long_video
from tests.service.runs.inputs.test_detectors import SITE, make_video


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
        jobs_of([Path("a/v.mp4"), Path("b/v.avi")], Path("logs"))


def test_each_gets_a_log_and_one_that_cannot_be_read_stops_no_other(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "one.mp4").unlink()
    assert (
        run(["process", str(folder), "--logs", str(folder / "logs"), "--rate", "full", "--jobs", "2", "--workers", "0"])
        == 3
    )
    told = capfd.readouterr()
    assert "1 of 2 finished" in told.out
    assert "bad.mp4: error: video" in told.err
    with open_log(str(folder / "logs" / "two.db")) as log:
        record = log.run()
        assert (record.source, record.status, record.site) == ("two.MP4", "finished", "Test road")
        assert dict(record.settings)["rate_hz"] == "inf"


# In place of the command that processes one input: says that it is there, and when it ends.
SAY_AND_END = """
import sys
print('{"type": "progress", "frames": 12}', flush=True)
print("a word between", flush=True)
print('{"type": "summary", "status": "finished", "frames": 31}')
"""
SAY_AND_STAY = """
import signal, sys
from pathlib import Path
def end(*_):
    print('{"type": "summary", "status": "interrupted", "frames": 12}')
    sys.exit(143)
signal.signal(signal.SIGTERM, end)
Path(sys.argv[sys.argv.index("--log") + 1]).touch()
signal.pause()
"""


def test_json_tells_of_each_and_of_all(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "bad.mp4").unlink()
    monkeypatch.setattr("service.cli.making.many.COMMAND", (sys.executable, "-c", SAY_AND_END))
    assert run(["process", str(folder), "--logs", str(folder / "logs"), "--json", "--jobs", "1"]) == 0
    first, second, last = map(json.loads, capfd.readouterr().out.splitlines())
    assert last == {"type": "summary", "inputs": 2, "finished": 2}
    assert [(one["type"], one["status"], one["code"], one["frames"]) for one in (first, second)] == [
        ("job", "finished", 0, 31)
    ] * 2
    assert first["messages"] == ["a word between"]


def test_signal_goes_to_those_that_run_and_no_other_begins(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def send() -> None:
        while not list(logs.glob("*.db")):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGTERM)

    logs = folder / "logs"
    monkeypatch.setattr("service.cli.making.many.COMMAND", (sys.executable, "-c", SAY_AND_STAY))
    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    assert run(["process", str(folder), "--logs", str(logs), "--json", "--jobs", "1"]) == 128 + signal.SIGTERM
    sender.join()
    *told, last = map(json.loads, capfd.readouterr().out.splitlines())
    assert [(one["status"], one["code"], one["frames"]) for one in told] == [("interrupted", 143, 12)]
    assert last["finished"] == 0


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], "expected one of --log and --logs, got neither"),
        (["--log", "a.db", "--logs", "b"], "expected one of --log and --logs, got both"),
        (["--log", "a.db"], "--log: expected one input, got 2; --logs DIR gives each a log"),
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


@pytest.mark.slow
def test_signal_ends_those_that_run_and_begins_no_other(tmp_path: Path) -> None:
    video = long_video(tmp_path)
    (tmp_path / "site.toml").write_text(SITE, encoding="utf-8")
    for name in ("second", "third"):
        (tmp_path / f"{name}.mp4").write_bytes(video.read_bytes())
    options = ["--logs", str(tmp_path / "logs"), "--jobs", "1", "--json", "--workers", "0"]
    with subprocess.Popen([*COMMAND, str(tmp_path), *options], stdout=subprocess.PIPE, text=True) as child:
        log = tmp_path / "logs" / "long.db"
        while not log.exists():
            assert child.poll() is None
        os.kill(child.pid, signal.SIGTERM)
        out, _ = child.communicate()
    records = [json.loads(line) for line in out.splitlines()]
    assert child.returncode == 128 + signal.SIGTERM
    assert records[-1]["finished"] == 0
    assert [one["status"] for one in records[:-1]] == ["interrupted"]
