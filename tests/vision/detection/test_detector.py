"""What the built-in detector makes of small and half hidden things, seen from low above the road."""

import numpy as np
import pytest

from tests.vision.road.test_view import SIZE, bridge_view
from tests.vision.support import make_frame
from vision.background.settings import BackgroundSettings
from vision.camera import fixed_camera
from vision.detection.parting.lanes import LaneStrip
from vision.objects import VisionObjects
from vision.road.view import GroundView
from vision.settings import VisionSettings

ROAD = np.array([[-6.0, 5.0], [6, 5], [6, 400], [-6, 400]])
NORTH = [LaneStrip(np.array([[x, 0.0], [x, 300.0]]), 4.0) for x in (-2.0, 2.0)]
EAST = [LaneStrip(np.array([[-6.0, 40.0], [6.0, 40.0]]), 30.0)]
RATE_HZ, SECONDS = 12, 3


def show(
    lanes: list[LaneStrip], *, width_m: float, height_m: float, hidden_from_s: float = 99.0
) -> list[VisionObjects]:
    """Film an upright thing that comes down the road to 25 m at 10 m/s; its lower part is hidden after a while."""
    vision = fixed_camera(
        bridge_view(), [ROAD], SIZE, VisionSettings(background=BackgroundSettings(startup_us=1_500_000)), lanes=lanes
    )
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    results: list[VisionObjects] = []
    for k in range(RATE_HZ * SECONDS):
        foot_m = np.array([[2.0, 25 + 10 * (SECONDS - k / RATE_HZ)]])
        (x, y), scale = view.to_pixels(foot_m)[0], 1 / view.sight(foot_m).across_m[0]
        luma = np.full(SIZE[::-1], 100.0)
        top = round(y - height_m * scale)
        bottom = top + round(height_m * scale * (1.0 if k / RATE_HZ < hidden_from_s else 0.6))
        luma[top:bottom, round(x - width_m * scale / 2) : round(x + width_m * scale / 2)] = 180
        results += vision.observe(make_frame(luma, index=k, t_us=1_000_000 * k // RATE_HZ))
    return [*results, *vision.finish()]


@pytest.mark.long
@pytest.mark.parametrize(
    ("lanes", "width_m", "expected"),
    [(NORTH, 0.9, True), (EAST, 0.9, False), (EAST, 1.8, True)],
    ids=["motorcycle in its lane", "person who crosses", "car that crosses"],
)
def test_narrow_thing_is_a_vehicle_only_if_it_moves_along_its_lane(
    lanes: list[LaneStrip], width_m: float, expected: bool
) -> None:
    backwards = [LaneStrip(one.centre_line_m[::-1].copy(), one.width_m) for one in lanes]
    results = show(backwards, width_m=width_m, height_m=1.8)
    assert (len(results), any(one.ids for one in results)) == (RATE_HZ * SECONDS, expected)


def test_known_vehicle_may_be_smaller_than_a_new_one() -> None:
    backwards = [LaneStrip(one.centre_line_m[::-1].copy(), one.width_m) for one in NORTH]
    seen = show(backwards, width_m=0.9, height_m=1.7, hidden_from_s=2.0)
    assert seen[-1].ids == ("v1",)
    assert seen[-1].observed.all()
    assert not any(one.ids for one in show(backwards, width_m=0.9, height_m=1.0))
