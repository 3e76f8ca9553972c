"""Wilson's interval."""

import math

import pytest

from service.questions.scoring.proportions import wilson_interval


@pytest.mark.parametrize(("successes", "trials"), [(0, 5), (5, 5), (3, 7), (97, 100), (1, 1)])
def test_interval_agrees_with_scipy(successes: int, trials: int) -> None:
    from scipy.stats import binomtest  # here, as it takes half a second that who only collects tests need not wait

    theirs = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    low, high = wilson_interval(successes, trials)
    assert math.isclose(low, theirs.low, abs_tol=1e-9)
    assert math.isclose(high, theirs.high, abs_tol=1e-9)
