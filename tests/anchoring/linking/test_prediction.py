"""Bodies that nobody sees, predicted along roads."""

import numpy as np
import pytest

from anchoring.linking.bodies import ACROSS, ALONG, HEADING, TANGENT, VX, VY, X, Y
from anchoring.linking.frame import predict
from gis.polyline import ReferenceLines
from tests.anchoring.support import BEND_RADIUS_M, bend


def test_points_at_road_coordinates_are_where_the_network_located_them() -> None:
    network = bend()
    rng = np.random.default_rng(0)
    angle, radius_m = rng.uniform(0.1, 3.0, 50), BEND_RADIUS_M + rng.uniform(-3, 3, 50)
    points_m = np.stack([radius_m * np.sin(angle), BEND_RADIUS_M - radius_m * np.cos(angle)], axis=1)
    at = network.locate(points_m)
    back_m, tangent_rad = network.reference_lines.points(at.road, at.along_m, at.across_m)
    assert np.hypot(*(back_m - points_m.T)).max() < 0.1
    assert np.abs(tangent_rad - angle).max() < 0.06


def body(*, heading_rad: float, speed_mps: float, across_mps: float = 0.0) -> np.ndarray:
    state = np.zeros((8, 1))
    state[[X, Y, ALONG, ACROSS, TANGENT], 0] = 5.0, -2.0, 5.0, -2.0, 0.0
    state[[HEADING, VX, VY], 0] = heading_rad, speed_mps * np.cos(heading_rad), across_mps
    return state


ROAD = ReferenceLines([np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]])])


def test_prediction_starts_where_the_body_was() -> None:
    centre_m, turn_rad = predict(
        body(heading_rad=0.0, speed_mps=10.0), np.zeros(1, np.int32), np.zeros(1), ROAD, lateral_s=0.5
    )
    assert centre_m.tolist() == [[5.0], [-2.0]]
    assert turn_rad.tolist() == [0.0]


def test_body_against_the_direction_of_its_road_goes_back_along_it() -> None:
    state = body(heading_rad=np.pi, speed_mps=4.0)
    centre_m, _ = predict(state, np.zeros(1, np.int32), np.ones(1), ROAD, lateral_s=0.5)
    assert centre_m[:, 0] == pytest.approx([1.0, -2.0])


def test_body_turns_with_its_road() -> None:
    state = body(heading_rad=0.0, speed_mps=10.0)
    centre_m, turn_rad = predict(state, np.zeros(1, np.int32), np.full(1, 10.0), ROAD, lateral_s=0.5)
    assert centre_m[:, 0] == pytest.approx([102.0, 5.0])
    assert turn_rad[0] == pytest.approx(np.pi / 2)


def test_change_of_lane_goes_on_for_half_a_second() -> None:
    state = body(heading_rad=0.0, speed_mps=10.0, across_mps=1.0)
    centre_m, _ = predict(state, np.zeros(1, np.int32), np.full(1, 5.0), ROAD, lateral_s=0.5)
    assert centre_m[1, 0] == pytest.approx(-1.5, abs=1e-3)


def test_body_off_the_roads_goes_straight_on() -> None:
    state = body(heading_rad=0.0, speed_mps=10.0)
    centre_m, _ = predict(state, np.full(1, -1, np.int32), np.full(1, 10.0), ROAD, lateral_s=0.5)
    assert centre_m[:, 0] == pytest.approx([105.0, -2.0])
