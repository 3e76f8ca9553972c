"""Do rows that come through a pipe give, while they come, what the file of them gives?"""

import json
import logging
import os
import random
import signal
import subprocess
import threading
from collections.abc import Iterable, Sequence
from contextlib import closing, suppress
from pathlib import Path

import pytest

from service.cli.app import run as run_cli
from service.errors import LogError
from service.runs.inputs.recorded_rows import WAIT_US, ArrivingRows
from service.runs.live.live_source import LiveSource
from service.runs.live.receiver import RowReceiver
from service.runs.live.recording_writer import RecordingWriter, left_behind, recordings
from service.store.log import open_log
from tests.service.logs import kept_rows
from tests.service.runs.live.test_watching import WATCH, events, reprocessed, until

HEADER = "t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m"
SHAPE = "0,0,10,4.5,1.8"
MS = 1_000


def watching(folder: Path, *options: object) -> "subprocess.Popen[bytes]":
    names = ["--log", folder / "live.db", "--recordings", folder / "recordings", *options]
    command = [*WATCH, "-", "--rows", *map(str, names)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)


def send(program: "subprocess.Popen[bytes]", lines: Iterable[str]) -> None:
    assert program.stdin is not None
    program.stdin.write("".join(lines).encode())
    program.stdin.flush()


def told_so_far(log: Path) -> Sequence[object]:
    with suppress(LogError):  # it is being made
        return events(log)
    return ()


def recording(folder: Path, *rows: str) -> Path:
    with closing(RecordingWriter(folder / "a")) as writer:
        writer.begin_rows(f"{HEADER}\n".encode())
        writer.write_bytes("".join(f"{row}\n" for row in rows).encode())
    return folder / "a"


@pytest.mark.long
def test_rows_give_while_they_come_what_their_file_gives(small_scene: Path, tracks_log: Path, tmp_path: Path) -> None:
    header, *rows = (small_scene / "truth.csv").read_text().splitlines(keepends=True)
    rng = random.Random(1)
    shuffled = sorted(rows, key=lambda row: int(row.split(",")[0]) + rng.uniform(0, 0.9 * WAIT_US))
    most = len(shuffled) * 3 // 4  # whole spans of ten seconds are written as they end
    with watching(tmp_path, "--site", small_scene / "site.toml") as program:
        send(program, [header, *shuffled[:most]])
        until(lambda: bool(told_so_far(tmp_path / "live.db")), program)  # while the pipe is open
        send(program, shuffled[most:])
        _, told = program.communicate()
    assert program.returncode == 0, told
    assert b"rows were left out" not in told
    assert sorted(events(tmp_path / "live.db")) == sorted(events(tracks_log)) != []
    live, once = kept_rows(tmp_path / "live.db"), kept_rows(tracks_log)
    assert [live[kind] for kind in ("states", "objects", "frames", "cars")] == [
        once[kind] for kind in ("states", "objects", "frames", "cars")
    ]
    assert kept_rows(tmp_path / "live.db") == kept_rows(reprocessed(tmp_path, small_scene))
    with open_log(str(tmp_path / "live.db")) as log:
        assert (log.run().status, log.run().input_kind) == ("finished", "trajectory")


@pytest.mark.slow
def test_rows_that_a_killed_program_left_are_processed_beside_those_that_come(tracks: Path, tmp_path: Path) -> None:
    site, lines = tracks.parent / "site.toml", tracks.read_text().splitlines(keepends=True)
    with watching(tmp_path, "--site", site) as program:
        send(program, lines)
        until(lambda: len(recordings(tmp_path / "recordings")) == 1, program)
        program.kill()
    (left,) = left_behind(tmp_path / "recordings")
    with watching(tmp_path, "--site", site) as program:
        send(program, lines)
        until(lambda: left not in left_behind(tmp_path / "recordings"), program)
        program.send_signal(signal.SIGINT)
        _, told = program.communicate()
    assert program.returncode == 0, told
    with open_log(str(tmp_path / "live.db")) as log:
        assert [one.status for one in log.runs()] == ["finished", "finished"]


def test_rows_that_are_late_or_wrong_are_told_and_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rows = [f"{t_us},a,{t_us / 1e6},{SHAPE}" for t_us in (0, 900 * MS, 400 * MS, 1600 * MS, 599 * MS, 600 * MS)]
    rows += [
        "",
        f"1600000,a,2,{SHAPE}",
        f"1700000,a,near,{SHAPE}",
        "1700000,a",
        f'1700000,"a,2,{SHAPE}',
        f"1700000,a,3,{SHAPE}",
    ]
    found = ArrivingRows(recording(tmp_path, *rows), None)
    with caplog.at_level(logging.WARNING):
        assert [one.t_us for one in found] == [0, 400 * MS, 600 * MS, 900 * MS, 1600 * MS, 1700 * MS]
    assert [line.partition(": ")[0] for line in caplog.messages] == ["a:6", "a:9", "a:10", "a:11", "a:12"]
    assert "expected a time of 600000 us or later, got 599000 us" in caplog.messages[0]
    assert found.notes() == ("5 rows were left out, wrong or more than 1 s late",)


def test_what_waits_is_bounded_by_the_lateness(tmp_path: Path) -> None:
    """Objects come as soon as rows of that much later have, not at the end."""
    with closing(RecordingWriter(tmp_path / "a")) as writer:
        writer.begin_rows(f"{HEADER}\n".encode())
        writer.write_bytes("".join(f"{t_us},a,{t_us / 1e6},{SHAPE}\n" for t_us in (0, 500 * MS, 1501 * MS)).encode())
        found = iter(ArrivingRows(tmp_path / "a", None))
        assert [next(found).t_us, next(found).t_us] == [0, 500 * MS]  # while it is written


def test_a_line_that_a_writer_was_killed_in_is_none(tmp_path: Path) -> None:
    folder = recording(tmp_path, f"0,a,0,{SHAPE}", f"100000,a,1,{SHAPE}")
    with (folder / "000000.csv").open("a") as file:
        file.write(f"200000,a,2,{SHAPE[:-2]}")
    assert [one.t_us for one in ArrivingRows(folder, None)] == [0, 100_000]


def received(folder: Path, text: str) -> list[Path]:
    """Send a text through a pipe; return the recordings of it."""
    os.mkfifo(folder / "pipe")
    writer = threading.Thread(target=lambda: (folder / "pipe").write_text(text))
    writer.start()
    begun = list[Path]()
    with closing(LiveSource(str(folder / "pipe"))) as source:
        RowReceiver(source, folder / "rows", longest_us=10**12, most_bytes=200_000).record(begun.append)
    writer.join()
    assert recordings(folder / "rows") == begun
    assert len(begun) > 2
    return begun


def as_object(row: str) -> str:
    return json.dumps(dict(zip(HEADER.split(","), row.strip().split(","), strict=True))) + "\n"


@pytest.mark.long
def test_objects_of_json_are_recorded_and_read_as_rows_are(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rows = [f"{number * MS},a,{number / 100},{SHAPE}" for number in range(6_000)]
    begun = received(tmp_path, "".join([*map(as_object, rows)])[:-1])
    texts = [(folder / "000000.jsonl").read_text() for folder in begun]
    assert "".join(texts) == "".join(map(as_object, rows))
    found = [one.t_us for folder in begun for one in ArrivingRows(folder, None)]
    assert found == [number * MS for number in range(6_000)]
    with closing(RecordingWriter(tmp_path / "b")) as writer:
        writer.begin_rows(b"", ".jsonl")
        lines = [as_object(rows[0]), '{"t_us": \n', "\n", as_object(rows[1]).replace("{", '{"lane": 1, ')]
        writer.write_bytes("".join([*lines, as_object(rows[2]), as_object(rows[2])]).encode())
    with caplog.at_level(logging.WARNING):
        assert [one.t_us for one in ArrivingRows(tmp_path / "b", None)] == [0, 2 * MS]
    assert [line.partition(": ")[0] for line in caplog.messages] == ["b:2", "b:4", "b:6"]


def test_recordings_that_grow_large_are_followed_by_others_with_the_same_header(tmp_path: Path) -> None:
    rows = [f"{number},a,{number},{SHAPE}\n" for number in range(40_000)]
    begun = received(tmp_path, "".join([f"{HEADER}\n", *rows])[:-1])
    texts = [(folder / "000000.csv").read_text().splitlines(keepends=True) for folder in begun]
    assert {lines[0] for lines in texts} == {f"{HEADER}\n"}
    assert [row for lines in texts for row in lines[1:]] == rows


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (b"", "pipe: expected rows, got nothing"),
        (b"t_us,id\n0,a\n", ":1: expected columns x_m, y_m"),
        (f"{HEADER}\n".encode(), "expected at least one frame, got none"),
        (b"\x00" * 2_000_000, "pipe: expected lines of rows, got "),
    ],
)
def test_what_is_no_table_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str], sent: bytes, said: str) -> None:
    def write() -> None:
        with suppress(BrokenPipeError):
            pipe.write_bytes(sent)

    os.mkfifo(pipe := tmp_path / "pipe")
    writer = threading.Thread(target=write)
    writer.start()
    names = ["--log", str(tmp_path / "a.db"), "--recordings", str(tmp_path / "recordings")]
    run_cli(["watch", str(pipe), "--rows", *names])
    writer.join()
    assert said in capsys.readouterr().err


def test_rows_come_through_a_pipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["--log", str(tmp_path / "a.db"), "--recordings", str(tmp_path / "recordings")]
    assert run_cli(["watch", "tcp://127.0.0.1:9", "--rows", *names]) == 3
    assert "expected a pipe or - for rows, got another source" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
