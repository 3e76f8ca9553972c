"""The bare road, read off pictures with traffic on it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.road.test_rectify import ground_surface
from tests.vision.support import METRES_PER_PIXEL, draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.background.settings import BackgroundSettings
from vision.background.standing import StandingVehicles
from vision.background.startup import LEVEL, FirstSight, calmest, first_sight, median_of, noise_of, plain_sight
from vision.road.boxes import Boxes
from vision.road.grid import Grid
from vision.road.rectify import RoadCells, RoadRaster
from vision.road.road_colour import RoadColour
from vision.road.settings import RoadSettings

SIZE = (160, 40)
SETTINGS = BackgroundSettings()
CAR_CELLS = 1.8 / METRES_PER_PIXEL
# A car in its lane, as it is seen: a roof of the road's level between dark windows, and a shadow.
CAR_LEVELS = [60.0, 100.0, 40.0, 40.0]
MARKING = 160.0
GREY, GREEN = (100, 128, 128), (110, 105, 125)


def grey_car(x_m: float) -> tuple[Boxes, list[float]]:
    shadow, body = (x_m, 8.4, 0, 4.5, 1.8), (x_m, 9.0, 0, 4.5, 1.8)
    windows = [(x_m + shift_m, 9.0, 0, 0.7, 1.6) for shift_m in (-1.0, 1.0)]
    return make_boxes([shadow, body, *windows]), CAR_LEVELS


class Road:
    """A road with a lane marking and an arrow, and pictures of it."""

    def __init__(self, polygon: NDArray[np.float64] | None = None) -> None:
        polygons = [whole_view(SIZE) if polygon is None else polygon]
        self.raster: RoadRaster = ground_surface(top_view(SIZE), polygons, SIZE).raster
        self.colour = RoadColour(self.raster, RoadSettings(), car_cells=CAR_CELLS)
        self._rng = np.random.default_rng(1)
        line, arrow = (40, 6.5, 0, 80, 0.3), (30, 9.0, 0, 3.0, 0.6)
        self._ground = draw_boxes(SIZE, make_boxes([line, arrow]), [MARKING] * 2, ground=np.full(SIZE[::-1], 100.0))

    def sample(self, cars: tuple[Boxes, list[float]] | None = None) -> NDArray[np.uint8]:
        luma = self._ground if cars is None else draw_boxes(SIZE, cars[0], cars[1], ground=self._ground)
        noisy = np.clip(luma + self._rng.normal(0, 1, luma.shape), 0, 255)
        return self.raster.rectify(make_frame(noisy, index=0, t_us=0)).planes

    def bare(self) -> NDArray[np.float32]:
        return median_of([self.sample() for _ in range(9)])

    def see(self, samples: list[NDArray[np.uint8]]) -> FirstSight:
        return first_sight(samples, self.colour, SETTINGS)

    def standing(self, sight: FirstSight) -> NDArray[np.bool_]:
        return StandingVehicles(self.colour, SETTINGS, margin_cells=2).find(sight)


def differing(planes: NDArray[np.float32], bare: NDArray[np.float32]) -> int:
    return int(np.sum(np.abs(planes - bare).max(axis=0) > 10))


@pytest.mark.parametrize("x_m", [20.0, 30.0], ids=["on plain road", "on an arrow"])
def test_car_of_the_colour_of_the_road_that_stands_most_of_the_time_is_no_road(x_m: float) -> None:
    road = Road()
    samples = [road.sample() for _ in range(6)] + [road.sample(grey_car(x_m)) for _ in range(34)]
    assert differing(median_of(samples), road.bare()) > 20
    assert differing(road.see(samples).planes, road.bare()) <= 1


def test_road_that_was_bare_for_a_moment_is_known() -> None:
    road = Road()
    samples = [road.sample() for _ in range(2)] + [road.sample(grey_car(20.0)) for _ in range(38)]
    assert differing(road.see(samples).planes, road.bare()) <= 1


def test_queue_leaves_the_road_between_its_cars() -> None:
    road = Road()
    samples = [road.sample(grey_car(20 + 1.0 * (k % 9)) if k % 10 else None) for k in range(60)]
    assert differing(road.see(samples).planes, road.bare()) <= 1


def test_car_that_never_moved_is_found_and_markings_are_not() -> None:
    road = Road()
    assert not road.standing(road.see([road.sample() for _ in range(20)])).any()
    car = grey_car(20.0)
    sight = road.see([road.sample(car) for _ in range(20)])
    found = road.standing(sight)
    where = road.raster.pack(road.raster.grid.paint(car[0].corners()))
    assert np.sum(found & (where > 0)) > 0.8 * np.sum(where > 0)
    assert np.sum(found) < 1.6 * np.sum(where > 0)


def test_what_is_bright_on_the_border_of_a_lane_is_a_kerb_and_no_part_of_the_car_beside_it() -> None:
    road = Road()
    car = make_boxes([(20.0, 8.4, 0, 4.5, 1.8), (20.0, 9.0, 0, 4.5, 1.8), (20.0, 10.4, 0, 4.5, 1.2)])
    sight = road.see([road.sample((car, [60.0, 40.0, MARKING])) for _ in range(20)])
    kerb, body = (road.raster.pack(road.raster.grid.paint(car.select(np.array([i])).corners())) > 0 for i in (2, 1))
    borders = road.raster.unpack(kerb.astype(np.uint8)) > 0
    found = [
        StandingVehicles(road.colour, SETTINGS, margin_cells=2, borders=one).find(sight) for one in (None, borders)
    ]
    assert [bool((one & kerb & ~body).any()) for one in found] == [True, False]
    assert [int((one & body).sum() > 0.7 * body.sum()) for one in found] == [1, 1]


@pytest.mark.parametrize(("wide_m", "is_vehicle"), [(30.0, False), (11.0, True)], ids=["bridge", "bus across"])
def test_what_reaches_from_one_side_of_the_road_to_the_other_is_no_vehicle(wide_m: float, *, is_vehicle: bool) -> None:
    road, across = Road(), (make_boxes([(55, 10.0, 0, 3.0, wide_m)]), [50.0])
    sight = road.see([road.sample(across) for _ in range(20)])
    assert road.standing(sight).any() == is_vehicle


def test_crown_of_leaves_over_the_road_is_no_vehicle() -> None:
    road, leaves = Road(), (make_boxes([(35, 9.0, 0, 30.0, 12.0)]), [50.0])
    assert not road.standing(road.see([road.sample(leaves) for _ in range(20)])).any()


@pytest.mark.parametrize(
    ("tint", "place", "is_vehicle"),
    [(-10, (40, 5, 0, 10, 4), False), (0, (40, 5, 0, 10, 4), True), (-10, (5, 10, 0, 10, 6), True)],
    ids=["crown", "shadow of a truck", "two green buses that the view cuts"],
)
def test_what_covers_the_side_of_the_road_is_no_vehicle_but_what_shades_it_may_be(
    tint: int, place: tuple[float, float, float, float, float], *, is_vehicle: bool
) -> None:
    road, thing = Road(np.array([[-5.0, 4.0], [85.0, 4.0], [85.0, 16.0], [-5.0, 16.0]])), make_boxes([place])
    samples = [road.sample((thing, [50.0])) for _ in range(20)]
    where = road.raster.pack(road.raster.grid.paint(thing.corners())) > 0
    for planes in samples:
        planes[1:, where] += np.uint8(tint % 256)
    assert road.standing(road.see(samples)).any() == is_vehicle


def test_shaded_road_is_what_comes_back_and_not_the_bright_cars_that_pass() -> None:
    # A white car in the shade of a bridge has the level of the road in the sun: nothing there looks calmer.
    road, shade = Road(), (make_boxes([(20, 9.0, 0, 10.0, 12.0)]), [55.0])
    white = make_boxes([(20, 9.0, 0, 10.0, 12.0), (20, 9.0, 0, 4.5, 1.8)]), [55.0, 100.0]
    sight = road.see([road.sample(white if k % 12 in (3, 4) else shade) for k in range(60)])
    assert differing(sight.planes, median_of([road.sample(shade) for _ in range(9)])) == 0


def test_grass_beyond_the_road_is_what_is_seen_most_of_the_time_and_not_the_grey_lorry_that_leans_over_it() -> None:
    grid, ground = Grid(np.zeros(2), 0.5, (24, 80), is_north_up=True), np.ones((24, 80), np.bool_)
    ground[16:] = False
    cells = RoadCells(grid, road=np.ones_like(ground), view_edge=np.zeros_like(ground), ground=ground)

    def sample(*, with_lorry: bool) -> NDArray[np.uint8]:
        planes = np.stack([np.where(ground, road, grass) for road, grass in zip(GREY, GREEN, strict=True)])
        planes[:, 12:22, 30:50] = np.where(with_lorry, np.array(GREY)[:, None, None], planes[:, 12:22, 30:50])
        return np.stack([cells.pack(plane.astype(np.uint8)) for plane in planes])

    colour = RoadColour(cells, RoadSettings(), car_cells=4.0)
    sight = first_sight([sample(with_lorry=k % 5 == 2) for k in range(20)], colour, SETTINGS)
    assert differing(sight.planes, sample(with_lorry=False).astype(np.float32)) == 0


def test_dark_patch_that_cars_drive_over_is_ground() -> None:
    road, patch = Road(), (make_boxes([(20, 9.0, 0, 4.0, 1.8)]), [40.0])
    passing = make_boxes([(20, 9.0, 0, 4.0, 1.8), (20, 9.0, 0, 5.0, 1.8)]), [40.0, 200.0]
    samples = [road.sample(passing if k % 7 == 3 else patch) for k in range(60)]
    sight = road.see(samples)
    assert differing(sight.planes, road.bare()) > 20
    assert not road.standing(sight).any()


@pytest.mark.parametrize("most_unrest", [9, 90], ids=["always calm", "seldom calm"])
def test_calmest_times_agree_with_sorting_them_one_cell_after_the_other(most_unrest: int) -> None:
    rng = np.random.default_rng(2)
    values = rng.integers(100, 120, (3, 50, 21)).astype(np.uint8)
    unrest = rng.integers(0, most_unrest, (50, 21)).astype(np.uint8)
    planes, least = calmest(values, unrest, SETTINGS)
    for cell in range(50):
        times = sorted(range(21), key=lambda time: (unrest[cell, time], time))[: SETTINGS.calmest_samples]
        calm = [time for time in times if unrest[cell, time] <= LEVEL * SETTINGS.unrest_levels]
        times = times[: max(SETTINGS.least_calm_samples, len(calm))]
        middle = np.array([sorted(plane[cell, times].tolist())[len(times) // 2] for plane in values])
        near = [time for time in range(21) if (np.abs(values[:, cell, time] - middle) <= SETTINGS.same_levels).all()]
        expected = values[:, cell, near].mean(axis=1) if near else middle
        assert planes[:, cell] == pytest.approx(expected, rel=1e-6)
        assert least[cell] == sorted(unrest[cell, times].tolist())[(len(times) - 1) // 2]


def test_median_agrees_with_that_of_the_library() -> None:
    samples = list(np.random.default_rng(4).integers(0, 256, (9, 3, 500)).astype(np.uint8))
    assert median_of(samples).tolist() == np.median(samples, axis=0).tolist()


def test_noise_is_not_that_of_what_stood_in_front() -> None:
    differences = [np.array([[1, 90, 90]], np.uint8)] * 4 + [np.array([[2, 3, 90]], np.uint8)] * 3
    most_levels = SETTINGS.most_noise_levels
    assert noise_of(differences, np.ones((7, 3), np.bool_), most_levels).tolist() == [[1.0, 3.0, most_levels]]


def test_noise_is_that_of_calm_times_though_a_grey_car_stands_there_most_of_the_time() -> None:
    differences = [np.array([[2]], np.uint8)] * 3 + [np.array([[20]], np.uint8)] * 9
    is_calm = np.arange(12)[:, None] < 4
    assert noise_of(differences, is_calm, SETTINGS.most_noise_levels).tolist() == [[2.0]]


def test_plain_sight_is_the_road_where_some_vehicle_is_always_near() -> None:
    rng = np.random.default_rng(4)
    road = rng.integers(90, 120, (3, 200)).astype(np.uint8)
    samples = []
    for k in range(61):
        seen = road.copy()
        # Narrow lanes side by side: two in five cells are covered at any time, each by another car.
        seen[:, (np.arange(200) + 7 * k) % 5 < 2] = rng.integers(20, 240)
        samples.append(seen)
    assert (plain_sight(samples).planes == road).all()
