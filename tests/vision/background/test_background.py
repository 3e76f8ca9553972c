"""The empty road: learned, kept up to date, healed, and not learned from cars."""

from collections.abc import Sequence

import numpy as np

from tests.vision.road.test_rectify import ground_surface
from tests.vision.support import ROAD_LEVEL, draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.background.background import AT_THRESHOLD, Background
from vision.background.settings import BackgroundSettings
from vision.road.boxes import Boxes
from vision.road.rectify import RoadImage, RoadRaster
from vision.settings import VisionSettings

SIZE = (120, 40)
SETTINGS = VisionSettings(background=BackgroundSettings(startup_us=1_000_000))
LONGER = VisionSettings(background=BackgroundSettings(startup_us=1_000_000, startup_most_us=3_000_000))
LEVELS = (200.0, 40.0, 170.0, 50.0, 140.0, 70.0)
DARK = (40.0,)
NOBODY = (Boxes.none(), np.zeros(0, np.bool_))


class Road:
    """A raster, its background, and pictures of boxes on it."""

    def __init__(self, settings: VisionSettings = SETTINGS, *, finds_standing: bool = False) -> None:
        self.raster: RoadRaster = ground_surface(top_view(SIZE), [whole_view(SIZE)], SIZE).raster
        car_cells = settings.car_width_m / self.raster.grid.side
        self.background = Background(self.raster, settings, car_cells=car_cells, finds_standing=finds_standing)
        self._rng = np.random.default_rng(0)
        self._texture = ROAD_LEVEL + self._rng.normal(0, 6, (SIZE[1], SIZE[0]))

    def picture(
        self, k: int, boxes: Boxes | None = None, *, light: float = 1.0, levels: Sequence[float] = LEVELS
    ) -> RoadImage:
        boxes = boxes or Boxes.none()
        levels = levels[: len(boxes)]
        luma = draw_boxes(SIZE, boxes, levels, ground=self._texture)
        noisy = 16 + light * (luma - 16) + self._rng.normal(0, 1, luma.shape)
        return self.raster.rectify(make_frame(np.clip(noisy, 0, 255), index=k, t_us=40_000 * k))

    def start(self, boxes: Boxes | None = None, *, levels: Sequence[float] = LEVELS) -> int:
        k = 0
        while not self.background.hold(self.picture(k, boxes, levels=levels)):
            k += 1
        return k + 1

    def differing(self, image: RoadImage) -> int:
        return int(np.sum(self.background.compare(image) > AT_THRESHOLD))


def test_startup_is_over_with_the_frame_that_ends_it() -> None:
    road = Road()
    assert [road.background.hold(road.picture(k)) for k in range(26)] == [False] * 25 + [True]
    assert road.background.is_ready


def test_startup_ends_early_when_memory_is_short() -> None:
    frame_bytes = 3 * Road().raster.packed_size
    assert Road(VisionSettings(background=BackgroundSettings(startup_bytes=5 * frame_bytes))).start() == 5


def test_passing_cars_do_not_get_into_the_background() -> None:
    road = Road()
    k = 0
    while not road.background.hold(road.picture(k, make_boxes([(2.0 * k, 9, 0, 4.5, 1.8)]))):
        k += 1
    assert road.differing(road.picture(99)) == 0
    assert road.differing(road.picture(99, make_boxes([(20, 9, 0, 4.5, 1.8)]))) > 25


def test_brightness_of_the_whole_scene_is_no_motion() -> None:
    road = Road()
    k = road.start()
    for light in (0.7, 1.0, 1.25):
        assert road.differing(road.picture(k, light=light)) < 10
        assert road.differing(road.picture(k, make_boxes([(20, 9, 0, 4.5, 1.8)]), light=light)) > 25


def test_patch_that_nobody_claims_heals_within_seconds() -> None:
    parked = make_boxes([(20, 9, 0, 4.5, 1.8)])
    road = Road()
    start = road.start(parked)  # burned in, then it is gone
    counts = []
    for k in range(start, start + 110):
        image = road.picture(k)
        difference = road.background.compare(image)
        road.background.learn(image, (difference > AT_THRESHOLD).astype(np.uint8), *NOBODY)
        counts.append(int(np.sum(difference > AT_THRESHOLD)))
    assert counts[0] > 25
    assert counts[50] > 25
    assert counts[-1] == 0


def test_background_is_frozen_under_an_object() -> None:
    standing = make_boxes([(20, 9, 0, 4.5, 1.8)])
    road = Road()
    start = road.start()
    for k in range(start, start + 250):
        image = road.picture(k, standing)
        foreground = (road.background.compare(image) > AT_THRESHOLD).astype(np.uint8)
        road.background.learn(image, foreground, standing, np.ones(1, np.bool_))
    assert road.differing(road.picture(start + 250, standing)) > 25
    assert road.differing(road.picture(start + 250)) == 0


def test_outline_tells_a_standing_car_from_revealed_road() -> None:
    car = make_boxes([(20, 9, 0, 4.5, 1.8)])
    with_car, without_car = Road(), Road()
    k = with_car.start(car)
    without_car.start()
    revealed, arrived = with_car.picture(k), without_car.picture(k, car)
    with_car.background.compare(revealed)
    without_car.background.compare(arrived)
    assert with_car.background.judge(revealed, car).tolist() == [-1]
    assert without_car.background.judge(arrived, car).tolist() == [1]
    with_car.background.heal(revealed, car)
    assert with_car.differing(revealed) == 0


def test_startup_lasts_until_the_car_that_stands_there_has_left() -> None:
    car = make_boxes([(20, 9, 0, 4.5, 1.8)])
    road = Road(finds_standing=True)
    k = 0
    while not road.background.hold(road.picture(k, car if k < 60 else None, levels=DARK)):
        k += 1
    assert 60 < k < 150
    assert road.differing(road.picture(k + 1)) < 3
    assert road.differing(road.picture(k + 1, car)) > 25


def test_startup_ends_at_last_and_leaves_out_the_car_that_stands_there_still() -> None:
    car = make_boxes([(20, 9, 0, 4.5, 1.8)])
    road = Road(LONGER, finds_standing=True)
    k = road.start(car, levels=DARK)
    assert k == 76
    # The road under it was never seen: single cells of its texture may differ.
    assert road.differing(road.picture(k + 1)) < 8
    assert road.differing(road.picture(k + 2, car)) > 25


def test_car_a_little_darker_than_the_road_is_seen_though_it_stood_there_all_the_time() -> None:
    car = make_boxes([(20, 9, 0, 4.5, 1.8)])
    road = Road(LONGER, finds_standing=True)
    k = road.start(car, levels=(70.0,))
    assert road.differing(road.picture(k, car, levels=(70.0,))) > 25


def test_plain_road_where_something_else_was_learned_is_a_ghost_whatever_its_edges() -> None:
    # The picture has an outline too, that of a smaller thing: edges alone would not decide.
    car, line = make_boxes([(20, 9, 0, 4.5, 1.8)]), make_boxes([(20, 9, 0, 5.0, 0.3)])
    road = Road()
    k = road.start(car)
    image = road.picture(k, line)
    road.background.compare(image)
    assert road.background.judge(image, car).tolist() == [-1]


def test_change_of_most_of_the_view_is_learned_anew() -> None:
    road = Road()
    start = road.start()
    everything = make_boxes([(5 + 9 * i, 9, 0, 9, 25) for i in range(6)])
    for k in range(start, start + 60):
        image = road.picture(k, everything)
        difference = road.background.compare(image)
        road.background.learn(image, (difference > AT_THRESHOLD).astype(np.uint8), *NOBODY)
    assert road.differing(road.picture(start + 60, everything)) < 10


def test_restless_cells_need_a_larger_difference() -> None:
    road = Road()
    rng = np.random.default_rng(1)
    road_cells = np.flatnonzero(road.raster.pack(road.raster.road.astype(np.uint8)))
    restless, calm = road_cells[:300], road_cells[300:]
    for k in range(26):
        image = road.picture(k)
        image.planes[0, restless] = np.clip(ROAD_LEVEL + rng.normal(0, 8, 300), 0, 255)
        road.background.hold(image)
    image = road.picture(30)
    image.planes[1] += 20  # colour, which the gain does not follow
    levels = road.background.compare(image)
    assert levels[calm].mean() > 3 * AT_THRESHOLD
    assert levels[restless].mean() < 0.5 * levels[calm].mean()
