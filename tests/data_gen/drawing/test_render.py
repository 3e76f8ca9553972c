"""Drawn vehicles lie where the truth says, and the picture is one a camera could have taken."""

import math

import numpy as np
import pytest

from data_gen.drawing.cameras import camera_path
from data_gen.drawing.ground.markings import road_markings
from data_gen.drawing.render import SceneRenderer, make_world
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.sprites import SpritePainter
from data_gen.drawing.view import CameraView, camera_over
from data_gen.scenario import View
from data_gen.simulation.states import FloatArray, VehicleStates
from tests.data_gen.support import states_of, straight_road

SIZE_PX = (640, 360)
COARSE_VIEW = View(centre_m=(500.0, 0.0), width_m=300.0)
COARSE = camera_over(COARSE_VIEW, SIZE_PX)
FINE = camera_over(View(centre_m=(500.0, 0.0), width_m=96.0), SIZE_PX)
NO_SUN = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.0, 0.0), is_hidden=True)


def opacity(view: CameraView, states: VehicleStates, sun: Sun = NO_SUN) -> FloatArray:
    """Measure each pixel's cover by drawing over black and over white: paint does not matter."""
    pictures = []
    for ground in (0, 255):
        canvas = np.full((SIZE_PX[1], SIZE_PX[0], 3), ground, dtype=np.uint8)
        SpritePainter(SIZE_PX, sun).draw(canvas, states, view)
        pictures.append(canvas[:, :, 0].astype(np.float64))
    return np.asarray(1 - (pictures[1] - pictures[0]) / 255, dtype=np.float64)


def centroid_px(cover: FloatArray) -> FloatArray:
    y_px, x_px = np.nonzero(cover)
    weight = cover[y_px, x_px]
    return np.array([(x_px * weight).sum(), (y_px * weight).sum()]) / weight.sum()


@pytest.mark.parametrize("view", [COARSE, FINE], ids=["10-px-cars", "30-px-cars"])
@pytest.mark.parametrize("truck", [False, True], ids=["car", "truck"])
def test_a_vehicle_is_drawn_at_its_true_place_and_size(view: CameraView, truck: bool) -> None:
    rng = np.random.default_rng(7)
    for appearance in range(40):
        x_m, y_m = rng.uniform((470, -10), (530, 10))
        states = states_of(("a", x_m, y_m, rng.uniform(-math.pi, math.pi)), truck=truck, appearance=appearance)
        cover = opacity(view, states)
        error_px = centroid_px(cover) - view.camera.to_pixels(states.centre_m)[0]
        assert np.hypot(*error_px) < 0.15
        area_m2 = cover.sum() * float(view.camera.metres_per_pixel(states.centre_m)[0]) ** 2
        assert area_m2 == pytest.approx(float(states.length_m[0] * states.width_m[0]), rel=0.05)


def test_the_shadow_falls_away_from_the_sun() -> None:
    states = states_of(("a", 500.0, 0.0, 0.7))
    sun = Sun(shadow_rad=math.pi / 2, shadow_slope=1.0, phases_rad=(0.0, 0.0))
    shadow_only = opacity(COARSE, states, sun) - opacity(COARSE, states)
    to_shadow_px = centroid_px(np.maximum(shadow_only, 0)) - COARSE.camera.to_pixels(states.centre_m)[0]
    assert to_shadow_px[1] < -1
    assert abs(to_shadow_px[0]) < 0.3


def test_a_vehicle_at_the_border_is_cut_not_moved() -> None:
    whole = opacity(COARSE, states_of(("a", 500.0, 0.0, 0.0)))
    cut = opacity(COARSE, states_of(("a", 350.0, 0.0, 0.0)))
    assert cut.sum() == pytest.approx(whole.sum() / 2, rel=0.05)
    assert cut[:, 12:].sum() == 0


def renderer(seed: int = 1) -> SceneRenderer:
    path = camera_path("vertical", COARSE_VIEW, SIZE_PX, t_us=np.array([0]), rng=np.random.default_rng(0))
    network = straight_road()
    world = make_world(network, path, np.random.default_rng(seed), marks=road_markings(network))
    return SceneRenderer(world, path, np.random.default_rng(seed))


def test_the_truth_lies_on_grey_asphalt() -> None:
    nobody = states_of()
    picture = renderer().frame(nobody)
    chroma = picture[SIZE_PX[1] :].reshape(2, SIZE_PX[1] // 2, SIZE_PX[0] // 2).astype(np.int64)
    places_m = np.array([[x_m, y_m] for x_m in range(360, 640, 7) for y_m in (-1.75, 1.75)], dtype=np.float64)
    columns, rows = (np.round(COARSE.camera.to_pixels(places_m)).astype(np.int64) // 2).T
    assert np.abs(chroma[:, rows, columns] - 128).max() <= 6
    off_road_m = places_m + np.array([0.0, 12.0])
    columns, rows = (np.round(COARSE.camera.to_pixels(off_road_m)).astype(np.int64) // 2).T
    assert np.median(np.abs(chroma[:, rows, columns] - 128)) > 6


@pytest.mark.long
def test_a_vehicle_that_left_leaves_no_trace() -> None:
    passed, empty = renderer(), renderer()
    passed.frame(states_of(("a", 500.0, -1.75, 0.0)))
    empty.frame(states_of())
    np.testing.assert_array_equal(passed.frame(states_of()), empty.frame(states_of()))


def test_noise_is_weak_and_new_in_each_frame() -> None:
    drawn = renderer()
    first, second = (drawn.frame(states_of())[: SIZE_PX[1]].astype(np.float64) for _ in range(2))
    assert 1.5 < np.std(second - first) < 4
    assert abs(np.mean(second - first)) < 0.1


def test_light_drifts_by_a_few_per_cent() -> None:
    sun = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.3, 1.0))
    gains = [sun.gain(second * 1_000_000) for second in range(120)]
    assert 0.95 < min(gains) < 0.98
    assert 1.02 < max(gains) < 1.05
    assert np.abs(np.diff(gains)).max() < 0.01
