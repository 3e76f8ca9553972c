"""A road seen from low above it: what stands where its foot is."""

import numpy as np
import pytest
import shapely

from tests.vision.road.test_view import SIZE, bridge_view
from tests.vision.support import make_boxes
from vision.detection.blobs import find_blobs
from vision.detection.surfaces.image_surface import ImageSurface, road_part
from vision.detection.surfaces.surface import road_area
from vision.errors import VisionError
from vision.road.view import GroundView
from vision.settings import VisionSettings

ROAD = np.array([[-6.0, -100.0], [6, -100], [6, 400], [-6, 400]])


def bridge_surface() -> ImageSurface:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    return ImageSurface(view, [ROAD], image_size_px=SIZE, settings=VisionSettings())


def test_road_is_watched_up_to_the_roofs_of_vehicles() -> None:
    surface = bridge_surface()
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    beside, above = view.to_pixels(np.array([[12.0, 50.0]]))[0], view.to_pixels(np.array([[0.0, 50.0]]))[0]
    above[1] -= 1.5 * 800 / 50
    look_up = surface.raster.grid.look_up
    assert look_up(surface.raster.road, np.stack([beside, above])).tolist() == [False, True]
    assert (
        surface.holds(np.array([[0.0, 50.0], [12.0, 50.0], [0.0, -50.0], [0.0, 390.0]])).tolist()
        == [True] + [False] * 3
    )


def test_road_is_watched_as_far_as_a_foot_tells_one_car_s_length_from_the_next() -> None:
    # A row of pixels is d * d / (height * focal length) of road at a distance d, and a foot is 1.5 rows uncertain.
    farthest_m = np.sqrt(4.5 / 1.5 * 8.0 * 800.0)
    beside = np.array([[0.0, 0.97 * farthest_m], [0.0, 1.03 * farthest_m]])
    assert bridge_surface().holds(beside).tolist() == [True, False]


def test_part_with_the_road_holds_vehicles_and_not_the_sky() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    part_px = road_part(view, [ROAD], SIZE, VisionSettings())
    assert part_px is not None
    left, top, width, height = part_px
    near, far = view.to_pixels(np.array([[5.9, 25.0], [0.0, 120.0]]))
    assert left <= near[0] <= left + width
    assert top <= far[1] - 1.5 * 800 / 120
    assert top + height == SIZE[1]
    horizon_px = 179.5 - 800 * np.tan(0.15)
    assert top > horizon_px - 4.0 * 800 / 180  # where a car is 8 px wide
    assert top <= view.to_pixels(np.array([[0.0, 175.0]]))[0, 1] - 3.0 * 800 / 175  # to cells of 8 px
    off_road = [ROAD + np.array([5000.0, 0.0])]
    assert road_part(view, off_road, SIZE, VisionSettings()) is None


def test_far_part_ends_where_a_car_is_as_wide_as_was_asked() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    part_px = road_part(view, [ROAD], SIZE, VisionSettings())
    far_px = road_part(view, [ROAD], SIZE, VisionSettings(), narrower_px=20.0)
    assert part_px is not None
    assert far_px is not None
    assert far_px[1] == part_px[1]
    ends = view.to_ground(np.array([[319.5, far_px[1] + far_px[3]]]))[0]
    assert 1.8 / view.sight(ends).across_m == pytest.approx(20.0, rel=0.15)  # to cells of 8 px
    assert road_part(view, [ROAD], SIZE, VisionSettings(), narrower_px=1.0) is None


@pytest.mark.parametrize("heading_rad", [np.pi / 2, -np.pi / 2], ids=["away", "towards"])
@pytest.mark.parametrize("north_m", [30.0, 70.0])
def test_car_stands_where_its_foot_is(heading_rad: float, north_m: float) -> None:
    surface = bridge_surface()
    car = make_boxes([(2.0, north_m, heading_rad, 4.5, 1.8)])
    seen = surface.appearances(car)
    mask = surface.raster.grid.paint(seen.boxes.corners())
    cells = find_blobs(surface.raster, mask, 99 * mask)
    footprint = surface.footprints(cells, np.array([heading_rad]), None)
    assert footprint.boxes.centre_m[0] == pytest.approx([2.0, north_m], abs=0.04 * north_m)
    assert 1.8 * 1.5 < surface.areas_m2(cells)[0] < 1.8 * 3.0  # rear and roof
    # A row of the image is more road far away than near by.
    assert footprint.noise[0, 1, 1] > footprint.noise[0, 0, 0] * 0.99


@pytest.mark.parametrize(
    ("size_m", "length_m"), [((1.8, 1.5), 4.5), ((2.1, 2.4), 5.7), ((2.5, 3.4), 10.5), ((4.0, 1.5), 4.5)]
)
@pytest.mark.parametrize("north_m", [30.0, 60.0])
def test_what_is_seen_tells_how_long_a_vehicle_is(size_m: tuple[float, float], length_m: float, north_m: float) -> None:
    """A car, a van, a truck, and two cars side by side, whose length is seen as height too."""
    surface, view = bridge_surface(), GroundView(bridge_view(), SIZE, VisionSettings())
    vehicle = make_boxes([(0.0, north_m, np.pi / 2, length_m, size_m[0])])
    corners = view.corners_px(vehicle, np.array([size_m[1]]))[0]
    low, high = corners.min(axis=0), corners.max(axis=0)
    mask = surface.raster.grid.paint([np.array([low, (high[0], low[1]), high, (low[0], high[1])])])
    cells = find_blobs(surface.raster, mask & surface.raster.road.view(np.uint8), 99 * mask)
    found = surface.footprints(cells, np.full(1, np.pi / 2), None).boxes
    assert found.length_m.tolist() == [length_m]
    assert found.centre_m[0, 1] == pytest.approx(north_m, abs=1.0)


def test_road_that_crosses_itself_is_what_it_winds_round_an_odd_number_of_times() -> None:
    rng = np.random.default_rng(0)
    star = np.array([[0.0, 0], [8, 1], [1, 7], [4, -2], [8, 8], [0, 4]])
    points = rng.uniform(-1, 9, (400, 2))
    for point, got in zip(points, shapely.contains_xy(road_area([star]), points), strict=True):
        angles = np.arctan2(*(star - point).T[::-1])
        turns = np.diff(np.append(angles, angles[0]))
        winding = np.sum((turns + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi)
        assert got == (round(winding) % 2 == 1)


def test_road_out_of_view_is_refused() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    with pytest.raises(VisionError, match="expected road in view, got none"):
        ImageSurface(view, [ROAD + np.array([0.0, 2000.0])], image_size_px=SIZE, settings=VisionSettings())
