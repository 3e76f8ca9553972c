"""Whatever the scenario: bodies are solid, nobody jumps, and all drive on the road."""

import numpy as np
import pytest
import shapely

from data_gen.scenarios.catalogue import SCENARIOS
from gis.roads.sumo_net import read_sumo_net
from tests.cases import first_kept
from tests.data_gen.scenario_clips import STEP_S, Clip, clip, moving, touching_pairs, tracks

SECONDS = 20
WITH_OPTIONS = [
    *[(name, ()) for name in SCENARIOS],
    ("rural_overtaking", (("aborted", "1"), ("platoons", "1"))),
    ("rural_overtaking", (("blocked", "1"),)),
    ("junction", (("lights", "actuated"), ("demand", "high"))),
]


@pytest.fixture(
    scope="module",
    params=first_kept(WITH_OPTIONS, kept=len(SCENARIOS)),
    ids=lambda case: "-".join((case[0], *(name for name, _ in case[1]))),
)
def played(request: pytest.FixtureRequest) -> Clip:
    name, options = request.param
    return clip(name, dict(options), seconds=SECONDS)


def test_traffic_fills_the_view_from_the_first_step(played: Clip) -> None:
    view = played.scenario.view
    half_m = np.array((view.width_m, view.width_m * 9 / 16)) / 2
    first = played.states[0]
    inside = (np.abs(first.centre_m[moving(first)] - view.centre_m) < half_m).all(axis=1)
    assert inside.sum() >= 2


def test_bodies_do_not_overlap(played: Clip) -> None:
    vehicle_steps = sum(len(moving(step)) for step in played.states)
    # A corner of a turning body may brush another one: one in five hundred at most.
    assert sum(touching_pairs(step) for step in played.states) <= vehicle_steps / 500


def test_nobody_jumps(played: Clip) -> None:
    for track in tracks(played.states).values():
        moved_m = np.diff(track[:, 1:3], axis=0)
        driven_m = track[1:, 4] * STEP_S
        headings = np.column_stack((np.cos(track[:-1, 3]), np.sin(track[:-1, 3])))
        sideways_m = moved_m[:, 0] * headings[:, 1] - moved_m[:, 1] * headings[:, 0]
        assert np.abs(np.hypot(*moved_m.T) - driven_m).max(initial=0) < 0.35
        assert np.abs(sideways_m).max(initial=0) < 0.4


def test_nobody_turns_on_the_spot(played: Clip) -> None:
    for track in tracks(played.states).values():
        turned_rad = np.abs(np.sin(np.diff(track[:, 3])))
        assert np.degrees(turned_rad.max(initial=0)) < 12
        standing = track[1:, 4] < 0.01
        assert turned_rad[standing].max(initial=0) < np.radians(1)


def test_accelerations_are_those_of_vehicles(played: Clip) -> None:
    for track in tracks(played.states).values():
        acceleration_mps2 = np.diff(track[:, 4]) / STEP_S
        assert acceleration_mps2.min(initial=0) > -6.5
        assert acceleration_mps2.max(initial=0) < 4.6


def test_all_drive_on_the_road(played: Clip) -> None:
    road = read_sumo_net(played.scenario.network_file).surface().buffer(0.3)
    centres_m = np.concatenate([step.centre_m[moving(step)] for step in played.states])
    off = ~shapely.intersects_xy(road, centres_m[:, 0], centres_m[:, 1])
    assert off.mean() < 0.001


def test_sizes_are_those_of_the_kinds(played: Clip) -> None:
    flow_kinds = [kind for flow in played.scenario.flows for kind in flow.kinds]
    kinds = [*played.scenario.kinds, *flow_kinds, *(stop.kind for stop in played.scenario.stops)]
    for step in played.states[:: SECONDS * 5]:
        for row in moving(step):
            fitting = [
                kind
                for kind in kinds
                if kind.vehicle_class == step.classes[row]
                and kind.length_m[0] - 0.01 <= step.length_m[row] <= kind.length_m[1] + 0.01
                and kind.width_m[0] - 0.01 <= step.width_m[row] <= kind.width_m[1] + 0.01
            ]
            assert fitting, (step.ids[row], step.classes[row])
