"""Files of events: read as written, refused with the line of the first fault."""

import random
from pathlib import Path

import msgspec
import pytest

from chronicles.events import Event
from service.errors import InputError
from service.questions.recognition.event_files import load_events


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_jsonl_has_changes_and_messages_in_both_units(tmp_path: Path) -> None:
    text = (
        '{"t_us": 1500000, "name": "behind", "args": ["a", "b"], "old": true, "new": false}\n'
        '\n{"t_s": 2.5, "name": "honk", "args": ["a"]}\n'
        '{"t_s": 3, "name": "turn", "args": ["x", "j", "y"], "old": null, "new": "left"}\n'
        '{"t_us": 4, "name": "night", "new": "true"}\n'
    )
    assert load_events(written(tmp_path, "e.jsonl", text)) == [
        Event("behind", ("a", "b"), 1_500_000, "true", "false"),
        Event("honk", ("a",), 2_500_000),
        Event("turn", ("x", "j", "y"), 3_000_000, "unknown", "left"),
        Event("night", (), 4, "unknown", "true"),
    ]


def test_csv_has_a_column_for_each_argument(tmp_path: Path) -> None:
    text = "t_s,name,arg1,arg2,old,new\n1.5,behind,a,b,true,false\n2.5,honk,a,,,\n3,close,a,b,,true\n"
    assert load_events(written(tmp_path, "e.csv", text)) == [
        Event("behind", ("a", "b"), 1_500_000, "true", "false"),
        Event("honk", ("a",), 2_500_000),
        Event("close", ("a", "b"), 3_000_000, "unknown", "true"),
    ]


def test_both_forms_give_the_same_events(tmp_path: Path) -> None:
    rng = random.Random(5)
    events = [
        Event(rng.choice("pq"), tuple(rng.sample("abc", rng.randint(0, 3))), rng.randrange(10**9), *change)
        for change in rng.choices([(None, None), ("true", "false"), ("unknown", "left")], k=50)
    ]
    lines = [
        msgspec.json.encode(
            {"t_us": one.t_us, "name": one.name, "args": one.args}
            | ({} if one.new is None else {"old": one.old, "new": one.new})
        ).decode()
        for one in events
    ]
    rows = [
        ",".join([str(one.t_us), one.name, *one.args, *[""] * (3 - len(one.args)), one.old or "", one.new or ""])
        for one in events
    ]
    table = "\n".join(["t_us,name,arg1,arg2,arg3,old,new", *rows])
    assert load_events(written(tmp_path, "e.jsonl", "\n".join(lines))) == events
    assert load_events(written(tmp_path, "e.csv", table)) == events


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("e.txt", "", "expected a file of events, .jsonl or .csv, got suffix '.txt'"),
        ("e.jsonl", '{"t_us": 0, "name": "p"}\nnonsense', r"e\.jsonl:2: expected an event as one JSON object"),
        ("e.jsonl", '{"t_us": 0, "nam": "p"}', r"e\.jsonl:1: .*nam"),
        ("e.jsonl", '{"name": "p"}', r"e\.jsonl:1: expected either t_us or t_s, got neither"),
        ("e.jsonl", '{"t_us": 1, "t_s": 1, "name": "p"}', "got t_us and t_s"),
        ("e.jsonl", '{"t_us": -1, "name": "p"}', r"e\.jsonl:1: t_us: expected 0 to 1000000000000000, got -1"),
        ("e.jsonl", '{"t_us": 0, "name": "p", "old": "true"}', "expected 'new' beside 'old', got 'old' alone"),
        ("e.jsonl", '{"t_us": 0, "name": ""}', "expected a name and arguments that are not empty"),
        ("e.jsonl", "[" * 100_000, r"e\.jsonl:1: expected an event"),
        ("e.csv", "", r"e\.csv:1: expected columns t_us or t_s, name, .* got an empty file"),
        ("e.csv", "t_us,arg1\n", r"e\.csv:1: expected columns"),
        ("e.csv", "t_us,name,colour\n", "got t_us, name, colour"),
        ("e.csv", "t_us,name,old,new\n0,p,,\n1,p\n", r"e\.csv:3: expected 4 fields, got 2"),
        ("e.csv", "t_us,name\n1.5,p\n", r"e\.csv:2: column t_us: expected a whole number, got '1.5'"),
        ("e.csv", "t_s,name\ninf,p\n", r"e\.csv:2: column t_s: expected a number, got 'inf'"),
        ("e.csv", "t_s,name\n1e10,p\n", r"e\.csv:2: t_s: expected 0 to 1000000000, got 10000000000.0"),
        ("e.csv", "t_us,name\n1_000,p\n", r"e\.csv:2: column t_us: expected a whole number, got '1_000'"),
        ("e.csv", "t_s,name\n1_0.5,p\n", r"e\.csv:2: column t_s: expected a number, got '1_0.5'"),
        ("e.csv", "t_us,name,arg2\n1,p,b\n", r"e\.csv:1: expected arg1, arg2, \.\.\. without a gap, got arg2"),
        ("e.csv", "t_us,name,arg1,arg3\n1,p,b,c\n", r"e\.csv:1: expected arg1, .* got arg1, arg3"),
        ("e.csv", 't_us,name\n1,p\n2,"p\n3,p\n4,p\n', r"e\.csv:3: expected a row of a CSV file, got unexpected end"),
        ("e.csv", 't_us,name\n1,p\n2,"p"q\n', r"e\.csv:3: expected a row of a CSV file, got"),
        ("e.csv", "t_s,name,arg1,arg2\n1,p,,b\n", r"e\.csv:2: expected a name and arguments that are not empty"),
    ],
)
def test_a_fault_is_named_with_its_place(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_events(written(tmp_path, name, text))


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"e\.csv: expected UTF-8 text, got byte 0xff"):
        load_events(tmp_path / "e.csv")
    with pytest.raises(InputError, match=r"none\.csv: expected a readable file of events, got No such file"):
        load_events(tmp_path / "none.csv")
