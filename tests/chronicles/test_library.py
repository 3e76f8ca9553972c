"""The shipped chronicles on small streams of relations."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from chronicles import library
from chronicles.chronicle_set import load_texts
from chronicles.errors import ChronicleError
from chronicles.examples import ExampleResult, render, run_examples
from tests.cases import for_each
from tests.chronicles.support import run, shown

START = """
0s on[a, e4] unknown -> true
0s on[b, e4] unknown -> true
0s moving[a] unknown -> true
0s moving[b] unknown -> true
1s behind[a, b] unknown -> true
1s beside[a, b] unknown -> false
1s ahead[a, b] unknown -> false
"""
BESIDE = "5s behind[a, b] true -> false\n5s beside[a, b] false -> true\n"
AHEAD = "8s beside[a, b] true -> false\n8s ahead[a, b] false -> true\n"
BACK = "8s beside[a, b] true -> false\n8s behind[a, b] false -> true\n"
END = "until 60s"


def found(stream: str, *names: str) -> list[str]:
    return shown(run(library.load_library(names or None), stream))


def test_overtake_is_behind_beside_ahead() -> None:
    stream = START + BESIDE + AHEAD + END
    assert found(stream, "overtake") == ["overtake[overtaker=a, overtaken=b, road=e4] 5s..8s"]
    assert found(stream, "pass") == ["pass[passer=a, passed=b] 5s..8s"]
    assert found(stream, "aborted_overtake") == []


def test_overtake_is_found_when_a_car_leaves_the_view_right_afterwards() -> None:
    lost = "8.2s ahead[a, b] true -> unknown\n8.2s on[a, e4] true -> unknown\n8.2s moving[a] true -> unknown\n"
    assert len(found(START + BESIDE + AHEAD + lost + END, "overtake")) == 1


def test_falling_back_is_an_aborted_overtake() -> None:
    stream = START + BESIDE + BACK + END
    assert found(stream) == ["aborted_overtake[overtaker=a, overtaken=b, road=e4] 5s..8s"]


def test_overtake_after_an_attempt_counts_once() -> None:
    again = "12s behind[a, b] true -> false\n12s beside[a, b] false -> true\n"
    then = AHEAD.replace("8s", "15s")
    assert found(START + BESIDE + BACK + again + then + END, "overtake", "aborted_overtake") == [
        "aborted_overtake[overtaker=a, overtaken=b, road=e4] 5s..8s",
        "overtake[overtaker=a, overtaken=b, road=e4] 12s..15s",
    ]


@pytest.mark.parametrize(
    "change",
    [
        "0.5s on[b, e4] true -> false",
        "0.5s moving[b] true -> false",
        "6s moving[a] true -> false",
        "6s on[a, e4] true -> false",
        "4.7s behind[a, b] true -> false",
        "6s beside[a, b] true -> unknown\n6.1s beside[a, b] unknown -> true",
    ],
)
def test_overtake_needs_all_its_conditions(change: str) -> None:
    lines = [line for line in (START + BESIDE + AHEAD + change).splitlines() if line]
    in_order = sorted(lines, key=lambda line: float(line.split("s ")[0]))
    assert found("\n".join([*in_order, END]), "overtake") == []


def test_meeting_an_oncoming_car_is_nothing() -> None:
    oncoming = START.replace("behind[a, b] unknown -> true", "behind[a, b] unknown -> false")
    assert found(oncoming + END) == []


def test_standing_car_is_passed_and_not_overtaken() -> None:
    standing = START.replace("moving[b] unknown -> true", "moving[b] unknown -> false")
    assert found(standing + BESIDE + AHEAD + END) == ["pass[passer=a, passed=b] 5s..8s"]


def test_crossing_is_entering_and_leaving_a_junction() -> None:
    stream = "1s in_crossing[a, j1] unknown -> false\n5s in_crossing[a, j1] false -> true\n"
    leaving = "9s in_crossing[a, j1] true -> false\n"
    assert found(stream + leaving + END) == ["crossing[car=a, junction=j1] 5s..9s"]
    assert found(stream + leaving.replace("false", "unknown") + END) == []


def test_library_loads_without_findings() -> None:
    assert library.load_library().warnings == ()


@pytest.fixture(scope="module")
def examples() -> Sequence[ExampleResult]:
    return run_examples(library.texts())


def test_examples_in_the_library_pass(examples: Sequence[ExampleResult]) -> None:
    assert len(examples) > 40
    assert all(one.passed for one in examples), "\n".join(render(one) for one in examples if not one.passed)


@for_each("name", library.names())
def test_file_has_an_example_that_is_found_and_one_that_is_not(name: str, examples: Sequence[ExampleResult]) -> None:
    own = [one for one in examples if one.file == f"{name}.chronicle"]
    assert any(one.matched for one in own)
    assert any(not one.matched for one in own)


ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.chronicle")), ids=lambda path: path.stem)
def test_example_files_for_users_pass_their_examples(path: Path) -> None:
    results = run_examples([("relations", library.relations_text()), (path.name, path.read_text(encoding="utf-8"))])
    assert len(results) >= 2
    assert all(one.passed for one in results), "\n".join(map(render, results))


def test_documentation_lists_every_event_with_its_roles() -> None:
    rows = [line for line in (ROOT / "docs" / "library.md").read_text(encoding="utf-8").splitlines() if "|" in line]
    for plan in library.load_library().plans:
        event = plan.emissions[0].name
        [row] = [row.split("|") for row in rows if f"`{event}`" in row.split("|")[1] and row.count("|") == 6]
        roles = row[3].split("(")[0].replace(" ", "").split(",")
        assert roles == [role for role, _ in plan.roles]


@for_each("name", library.names())
def test_every_chronicle_of_a_file_emits_the_event_of_its_name(name: str) -> None:
    chronicles = library.load_library([name])
    own = [plan for plan in chronicles.plans if plan.name.startswith(name)]
    assert own
    assert all(emission.name == name for plan in own for emission in plan.emissions)


@for_each("name", library.names())
def test_head_of_a_file_says_what_it_means_and_its_limits(name: str) -> None:
    head = library.text(name).split("\nmessage")[0]
    assert all(line.startswith("#") for line in head.strip().splitlines())
    assert "Limits:" in head


def test_library_runs_alone_by_name_with_what_it_builds_on() -> None:
    assert set(library.load_library(["reckless_overtake"]).names) == {
        "overtake",
        "reckless_overtake_before_oncoming",
        "reckless_overtake_in_junction",
    }


def test_unknown_name_is_refused() -> None:
    with pytest.raises(ChronicleError, match=r"expected one of .*'overtake'.*, got 'overtaek'"):
        library.load_library(["overtaek"])


def test_own_text_may_use_and_repeat_the_declarations_of_the_library() -> None:
    own = "domain Car = symbol chronicle double[?a](t1, t2) { event(overtake[?a, ?b, ?r], t1) "
    own += "event(overtake[?a, ?c, ?r], t2) t2 - t1 in ]0s, 30s] }"
    assert "double" in load_texts([*library.texts(["overtake"]), ("own", own)]).names
