"""How far off are the time to contact and the braking, if places and speeds are? The formula beside many tries."""

import numpy as np
import pytest

from qsr.measuring.conflicts import conflict_noise
from qsr.observer import RelationObserver
from qsr.relations import Switch
from qsr.settings import RelationSettings
from tests.qsr.support import footprints

SETTINGS = RelationSettings()


@pytest.mark.parametrize(("apart_m", "closing_mps"), [(20.0, 15.0), (10.0, 10.0), (6.0, 12.0), (40.0, 30.0)])
@pytest.mark.parametrize("sigma_m", [(0.1, 0.1), (0.3, 0.6)])
def test_noise_is_that_of_many_tries(apart_m: float, closing_mps: float, sigma_m: tuple[float, float]) -> None:
    rng, sigmas, count = np.random.default_rng(0), np.array(sigma_m), 20_000
    speeds = SETTINGS.speed_noise_mps * sigmas ** (1 / 3)
    distance_m = apart_m + (rng.normal(size=(count, 2)) * sigmas).sum(axis=1)
    closing = closing_mps + (rng.normal(size=(count, 2)) * speeds).sum(axis=1)
    values = np.zeros(len(Switch))
    values[Switch.SHORT_TTC] = SETTINGS.conflict_ttc_s - apart_m / closing_mps
    values[Switch.HARD_BRAKING] = closing_mps**2 / (2 * apart_m) - SETTINGS.conflict_braking_mps2
    ttc_s, braking_mps2 = conflict_noise(values, sigmas, SETTINGS)
    assert ttc_s == pytest.approx(np.std(distance_m / closing), rel=0.15)
    assert braking_mps2 == pytest.approx(np.std(closing**2 / (2 * distance_m)), rel=0.15)


@pytest.mark.long
@pytest.mark.parametrize(("closing_mps", "sure"), [(1.5, (0.5, 0.7)), (20.0, (0.95, 1.0))], ids=["slow", "fast"])
def test_what_closes_no_faster_than_speeds_are_known_is_an_unsure_conflict(
    closing_mps: float, sure: tuple[float, float]
) -> None:
    frames = [
        footprints(k * 40_000, "ab", [[k * 0.04 * closing_mps, 0.0], [60.0, 0.0]], speed_mps=[closing_mps, 0.0])
        for k in range(int((60.0 - 4.0) / 0.04 / closing_mps))
    ]
    observer = RelationObserver((), ())
    told = [change for one in frames for change in observer.observe(one.having(sigma_m=np.full(2, 0.3)))]
    (conflict,) = [one for one in told if one.name == "conflict" and one.new]
    assert sure[0] <= conflict.confidence <= sure[1]
