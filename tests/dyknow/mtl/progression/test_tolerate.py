"""A sensor that errs now and then sets off no alarm, and one that has failed still does."""

import numpy as np
import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.states import DictState, Verdict

STEP_US = 100_000


def first_alarm(text: str, readings: list[bool]) -> int | None:
    """Give the number of the reading at which the formula is violated."""
    progressor = Progressor(parse_formula(text))
    for k, value in enumerate(readings):
        if progressor.progress(k * STEP_US, DictState({"p": value})) is Verdict.FALSE:
            return k
    return None


def test_a_short_error_is_tolerated() -> None:
    readings = [True] * 10 + [False] + [True] * 10
    assert first_alarm("always p", readings) == 10
    assert first_alarm("always tolerate(p, 300ms, 200ms)", readings) is None


@pytest.mark.parametrize(("return_ms", "late_by"), [(0, 0), (300, 3), (1000, 10)])
def test_a_lasting_failure_is_found_when_the_return_is_overdue(return_ms: int, late_by: int) -> None:
    readings = [True] * 10 + [False] * 30
    assert first_alarm(f"always tolerate(p, {return_ms}ms, 200ms)", readings) == 10 + late_by


def test_a_return_that_does_not_stay_is_no_return() -> None:
    readings = [True] * 10 + [False, False, True, True, False, False] + [False] * 10
    assert first_alarm("always tolerate(p, 300ms, 100ms)", readings) == 10 + 2 + 2 + 3
    assert first_alarm("always tolerate(p, 300ms, 200ms)", readings) == 10 + 4


def test_tolerance_takes_away_most_false_alarms() -> None:
    rng = np.random.default_rng(4)
    plain = tolerant = 0
    for _ in range(40):
        readings = (rng.random(600) >= 0.05).tolist()
        plain += first_alarm("always p", readings) is not None
        tolerant += first_alarm("always tolerate(p, 1s, 200ms)", readings) is not None
    assert plain == 40
    assert tolerant <= 2
