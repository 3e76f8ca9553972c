"""A text of one's own may build on what the library finds, without declaring it."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from service.texts.chronicle_files import check_chronicles, load_chronicle_files
from service.texts.text_streams import stream_of
from tests.conftest import Demo

TWICE = """chronicle twice[?a](t1, t2) {
  event(overtake[?a, ?b, ?], t1)
  event(overtake[?a, ?c, ?], t2)
  t2 - t1 in [1us, 30s]
}"""


def test_what_a_text_uses_of_the_library_is_loaded_with_it(tmp_path: Path) -> None:
    (tmp_path / "twice.chronicle").write_text(TWICE)
    loaded = load_chronicle_files([tmp_path / "twice.chronicle"])
    assert loaded.merged.names == ("overtake", "twice")
    assert [one.name for one in loaded.texts] == ["relations.chronicle", "overtake.chronicle", "twice.chronicle"]
    assert loaded.doubts == ()
    reckless = TWICE.replace("overtake[?a, ?b, ?]", "reckless_overtake[?a, ?b, ?]")
    (tmp_path / "more.chronicle").write_text(reckless)
    assert {"overtake", "reckless_overtake_before_oncoming"} < set(
        load_chronicle_files([tmp_path / "more.chronicle"]).merged.names
    )


def test_an_event_of_the_library_tells_that_a_text_is_about_traffic() -> None:
    assert stream_of([("mine", TWICE)]) == "traffic"
    assert check_chronicles([("mine", TWICE)]).findings == ()
    own = f"message overtake[?a, ?b, ?r]\n{TWICE}"
    assert stream_of([("mine", own)]) == "own"


def test_a_slip_in_a_name_of_the_library_is_told_with_what_was_meant() -> None:
    [finding, _] = check_chronicles([("mine", TWICE.replace("overtake", "overtak"))], "traffic").findings
    assert "did you mean 'overtake'?" in finding.render()


def test_a_text_that_defines_a_chronicle_of_that_name_has_its_own(tmp_path: Path) -> None:
    (tmp_path / "own.chronicle").write_text(
        """message overtake[?a, ?b, ?r]
chronicle overtake[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) when recognised { emit overtake[?a, ?b, x] } }
"""
        + TWICE
    )
    assert load_chronicle_files([tmp_path / "own.chronicle"]).merged.names == ("overtake", "twice")


def test_a_log_is_asked_for_a_chronicle_that_uses_the_library(
    tmp_path: Path, demo: Demo, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "twice.chronicle").write_text(TWICE)
    assert (
        run(["recognise", str(demo.log), "--chronicles", str(tmp_path / "twice.chronicle"), "--format", "jsonl"]) == 0
    )
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {one["chronicle"]["name"] for one in found} == {"overtake", "twice"}
    assert sum(one["chronicle"]["name"] == "twice" for one in found) == 1
