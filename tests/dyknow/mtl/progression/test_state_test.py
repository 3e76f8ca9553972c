"""What one state says about a formula without tense."""

import numpy as np
import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.state_test import state_test
from dyknow.mtl.progression.states import DictState, StateError

STATE = DictState(
    {
        "raining": False,
        "limit": 13.9,
        ("speed", ("a",)): 20.0,
        ("speed", ("b",)): np.float64(10.0),
        ("road", ("a",)): "main",
        ("behind", ("a", "b")): True,
        ("age", ("a",)): 2_500_000,
    },
    {"Car": ["a", "b"]},
)


def answer(text: str) -> bool | None:
    return state_test(parse_formula(text))(STATE, ())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("speed[a] > 70 km/h", True),
        ("speed[a] <= 20", True),
        ("speed[b] < 10", False),
        ("speed[a] > 1.4 * limit", True),
        ("speed[a] - speed[b] = 10 m/s", True),
        ("speed[a] > limit + 30 km/h", False),
        ("age[a] >= 2.5s", True),
        ("road[a] = \"main\" and road[a] != 'x'".replace("'x'", '"x"'), True),
        ("behind[a, b] and not raining", True),
        ("speed[c] > 3", None),
        ("speed[c] + 1 > 3", None),
        ("unheard", None),
        ("raining and unheard", False),
        ("unheard or not raining", True),
        ("unheard and not raining", None),
        ("unheard implies raining", None),
        ("raining implies unheard", True),
        ("raining iff unheard", None),
        ("raining iff speed[a] < 3", True),
        ("forall ?c in Car: speed[?c] > 5", True),
        ("forall ?c in Car: speed[?c] > 15", False),
        ('exists ?c in Car: road[?c] = "main"', True),
        ('exists ?c in Car: road[?c] = "side"', None),
        ("forall ?c in Truck: false", True),
        ("exists ?c in Truck: true", False),
        ("exists ?x in Car, ?y in Car: ?x != ?y and behind[?x, ?y]", True),
        ('exists ?x in Car: ?x = "b" and speed[?x] < 15', True),
    ],
)
def test_answer(text: str, expected: bool | None) -> None:
    assert answer(text) is expected


def test_a_value_that_stands_alone_must_be_a_truth_value() -> None:
    with pytest.raises(
        StateError, match=r"'speed\[a\]', which is not compared: expected True, False or None, got 20.0"
    ):
        answer("speed[a]")
    with pytest.raises(StateError, match=r"expected True, False or None, got 13\.9"):
        answer("limit")


@pytest.mark.parametrize("text", ["road[a] < 3", "road[a] + 1 = 3", "2 * limit > road[a]"])
def test_values_that_cannot_be_compared_are_refused(text: str) -> None:
    with pytest.raises(StateError, match=f"formula '{text[:4]}.*expected values that can be compared, got "):
        answer(text)
