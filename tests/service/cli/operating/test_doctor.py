"""The doctor says what is broken on a machine or in a log, and what to do, and changes nothing."""

import json
import os
import shutil
import sqlite3
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from service.cli.app import run as dyknow
from service.cli.operating import doctor
from service.store.databases.sqlite_file import SqliteFile
from service.store.log import open_log
from service.store.schema import SCHEMA_VERSION
from tests.service.conftest import NewLog
from tests.service.logs import run, write_small_log

Capsys = pytest.CaptureFixture[str]


def examined(capsys: Capsys, *words: str, code: int = 0) -> dict[str, tuple[str, str, str]]:
    assert dyknow(["doctor", *words, "--json"]) == code
    items = json.loads(capsys.readouterr().out)["items"]
    return {one["check"]: (one["state"], one["found"], one["advice"]) for one in items}


def contents(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}


def test_a_whole_machine_and_log_are_in_order(tmp_path: Path, capsys: Capsys) -> None:
    log = write_small_log(tmp_path / "a.db")
    before = contents(tmp_path)
    assert dyknow(["doctor", log]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["check", "state", "found", "advice"]
    named = {line.split("  ")[0] for line in lines[1:]}
    machine = {"packages", "machine", "clock", "video", "sumo", "detector above", "detector low"}
    assert named == machine | {"log", "disk"}
    assert {line.split("  ")[0] for line in lines[1:] if " broken " in line} == set()
    assert contents(tmp_path) == before


@pytest.mark.long
def test_what_a_killed_writer_left_stays_as_it_is(tmp_path: Path, capsys: Capsys) -> None:
    write_small_log(tmp_path / "a.db")
    left = tmp_path / "left"
    left.mkdir()
    engine = SqliteFile(tmp_path / "a.db").writing()
    with engine.connect() as connection:
        connection.exec_driver_sql("delete from meta where key = 'nothing'")
        connection.exec_driver_sql("insert into meta values ('mark', '1')")
        connection.commit()
        for suffix in ("", "-wal", "-shm"):
            shutil.copy(tmp_path / f"a.db{suffix}", left / f"a.db{suffix}")
    engine.dispose()
    before = contents(left)
    assert examined(capsys, str(left / "a.db"))["log"][0] == "ok"
    assert {name: text for name, (text, _) in contents(left).items() if name != "a.db-shm"} == {
        name: text for name, (text, _) in before.items() if name != "a.db-shm"
    }


@pytest.mark.long
@pytest.mark.parametrize(
    ("version", "state", "told"),
    [("9", "note", "take a backup before it is opened"), ("999", "broken", "expected schema version 2 to")],
    ids=["older", "newer"],
)
def test_the_schema_of_a_log_is_told_and_kept(
    tmp_path: Path, capsys: Capsys, version: str, state: str, told: str
) -> None:
    log = write_small_log(tmp_path / "a.db")
    with sqlite3.connect(log.removeprefix("sqlite:///")) as connection:
        connection.execute("update meta set value = ? where key = 'schema_version'", (version,))
    connection.close()
    before = contents(tmp_path)
    found = examined(capsys, log, code=int(state == "broken"))["log"]
    assert found[0] == state
    assert told in " ".join(found)
    assert contents(tmp_path) == before


def test_a_log_that_is_not_there_yet_can_be_made_or_not(tmp_path: Path, capsys: Capsys) -> None:
    assert examined(capsys, str(tmp_path / "new.db"))["log"][:2] == (
        "ok",
        f"{tmp_path / 'new.db'} is empty or not there yet, and can be made",
    )
    found = examined(capsys, str(tmp_path / "nowhere" / "new.db"), code=1)
    assert [found["log"][0], found["disk"][0]] == ["broken", "broken"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_log_on_a_server_is_examined_without_its_password(capsys: Capsys, postgres: NewLog) -> None:
    url = postgres()
    assert examined(capsys, url)["log"][0] == "ok"
    with open_log(url, "w") as log:
        log.begin_run(run()).finish("finished")
    found = examined(capsys, url)
    assert (found["log"][0], found["log"][1].endswith(f", schema {SCHEMA_VERSION}")) == ("ok", True)
    assert "disk" not in found
    found = examined(capsys, "postgresql+psycopg://road:secret@127.0.0.1:1/nothing", code=1)
    assert ("secret" in str(found), found["log"][0]) == (False, "broken")


@pytest.mark.long
@pytest.mark.parametrize(("kind", "code"), [("nfs4", 1), ("fuse.sshfs", 1), ("ext4", 0), ("fuseblk", 0)])
def test_a_network_file_system_is_no_place_for_a_log(
    tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch, kind: str, code: int
) -> None:
    mounts = [SimpleNamespace(mountpoint=place, fstype=one) for place, one in (("/", "ext4"), (str(tmp_path), kind))]
    monkeypatch.setattr(psutil, "disk_partitions", lambda **_: mounts)
    state, found, advice = examined(capsys, write_small_log(tmp_path / "a.db"), code=code)["disk"]
    assert f"{kind} at {tmp_path}" in found
    assert (state, "PostgreSQL" in advice) == (("broken", True) if code else ("ok", False))


def test_weights_that_cannot_be_loaded_are_told_and_the_rest_examined(
    tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DYKNOW_DETECTORS", str(tmp_path))
    (tmp_path / "cut.onnx").write_bytes(b"no weights")
    (tmp_path / "lone.onnx").write_bytes(b"no recipe")
    shutil.copy(Path(doctor.__file__).parents[3] / "vision/networks/weights/low.toml", tmp_path / "cut.toml")
    found = examined(capsys, code=1)
    assert [found[f"detector {name}"][0] for name in ("above", "cut", "lone", "low")] == [
        "ok",
        "broken",
        "broken",
        "ok",
    ]
    assert "cut.onnx" in found["detector cut"][1]
    assert found["detector cut"][2] == "dyknow detector add FILE --force"


def test_a_package_that_is_missing_or_too_old_is_named(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    for needed, told in (
        ("no-such-package>=1", "No package metadata was found for no-such-package"),
        ("typer>=99", "expected typer>=99, got"),
    ):
        monkeypatch.setattr(metadata, "requires", lambda _, text=needed: ["ray; extra == 'cluster'", text])
        state, found, advice = examined(capsys, code=1)["packages"]
        assert (state, told in found, "pip install" in advice) == ("broken", True, True)


def test_a_clock_from_before_the_installation_is_wrong(
    tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "installed").touch()
    os.utime(tmp_path / "installed", (5e9, 5e9))  # in the year 2128
    monkeypatch.setattr(doctor, "__file__", str(tmp_path / "installed"))
    assert examined(capsys, code=1)["clock"][1].startswith("expected a time after 2128-06-11")


def test_a_part_that_fails_is_told_in_its_own_words(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("no encoder here")

    monkeypatch.setattr("data_gen.drawing.video.VideoWriter._encode", fail)
    state, found, advice = examined(capsys, code=1)["video"]
    assert (state, "no encoder here" in found, advice) == ("broken", True, "pip install --force-reinstall av")


@pytest.mark.long
def test_without_sumo_only_scenes_cannot_be_generated(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "libsumo", None)
    state, _, advice = examined(capsys)["sumo"]
    assert (state, "all else works" in advice) == ("note", True)


@pytest.mark.long
def test_little_memory_and_a_full_disk_are_noted(
    tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "LEAST_MEMORY_BYTES", 2**60)
    monkeypatch.setattr(doctor, "LEAST_FREE_BYTES", 2**60)
    found = examined(capsys, str(tmp_path / "a.db"))
    assert [found[name][0] for name in ("machine", "disk")] == ["note", "note"]
