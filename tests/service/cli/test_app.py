"""Does the command line do what its help says, as a user and as a script see it?"""

import csv
import json
import os
import re
import signal
import socket
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import httpx
import pytest

from service.cli import app
from service.questions.events.queries import decode_event
from service.records.runs import CameraRecord
from tests.service.logs import SECOND_US, overtake, read_all, run, write_log, write_small_log

PROGRAM = [sys.executable, "-c", "from service.cli.app import main; main()"]

GOOD_CHRONICLE = """\
chronicle overtake[?overtaker, ?overtaken](t1, t2) {
  event(behind[?overtaker, ?overtaken]: (true, false), t1)
  event(behind[?overtaken, ?overtaker]: (false, true), t2)
  t2 - t1 in ]0s, 20s]
}
"""


@pytest.fixture
def log(tmp_path: Path) -> str:
    """Three overtakes and a pass, ten seconds apart."""
    drafts = [overtake(10 * number * SECOND_US) for number in range(3)]
    roles = {"passer": "car7", "passed": "car1"}
    return write_log(tmp_path / "a.db", [*drafts, overtake(30 * SECOND_US, type="pass", roles=roles, place=None)])


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["--help"]) == 0
    listed = re.findall(r"^  ([a-z][a-z-]*)  ", capsys.readouterr().out, re.MULTILINE)
    assert listed == list(dict.fromkeys(name.split()[0] for name in app.COMMANDS))


def test_help_loads_nothing_heavy() -> None:
    code = "import sys; from service.cli.app import run; run(['--help']); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {
        "numpy",
        "cv2",
        "scipy",
        "sqlalchemy",
        "fastapi",
        "pydantic",
        "msgspec",
        "uvicorn",
        "av",
        "libsumo",
        "rich",
    }
    assert not heavy & set(done.stderr.split())


def test_events_are_shown_as_a_table(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["events", log, "--type", "overtake", "--from", "5s", "--to", "00:15"]) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines() == [
        "start      end        type      roles                          road   status      sure  source    id",
        "00:10.000  00:13.000  overtake  overtaker=car7 overtaken=car3  road1  recognised  1.00  demo.mp4  r1-2",
    ]
    assert shown.err == ""


def test_a_cut_table_says_so(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["events", log, "--limit", "2", "--order", "-start"]) == 0
    shown = capsys.readouterr()
    assert [line.split()[-1] for line in shown.out.splitlines()] == ["id", "r1-4", "r1-3"]
    assert "the first 2 of more" in shown.err


def test_jsonl_is_the_log_line_by_line(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["events", log, "--format", "jsonl"]) == 0
    assert [decode_event(line) for line in capsys.readouterr().out.splitlines()] == read_all(log)


def test_csv_has_a_column_for_each_role(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["events", log, "--format", "csv", "--role", "passer=car7"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith(",role.overtaken,role.overtaker,role.passed,role.passer")
    assert [row["id"] for row in csv.DictReader(lines)] == ["r1-4"]


def test_several_logs_are_merged_in_the_order_of_time(
    log: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = write_log(tmp_path / "b.db", [overtake(15 * SECOND_US)], record=run("r2"))
    assert app.run(["events", log, "--log", other, "--format", "jsonl", "--order", "-start", "--limit", "4"]) == 0
    found = [json.loads(line)["id"] for line in capsys.readouterr().out.splitlines()]
    assert found == ["r1-4", "r1-3", "r2-1", "r1-2"]


def test_nothing_found_is_a_success_unless_asked(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["events", log, "--actor", "car99"]) == 0
    assert app.run(["events", log, "--actor", "car99", "--fail-empty"]) == 4
    assert "nothing found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["events", "missing.db"], 3, "error: log 'missing.db': expected an event log, got no such file\n"),
        (["events", "http://x/a.db"], 3, "got scheme 'http'"),
        (["events", "LOG", "--from", "noon"], 2, "error: --from: expected microseconds of media time"),
        (["events", "LOG", "--from", "9s", "--to", "3s"], 2, "error: from: expected a time before 'to'"),
        (["events", "LOG", "--role", "car7"], 2, "expected NAME=ID, such as overtaker=car7, got 'car7'"),
        (["events", "LOG", "--format", "xml"], 2, "xml"),
        (["events"], 2, "expected at least one event log, got none"),
        (["tracks", "LOG", "--run", "r9"], 3, "expected a run 'r9', got ['r1']"),
        (["tracks", "LOG", "--to", "2026-05-01T08:00:00Z"], 2, "seconds (12.5s) or mm:ss (01:23.5), got '2026"),
        (["clip", "LOG", "r1-1", "--out", "a.mp4", "--pad", "much"], 2, "or mm:ss (01:23.5), got 'much'"),
        (["serve", "missing.db"], 3, "error: log 'missing.db': expected an event log, got no such file"),
        (["check", "missing.chronicle"], 3, "expected a readable text file, got No such file or directory"),
        (["fly"], 2, "No such command 'fly'"),
    ],
)
def test_errors_say_where_and_exit_with_their_code(
    log: str, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, message: str
) -> None:
    assert app.run([log if argument == "LOG" else argument for argument in arguments]) == code
    shown = capsys.readouterr()
    assert message in shown.err
    assert shown.out == ""


def test_a_fault_of_ours_is_no_traceback(
    log: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DYKNOW_TRACEBACK", raising=False)
    monkeypatch.setattr("service.questions.events.queries.iterate_events", lambda *_, **__: 1 // 0)
    assert app.run(["events", log]) == 1
    assert capsys.readouterr().err.startswith("error: dyknow: expected to finish, got 'ZeroDivisionError: ")


def test_an_interrupt_exits_with_130(log: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("service.questions.events.queries.iterate_events", interrupt)
    assert app.run(["events", log]) == 130


def test_tracks_as_csv(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    assert app.run(["tracks", url, "--car", "car10", "--from", "40000"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(",")[0] for line in lines] == ["t_us", "40000", "80000"]
    assert [line.split(",")[-1] for line in lines] == ["visible", "1", "0"]


def test_tracks_as_mot_count_frames_and_cars_from_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    assert app.run(["tracks", url, "--format", "mot"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(",")[:2] for line in lines] == [
        ["1", "1"],
        ["1", "2"],
        ["2", "1"],
        ["2", "2"],
        ["3", "1"],
        ["3", "2"],
    ]


def test_mot_needs_a_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db", run(camera=None))
    assert app.run(["tracks", url, "--format", "mot"]) == 3
    assert "run 'r1': expected a run with a camera" in capsys.readouterr().err


def test_mot_says_what_it_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    far = CameraRecord((10.0, 0.0, 5000.0, 0.0, -10.0, 200.0, 0.0, 0.0, 1.0), 640, 360)
    url = write_small_log(tmp_path / "a.db", run(camera=far))
    assert app.run(["tracks", url, "--format", "mot"]) == 0
    assert "6 car positions have no box: 6 outside the image" in capsys.readouterr().err


def test_a_good_chronicle_passes_the_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "good.chronicle"
    path.write_text(GOOD_CHRONICLE)
    assert app.run(["check", str(path)]) == 0
    assert "1 file: 0 errors" in capsys.readouterr().err


def test_the_shipped_chronicles_pass_the_check() -> None:
    folder = str(files("chronicles.library"))
    assert app.run(["check", *(str(path) for path in Path(folder).glob("*.chronicle"))]) == 0


def test_an_error_in_a_chronicle_is_shown_with_a_caret(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.chronicle"
    path.write_text(GOOD_CHRONICLE.replace("event(behind[?overtaker", "event(behnd[?overtaker"))
    assert app.run(["check", str(path)]) == 3
    lines = capsys.readouterr().out.splitlines()
    place = next(number for number, line in enumerate(lines) if line.endswith("bad.chronicle:2:9"))
    assert lines[place + 3].rstrip().endswith("^^^^^")


def test_diagnostics_come_as_json_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.chronicle"
    path.write_text(GOOD_CHRONICLE.replace("event(behind[?overtaker", "event(behnd[?overtaker"))
    assert app.run(["check", str(path), "--format", "json"]) == 3
    [found] = [one for one in json.loads(capsys.readouterr().out) if one["severity"] == "error"]
    assert found["range"]["start"] == {"line": 1, "character": 8}


@pytest.mark.long
def test_serve_answers_until_it_is_interrupted(log: str) -> None:
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    command = [*PROGRAM, "serve", log, "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stderr is not None
        line = process.stderr.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+", line)
        assert address is not None, line + process.stderr.read()
        answer = httpx.get(f"{address[0]}/api/v1/events", params={"type": "pass"}, timeout=20)
        assert [event["id"] for event in answer.json()["items"]] == ["r1-4"]
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 130
        assert re.fullmatch(r"worker \d+ begins\n", process.stderr.read())


def test_a_port_in_use_is_named(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert app.run(["serve", log, "--port", str(port)]) == 3
    assert f"error: 127.0.0.1:{port}: expected a free address to listen on" in capsys.readouterr().err
