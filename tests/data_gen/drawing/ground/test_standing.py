"""What stands beside a road starts on the ground, hides no near road, and knows how far away it is."""

import math

import numpy as np
import shapely

from data_gen.drawing.ground.scenery import Scenery
from data_gen.drawing.ground.sky import Haze
from data_gen.drawing.ground.standing import paint_standing, stands_clear
from data_gen.drawing.sun import Sun
from data_gen.drawing.view import CameraView
from gis.cameras.camera_pose import CameraPose
from tests.data_gen.support import straight_road

SIZE_PX = (640, 360)
SUN = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.0, 0.0))
POSE = CameraPose(100.0, 12.0, 6.0, 0.0, math.radians(-6), 0.0, 600.0)
VIEW = CameraView(POSE.camera(*SIZE_PX), SIZE_PX, POSE)
CLEAR = Haze(1e9, (200.0, 200.0, 200.0))
NOTHING = Scenery(is_urban=False, parcels=(), hedges=(), buildings=(), trees=())


def test_posts_stand_on_the_ground_beside_the_road() -> None:
    standing = paint_standing(straight_road(), NOTHING, VIEW, sun=SUN, haze=CLEAR, rng=np.random.default_rng(1))
    rows, columns = np.nonzero(np.isfinite(standing.away_m))
    assert len(rows) > 20
    ground_m = VIEW.camera.to_ground(np.column_stack((columns, rows)))
    # How high the line of sight through each pixel is where something stands.
    behind_m = np.hypot(*(ground_m - POSE.place_m[:2]).T)
    up_m = POSE.height_m * (1 - standing.away_m[rows, columns] / behind_m)
    pixel_m = standing.away_m[rows, columns] / POSE.focal_px
    assert (up_m > -2 * pixel_m).all()
    assert (up_m < 1.0 + 2 * pixel_m).all()


def test_hedges_rise_from_the_ground_and_are_as_far_away_as_they_stand() -> None:
    hedge = shapely.box(150.0, 10.0, 151.0, 18.0)
    scenery = Scenery(is_urban=False, parcels=(), hedges=(hedge,), buildings=(), trees=())
    standing = paint_standing(straight_road(), scenery, VIEW, sun=SUN, haze=CLEAR, rng=np.random.default_rng(1))
    column, foot_px = VIEW.camera.to_pixels([[150.0, 14.0]])[0].round().astype(int)
    away_m = standing.away_m[foot_px - 4, column]
    assert abs(away_m - 50.0) < 2.0
    assert np.isinf(standing.away_m[foot_px + 3, column])


def test_nothing_may_stand_between_the_camera_and_the_road_next_to_it() -> None:
    road, eye_m = straight_road().surface(), np.array([100.0, 12.0])
    assert not stands_clear(shapely.box(120, 6, 124, 9), road, eye_m)
    assert not stands_clear(shapely.box(99, 11, 101, 13), road, eye_m)
    assert stands_clear(shapely.box(120, 20, 124, 24), road, eye_m)
    assert stands_clear(shapely.box(400, 6, 404, 9), road, eye_m)
