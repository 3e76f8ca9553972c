"""The page on monitors is run as it stands; its monitors and those of the examples can be used."""

import doctest
import re
from pathlib import Path

import pytest

from chronicles.chronicle_set import load_texts
from chronicles.library import load_library
from dyknow.mtl.parser import parse_monitors
from service.cli.app import run
from service.questions.events.queries import EventFilter
from service.texts.chronicle_files import with_relations
from service.texts.monitor_files import load_monitor_files
from service.texts.monitored_features import CAR_FEATURES
from tests.conftest import Demo
from tests.service.logs import read_all
from tests.service.runs.graph.test_stream_processes import run_race

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "monitors.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_examples_of_the_page_run() -> None:
    failed, attempted = doctest.testfile(str(PAGE), module_relative=False)
    assert attempted > 8
    assert failed == 0


def test_the_monitors_and_the_chronicle_of_the_page_go_together(tmp_path: Path) -> None:
    [monitors, _], [chronicle, *_] = blocks("mtl"), blocks("text")
    (tmp_path / "page.monitors").write_text(monitors)
    loaded = load_monitor_files([tmp_path / "page.monitors"])
    chronicles = load_texts(with_relations([("page", chronicle)]))
    loaded.check_names(chronicles)
    assert "within_limit_violated" in chronicles.plan("races_past").consumes


@pytest.mark.long
def test_what_the_chronicle_of_the_page_finds_is_logged_whichever_event_came_first(tmp_path: Path) -> None:
    [monitors, _], [chronicle, *_] = blocks("mtl"), blocks("text")
    url = run_race(tmp_path, monitors.replace("80 km/h", "54 km/h"), chronicle)
    events = read_all(url, EventFilter(types=("races_past",)))
    points = [{one.label: one.t_us for one in event.sub_events} for event in events]
    # The violation (t1) of the fast car comes after it drew level (t2).
    assert any(one["t2"] < one["t1"] for one in points)
    assert [(one.start_us, one.end_us) for one in events] == [(min(one.values()), max(one.values())) for one in points]


@pytest.mark.long
def test_the_page_shows_what_the_monitors_of_chronicles_tell_of_the_demo(
    demo: Demo, capsys: pytest.CaptureFixture[str]
) -> None:
    [_, monitors], [_, table, _] = blocks("mtl"), blocks("text")
    example = ROOT / "examples" / "after_overtaking.monitors"
    assert parse_monitors(example.read_text()) == parse_monitors(monitors)
    assert run(["monitor", str(demo.log), str(example)]) == 0
    assert capsys.readouterr().out.splitlines()[: table.count("\n")] == table.splitlines()
    text = PAGE.read_text(encoding="utf-8")
    for one in read_all(f"sqlite:///{demo.log}", EventFilter(types=("overtake",), actors=("car3",))):
        assert f"at {one.end_us / 1e6:.3f} s" in text


def test_the_page_lists_every_feature() -> None:
    rows = re.findall(r"^\| (`.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(re.findall(r"`(\w+)\[\?c\]`", "".join(rows))) >= CAR_FEATURES.keys()


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.monitors")), ids=lambda path: path.name)
def test_the_examples_can_be_loaded(path: Path) -> None:
    assert load_monitor_files([path], load_library().given).definitions
