"""The rural scenario holds what it is made for: many overtakes, driven as people might."""

import numpy as np
import pytest

from data_gen.drawing.view import camera_over
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.simulate import simulate
from data_gen.truth.event import TruthEvent
from data_gen.truth.events import find_events
from data_gen.truth.motion import tabulate
from gis.roads.sumo_net import read_sumo_net
from tests.data_gen.truth_support import centres_in_view

pytestmark = pytest.mark.long

SCENARIO = scenario_named("rural_overtaking")


def countable_overtakes(seed: int, *, seconds: int) -> list[TruthEvent]:
    rng = np.random.default_rng(np.random.SeedSequence(seed)).spawn(2)[0]
    states = simulate(SCENARIO, seed=seed, rng=rng, duration_us=seconds * 1_000_000, step_us=40_000)
    motion = tabulate(states, read_sumo_net(SCENARIO.network_file))
    view = camera_over(SCENARIO.view, (1280, 720))
    events = find_events(motion, centres_in_view(motion, states, view))
    return [event for event in events if event.countable and event.type == "overtake"]


def test_the_demo_minute_holds_several_overtakes() -> None:
    overtakes = countable_overtakes(3, seconds=60)
    assert len(overtakes) >= 3
    assert all(0 < event.end_us - event.start_us < 10_000_000 for event in overtakes)


@pytest.mark.slow
def test_five_seeds_of_four_minutes_hold_sixty_overtakes() -> None:
    counts = [len(countable_overtakes(seed, seconds=240)) for seed in range(1, 6)]
    assert min(counts) >= 5
    assert sum(counts) >= 60
