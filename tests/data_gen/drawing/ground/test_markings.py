"""Painted lines, from lanes."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from data_gen.drawing.ground.markings import road_markings
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork
from tests.data_gen.support import straight_road


def test_a_two_way_road_has_two_edge_lines_and_one_dashed_centre_line() -> None:
    shapes = road_markings(straight_road())
    long = [shape for shape in shapes if shape.length > 1000]
    assert sorted(round(shape.centroid.y, 2) for shape in long) == [-3.35, 3.35]
    dashes = [shape for shape in shapes if shape.length < 10]
    assert len(long) + len(dashes) == len(shapes)
    assert {round(shape.centroid.y, 6) for shape in dashes} == {0.0}
    assert len(dashes) == pytest.approx(1000 / 12, abs=1)


def test_lanes_side_by_side_share_one_dashed_line() -> None:
    lanes = [
        Lane(f"e_{index}", "e", index, "e", +1, np.array([[0.0, 3.5 * index], [100.0, 3.5 * index]]), 3.5, 30.0)
        for index in range(2)
    ]
    shapes = road_markings(RoadNetwork(lanes))
    dashes = [shape for shape in shapes if shape.length < 10]
    assert {round(shape.centroid.y, 6) for shape in dashes} == {1.75}
    assert not any(one.intersects(other) for one, other in pairwise(dashes))
    assert shapely.union_all(shapes).bounds == pytest.approx((0.0, -1.7, 100.0, 5.2))
