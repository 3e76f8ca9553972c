"""What may be compared with what in a monitor."""

import pytest

from dyknow.monitors.features import features_of
from dyknow.monitors.kinds import Kind, KindError, check_kinds
from dyknow.mtl.parser import parse_monitors

KINDS = {
    "speed": Kind.SPEED,
    "limit": Kind.SPEED,
    "x": Kind.LENGTH,
    "heading": Kind.ANGLE,
    "road": Kind.WORD,
    "moving": Kind.TRUTH,
}


def check(body: str) -> None:
    check_kinds(parse_monitors(f"monitor m per ?a in Car: {body}"), KINDS, name="a.monitors")


@pytest.mark.parametrize(
    "body",
    [
        "moving[?a]",
        "speed[?a] < 30",
        "speed[?a] > 1.2 * limit[?a] + 5 km/h",
        "x[?a] - 3 m >= 2 km",
        "heading[?a] = 90 deg",
        'road[?a] != "main"',
        'exists ?b in Car: (?a != ?b and ?b != "car7")',
        "moving[?a] = moving[car7]",
    ],
)
def test_what_is_of_one_kind_can_be_compared(body: str) -> None:
    check(body)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("always speed[?a]", "expected a truth value in 'speed[?a]', got a speed; compare it"),
        ("speed[?a] < 36 m", "expected values of one kind in 'speed[?a] < 36 m', got a speed and a length"),
        ("moving[?a] = 1", "expected values of one kind in 'moving[?a] = 1', got a truth value and a number"),
        ('road[?a] < "main"', "expected = or != between words in 'road[?a] < \"main\"', got '<'"),
        ("2 * road[?a] = 3", "expected a number in '2 * road[?a]', got a word"),
        ("?a + 3 = 4", "expected numbers in '?a + 3', got an object"),
        ("speed[?a] + 3 + x[?a] > 4", "expected numbers of one kind in 'speed[?a] + 3 + x[?a]', got a speed and a"),
        ("2 * road[?a] + 3 = 4", "expected a number in '2 * road[?a]', got a word"),
    ],
)
def test_what_is_not_is_refused(body: str, message: str) -> None:
    with pytest.raises(KindError) as error:
        check(body)
    assert str(error.value).startswith(f"a.monitors: monitor 'm': {message}")


def test_every_problem_is_told() -> None:
    with pytest.raises(KindError) as error:
        check("always (speed[?a] or eventually[0s, 1s] x[?a] < 3 s)")
    assert len(str(error.value).splitlines()) == 2


def test_features_are_found_in_every_part() -> None:
    text = (
        "monitor m per Car: p[?c] until[0s, 1s] (2 * q[?c] + r[car1] > s[?c] - 3 and forall ?d in Car: not t[?c, ?d])"
    )
    assert features_of(parse_monitors(text)) == {"p", "q", "r", "s", "t"}
