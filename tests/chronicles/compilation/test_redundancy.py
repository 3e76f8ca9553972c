"""Implied constraints against trying out: one is told exactly if the minimal network is the same without it."""

import random

import pytest

from chronicles.chronicle_set import check_texts, load

EVENTS = "event(a[], t1) event(b[], t2) event(c[], t3)"
# Together they bound everything, so each text is accepted without any of the constraints under test.
FRAME = "t2 - t1 in [-20, 20]\nt3 - t2 in [-20, 20]"


def random_constraint(pick: random.Random) -> str:
    later, earlier = pick.sample(("t1", "t2", "t3"), 2)
    low = pick.randint(-6, 4)
    return pick.choice(
        (
            f"{later} - {earlier} in [{low}, {low + pick.randint(0, 12)}]",
            f"{later} >= {earlier} + {abs(low)}",
            f"{later} < {earlier} + {pick.randint(1, 9)}",
        )
    )


def text(constraints: list[str]) -> str:
    return "timeunit 1us\nchronicle c {\n" + EVENTS + "\n" + "\n".join([*FRAME.split("\n"), *constraints]) + "\n}"


def network(constraints: list[str]) -> tuple[tuple[int, ...], ...]:
    return load(text(constraints)).plans[0].distance_us


@pytest.mark.long
@pytest.mark.parametrize("block", range(3))
def test_a_constraint_is_told_exactly_if_the_network_is_the_same_without_it(block: int) -> None:
    told = untold = 0
    for seed in range(100 * block, 100 * block + 100):
        pick = random.Random(seed)
        constraints = [random_constraint(pick) for _ in range(pick.randint(1, 4))]
        found = check_texts([("t", text(constraints))])
        if any(one.severity == "error" for one in found):
            continue
        # The last one is judged first, against all the others.
        last_line = 5 + len(constraints)
        is_told = any(one.code == "C0601" and one.line == last_line for one in found)
        assert is_told == (network(constraints) == network(constraints[:-1])), constraints
        told, untold = told + is_told, untold + (not is_told)
    assert told > 5
    assert untold > 5


def test_order_that_only_a_hold_implies_is_not_told() -> None:
    assert check_texts([("t", f"timeunit 1us chronicle c {{ {EVENTS} {FRAME} hold(p[]:x, (t1, t2)) t1 < t2 }}")]) == ()


def test_two_equal_events_are_not_a_repetition() -> None:
    assert load("chronicle c { event(a[], t1) event(a[], t2) t2 - t1 in [0s, 1s] }").warnings == ()
