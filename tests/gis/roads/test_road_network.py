"""Points on roads, against the slow loop over all lanes."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from gis.errors import GisError
from gis.roads.lanes import Junction, Lane
from gis.roads.road_network import RoadNetwork, plain_rings
from gis.roads.sumo_net import read_sumo_net
from tests.gis.support import CROSSING_NET, FloatArray, arc, locate_slowly, straight_lane, two_way_along

TWO_WAY = [straight_lane("we_0", y_m=-1.75, road="we"), straight_lane("ew_0", y_m=1.75, road="we", direction=-1)]
SQUARE = Junction("c", np.array([[100.0, -10.0], [120.0, -10.0], [120.0, 10.0], [100.0, 10.0]]))


def networks() -> dict[str, RoadNetwork]:
    zigzag_m = np.array([[0.0, 0.0], [40.0, 5.0], [60.0, 40.0], [110.0, 30.0], [115.0, -30.0]])
    return {
        "straight": RoadNetwork(TWO_WAY, junctions=[SQUARE]),
        "left bend": two_way_along(arc(radius_m=60.0, turn_rad=2.5, segments=30)),
        "right bend": two_way_along(arc(radius_m=40.0, turn_rad=-2.0, segments=9)),
        "zigzag": two_way_along(zigzag_m),
        "crossing": read_sumo_net(CROSSING_NET),
    }


def points_near(network: RoadNetwork, count: int, seed: int) -> FloatArray:
    """Scatter points so that lane borders, road ends and open ground all get some."""
    rng = np.random.default_rng(seed)
    vertices_m = np.vstack([lane.centre_line_m for lane in network.lanes] + [j.outline_m for j in network.junctions])
    segment_ends_m = vertices_m[rng.integers(0, len(vertices_m) - 1, count)[:, None] + np.array([0, 1])]
    share = rng.uniform(-0.1, 1.1, (count, 1))
    on_line_m = segment_ends_m[:, 0] + share * (segment_ends_m[:, 1] - segment_ends_m[:, 0])
    return np.asarray(on_line_m + rng.normal(0.0, 3.0, (count, 2)))


@pytest.mark.parametrize("tolerance_m", [0.0, 2.0])
@pytest.mark.parametrize("name", networks())
@pytest.mark.parametrize("count", [50, pytest.param(300, marks=pytest.mark.slow)])
def test_locate_agrees_with_the_slow_loop_over_all_lanes(name: str, tolerance_m: float, count: int) -> None:
    network = networks()[name]
    points_m = points_near(network, count, seed=7)
    fast = network.locate(points_m, tolerance_m=tolerance_m)
    slow = np.array([locate_slowly(network, point_m, tolerance_m) for point_m in points_m])
    assert count // 10 < (fast.road >= 0).sum() < count
    for column, values in enumerate(
        [fast.road, fast.along_m, fast.across_m, fast.lane, fast.junction, fast.tangent_rad]
    ):
        np.testing.assert_allclose(np.asarray(values), slow[:, column], atol=1e-9)


def test_along_runs_on_while_a_car_overtakes_in_the_oncoming_lane() -> None:
    network = RoadNetwork(TWO_WAY)
    x_m = np.linspace(1.0, 99.0, 99)
    path_m = np.column_stack((x_m, -1.75 + 3.5 * np.sin(np.linspace(0.0, np.pi, 99)) ** 2))
    at = network.locate(path_m)
    assert set(at.lane.tolist()) == {0, 1}
    assert set(at.road.tolist()) == {0}
    np.testing.assert_allclose(at.along_m, path_m[:, 0])
    np.testing.assert_allclose(at.across_m, path_m[:, 1])


def test_along_grows_evenly_round_a_bend_in_every_lane() -> None:
    reference_m = arc(radius_m=60.0, turn_rad=1.5, segments=15)
    network = two_way_along(reference_m)
    angle = np.linspace(0.15, 1.35, 400)  # the strips at both ends have one square end
    for across_m in (-5.25, -1.75, 1.75):
        radius_m = 60.0 - across_m
        at = network.locate(np.column_stack((radius_m * np.sin(angle), 60.0 - radius_m * np.cos(angle))))
        # The car drives on the circle, the road is a chain of chords: a step differs by less than one per cent.
        np.testing.assert_allclose(np.diff(at.along_m), 60.0 * (angle[1] - angle[0]), rtol=0.01)
        np.testing.assert_allclose(at.across_m, across_m, atol=0.1)


def test_a_lane_centre_line_keeps_its_distance_from_the_reference_line_round_sharp_corners() -> None:
    network = two_way_along(np.array([[0.0, 0.0], [50.0, 0.0], [50.0, 50.0], [90.0, 60.0]]))
    on_centre_m = shapely.line_interpolate_point(
        shapely.LineString(network.lanes[0].centre_line_m), np.linspace(1.0, 130.0, 200)
    )
    at = network.locate(shapely.get_coordinates(on_centre_m))
    np.testing.assert_allclose(at.across_m, -5.25, atol=1e-9)
    assert (np.diff(at.along_m) > 0).all()


def test_a_point_off_every_area_has_no_coordinates() -> None:
    at = RoadNetwork(TWO_WAY).locate([[50.0, 20.0]])
    assert (at.road[0], at.lane[0], at.junction[0]) == (-1, -1, -1)
    assert np.isnan([at.along_m[0], at.across_m[0], at.tangent_rad[0]]).all()


def test_a_point_that_is_not_finite_is_off_road_and_leaves_the_others_alone() -> None:
    at = RoadNetwork(TWO_WAY).locate([[np.nan, 0.0], [10.0, -1.0], [np.inf, 1.0]], tolerance_m=5.0)
    assert at.road.tolist() == [-1, 0, -1]


def test_no_points_give_empty_positions() -> None:
    at = RoadNetwork(TWO_WAY).locate(np.empty((0, 2)), tolerance_m=1.0)
    assert at.road.shape == at.along_m.shape == at.junction.shape == (0,)


def test_tolerance_reaches_the_nearest_lane_or_junction_but_no_farther() -> None:
    network = RoadNetwork(TWO_WAY, junctions=[SQUARE])
    at = network.locate([[50.0, 4.4], [50.0, 4.6], [99.5, 8.0], [99.5, -3.6]], tolerance_m=1.0)
    assert at.lane.tolist() == [1, -1, -1, 0]
    assert at.junction.tolist() == [-1, -1, 0, -1]


def test_a_point_inside_a_junction_is_not_drawn_to_a_lane_by_the_tolerance() -> None:
    at = RoadNetwork(TWO_WAY, junctions=[SQUARE]).locate([[100.5, 1.0]], tolerance_m=2.0)
    assert (at.lane[0], at.junction[0]) == (-1, 0)


def test_a_point_in_lane_and_junction_gets_both() -> None:
    overlapping = Junction("c", np.array([[95.0, -10.0], [120.0, -10.0], [120.0, 10.0], [95.0, 10.0]]))
    at = RoadNetwork(TWO_WAY, junctions=[overlapping]).locate([[97.0, 1.0]])
    assert (at.lane[0], at.junction[0]) == (1, 0)


def test_of_overlapping_lanes_the_one_with_the_nearest_centre_line_is_taken() -> None:
    network = RoadNetwork([straight_lane("a", width_m=6.0), straight_lane("b", y_m=2.0, width_m=6.0)])
    assert network.locate([[50.0, 0.9], [50.0, 1.1]]).lane.tolist() == [0, 1]


def test_coordinates_run_straight_on_past_the_end_of_the_reference_line() -> None:
    # Lanes cut at a slanting junction: one is longer than the other.
    longer = Lane("b", "-a", 0, "a", -1, np.array([[110.0, 3.5], [0.0, 3.5]]), 3.5, 25.0)
    at = RoadNetwork([straight_lane("a"), longer]).locate([[105.0, 3.0]])
    assert (at.along_m[0], at.across_m[0]) == pytest.approx((105.0, 1.25))


def test_tangent_of_a_road_due_west_is_plus_pi() -> None:
    line_m = np.array([[100.0, 0.0], [0.0, -0.0]])
    at = RoadNetwork([Lane("a", "a", 0, "a", 1, line_m, 3.5, 25.0)]).locate([[50.0, 0.0]])
    assert at.tangent_rad[0] == np.pi


def test_surface_joins_lanes_and_junctions_over_hairline_gaps() -> None:
    gap_m = np.array([[0.05, 0.0]])
    network = RoadNetwork(TWO_WAY, junctions=[Junction("c", SQUARE.outline_m + gap_m)])
    surface = network.surface()
    assert surface.geom_type == "Polygon"
    assert surface.area == pytest.approx(100 * 7.02 + 20 * 20, rel=0.001)
    assert surface.covers(shapely.Point(100.02, 0.0))


def test_road_polygons_leave_the_island_of_a_ring_road_empty() -> None:
    ring_m = arc(radius_m=30.0, turn_rad=2 * np.pi, segments=40)
    network = RoadNetwork([Lane("ring", "ring", 0, "ring", 1, ring_m, 5.0, 10.0)])
    rings = plain_rings(network.surface())
    filled = shapely.union_all([shapely.Polygon(ring) for ring in rings])
    assert not filled.covers(shapely.Point(0.0, 30.0))
    assert filled.symmetric_difference(network.surface()).area < 1e-6
    assert all(shapely.is_ccw(shapely.LinearRing(ring)) for ring in rings)


def test_a_network_without_lanes_is_an_error() -> None:
    with pytest.raises(GisError, match="expected at least one lane, got none"):
        RoadNetwork([])


def test_an_id_that_comes_twice_is_an_error() -> None:
    with pytest.raises(GisError, match="expected every lane id once, got 'a' twice"):
        RoadNetwork([straight_lane("a"), straight_lane("a")])


@pytest.mark.parametrize("points", [np.zeros(2), np.zeros((3, 3))], ids=["one point", "three columns"])
def test_points_of_a_wrong_shape_are_an_error(points: FloatArray) -> None:
    with pytest.raises(GisError, match=r"expected points of shape \(n, 2\) in metres, got shape"):
        RoadNetwork(TWO_WAY).locate(points)


def test_a_negative_tolerance_is_an_error() -> None:
    with pytest.raises(GisError, match=r"tolerance_m must be >= 0, got -1.0"):
        RoadNetwork(TWO_WAY).locate([[0.0, 0.0]], tolerance_m=-1.0)
