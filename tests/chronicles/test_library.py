"""The shipped chronicles on small streams of relations."""

import pytest

from chronicles import library
from chronicles.chronicle_set import load_texts
from chronicles.errors import ChronicleError
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


def test_unknown_name_is_refused() -> None:
    with pytest.raises(ChronicleError, match=r"expected one of .*'overtake'.*, got 'overtaek'"):
        library.load_library(["overtaek"])


def test_own_text_may_use_and_repeat_the_declarations_of_the_library() -> None:
    own = "domain Car = symbol chronicle double[?a](t1, t2) { event(overtake[?a, ?b, ?r], t1) "
    own += "event(overtake[?a, ?c, ?r], t2) t2 - t1 in ]0s, 30s] }"
    assert "double" in load_texts([*library.texts(["overtake"]), ("own", own)]).names
