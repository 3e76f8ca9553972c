"""Every command shows a line to copy in its help, and gives its result as JSON to who asks."""

import json
import shlex
from pathlib import Path

import pytest

from service.cli.app import COMMANDS, run
from service.records.events import EventRecord
from tests.docs.commands import all_commands
from tests.service.logs import read_all, write_small_log
from tests.service.tracks import write_tracks

CHRONICLE = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }\n"


@pytest.mark.parametrize("name", list(COMMANDS))
def test_help_shows_an_example_that_is_a_command_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*name.split(), "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    example = COMMANDS[name][1]
    assert f"Example: dyknow {name} {example}".rstrip() in shown
    arguments = shlex.split(example)
    with all_commands()[name].make_context(name, arguments) as context:
        assert context.params


def test_every_command_with_a_result_takes_json() -> None:
    without = {name for name, one in all_commands().items() if not any("--json" in param.opts for param in one.params)}
    assert without == {"serve", "watch", "worker"}


def printed(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, object]:
    assert run([*map(str, arguments), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert isinstance(record, dict)
    return record


def test_what_a_log_holds_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    events = printed(capsys, "events", url, "--limit", 1)["items"]
    assert isinstance(events, list)
    assert [one["id"] for one in events] == [read_all(url)[0].id]
    assert set(events[0]) == set(EventRecord.__struct_fields__)
    tracks = printed(capsys, "tracks", url, "--car", "car7")
    assert tracks["run"] == "r1"
    assert isinstance(tracks["states"], list)
    assert [one["t_us"] for one in tracks["states"]] == [0, 40_000, 80_000]


def test_texts_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "near.chronicle"
    path.write_text(CHRONICLE)
    assert printed(capsys, "check", path) == {"stream": "traffic", "findings": [], "costs": []}
    assert len(str(printed(capsys, "check", path, "--cost")["costs"])) > len("[]")
    assert printed(capsys, "check", "--explain", "C0201")["code"] == "C0201"
    assert printed(capsys, "format", path) == {"changed": [str(path)], "broken": [], "is_written": True}
    assert printed(capsys, "format", path)["changed"] == []


def test_recognised_occurrences_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chronicle, events = tmp_path / "near.chronicle", tmp_path / "e.csv"
    chronicle.write_text(CHRONICLE)
    events.write_text("t_s,name,arg1,arg2,old,new\n1,close,a,b,false,true\n")
    found = printed(capsys, "recognise", events, "--chronicles", chronicle)
    assert (found["stream"], found["late_count"]) == ("traffic", 0)
    assert isinstance(found["items"], list)
    assert [one["roles"] for one in found["items"]] == [{"a": "a", "b": "b"}]


def test_what_is_made_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene").mkdir()
    write_tracks(tmp_path / "t.csv", frames=3)
    made = printed(capsys, "trajectories", "junction", "--out", tmp_path / "scene" / "t.csv", "--seconds", 2)
    assert made["out"] == str(tmp_path / "scene" / "t.csv")
    assert {"rows", "vehicles", "tracks", "gaps", "swaps", "site"} < set(made)
    assert run(["process", str(tmp_path / "t.csv"), "--log", str(tmp_path / "a.db"), "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["type"] == "summary"
