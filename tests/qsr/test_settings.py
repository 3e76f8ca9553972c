"""Every number of the relations matters: twice or half of it changes some relation of a small scene."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
import pytest

from qsr.changes.crossings import RelationChange
from qsr.errors import QsrError
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from tests.qsr.support import footprints, random_traffic
from tests.turned import unnoticed, without_scene

PERIOD_US = 100_000


def traffic() -> Iterator[Footprints]:
    """Drive cars on a bent road and across the open ground."""
    yield from random_traffic(np.random.default_rng(4), frames=60, count=14)


def hairpin() -> Iterator[Footprints]:
    """Let a car stand while another one drives by on the same road, 80 m or so further along it."""
    for number in range(30):
        frame = footprints(number * PERIOD_US, ("a", "b"), [[0.0, 0.0], [number - 15.0, 8.0]], straight_road=True)
        yield frame.having(along_m=frame.along_m + np.array([0.0, 80.0]), across_m=np.zeros(2))


def nearing(*, speed_mps: float, noise_m: float = 0.0) -> Iterator[Footprints]:
    """Let a car drive on towards one that stands, touch it after 6 s, and drive through it for 2 s."""
    rng = np.random.default_rng(0)
    for number in range(80):
        x_m = 56.0 + speed_mps * (number - 60) * 0.1 + float(rng.normal(0, noise_m))
        speeds_mps = [speed_mps, 0.0]
        yield footprints(
            number * PERIOD_US, ("a", "b"), [[x_m, 0.0], [60.0, 0.0]], speed_mps=speeds_mps, straight_road=True
        )


def wide() -> Iterator[Footprints]:
    """Let a car pass one that stands 3.5 m aside; both seem to be 4 m wide."""
    for frame in nearing(speed_mps=15.0):
        yield frame.having(across_m=np.array([0.0, 3.5]), width_m=np.full(2, 4.0))


def doubled() -> Iterator[Footprints]:
    """Let a tracker that says how sure it is see a car drive through another one: the two are one vehicle."""
    for frame in nearing(speed_mps=15.0):
        yield frame.having(sigma_m=np.full(2, 0.1))


def known_roughly() -> Iterator[Footprints]:
    """Let a tracker that says how unsure it is see a car drive slowly towards one that stands."""
    for frame in nearing(speed_mps=5.0):
        yield frame.having(sigma_m=np.full(2, 0.3))


def aside() -> Iterator[Footprints]:
    """Let a car drive 70 m behind another one at 30 m/s, and go off to the side."""
    for number in range(40):
        at_m = [[3.0 * number, -0.3 * number], [3.0 * number + 70.0, 0.0]]
        yield footprints(number * PERIOD_US, ("a", "b"), at_m, speed_mps=30.0, straight_road=True)


def facing() -> Iterator[Footprints]:
    """Let two cars meet, from 200 m apart to 200 m apart; how far apart is seen with much noise."""
    rng = np.random.default_rng(0)
    for number in range(100):
        at_m = [[2.0 * number, -1.75], [200.0 - 2.0 * number + float(rng.normal(0, 7)), 1.75]]
        yield footprints(
            number * PERIOD_US, ("a", "b"), at_m, heading_rad=[0.0, math.pi], speed_mps=20.0, straight_road=True
        )


SCENES: Mapping[str, Sequence[Footprints]] = {
    "hairpin": [*hairpin()],
    "creeping": [*nearing(speed_mps=0.3)],
    "slow contact": [*nearing(speed_mps=1.0)],
    "noisy contact": [*nearing(speed_mps=5.0, noise_m=0.3)],
    "noisy and fast": [*nearing(speed_mps=15.0, noise_m=2.5)],
    "wide": [*wide()],
    "doubled": [*doubled()],
    "known roughly": [*known_roughly()],
    "aside": [*aside()],
    "facing": [*facing()],
    "traffic": [*traffic()],
}
# The numbers that each scene notices; most are noticed in others too.
NOTICED_IN: Mapping[str, Sequence[str]] = {
    "hairpin": ("leave_radius_m", "road_alignment", "far_along"),
    "creeping": ("gap_sigma_m", "sigma_factor", "least_margin_m", "backdate_us"),
    "slow contact": ("conflict_at_once_s",),
    "noisy contact": ("close_m", "close_margin_m", "conflict_braking_margin_mps2"),
    "noisy and fast": (
        *("moving_mps", "moving_margin_mps", "short_headway_s", "short_headway_least_mps", "time_gap_margin_s"),
        *("conflict_ttc_s", "conflict_ttc_margin_s", "conflict_braking_mps2"),
    ),
    "wide": ("enter_radius_m", "enter_line_m", "widest_m"),
    "doubled": ("place_dwell_us", "double_us"),
    "known roughly": ("speed_noise_mps",),
    "aside": ("enter_reach_s", "leave_line_m", "following_s"),
    "facing": ("leave_reach_s", "oncoming_s", "oncoming_margin_s", "oncoming_enter_m", "oncoming_leave_m"),
    "traffic": ("beside_lateral_m", "heading_limit_rad", "direction_margin"),
}

LANES = (("r0 forth", 1), ("r0 back", -1), ("r1 forth", 1), ("r1 back", -1))


def told(scene: str, settings: RelationSettings) -> list[RelationChange]:
    """List all changes of a scene."""
    observer = RelationObserver(("r0", "r1"), ("j",), settings, lanes=LANES)
    return [change for frame in SCENES[scene] for change in observer.observe(frame)]


def test_every_number_has_a_scene() -> None:
    assert without_scene(RelationSettings(), NOTICED_IN.values()) == []


@pytest.mark.slow
def test_twice_or_half_of_every_number_is_noticed() -> None:
    scenes = {partial(told, scene): names for scene, names in NOTICED_IN.items()}
    # What is refused is such as to enter further out than to leave.
    assert unnoticed(RelationSettings(), scenes, refused=QsrError) == []
