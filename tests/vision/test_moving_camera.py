"""The whole of vision for a camera that moves, on small drawn videos."""

from collections.abc import Sequence

import numpy as np
import pytest

from tests.vision.moving_world import ROAD, SIZE, Car, MovingWorld, drift
from tests.vision.support import FloatArray, make_frame
from vision.background.settings import BackgroundSettings
from vision.camera import facing, moving_camera
from vision.errors import VisionError
from vision.objects import VisionObjects
from vision.registration.registration import CameraMotion, Registration
from vision.registration.settings import RegistrationSettings
from vision.settings import VisionSettings
from vision.video.frames import Frame

QUICK = VisionSettings(background=BackgroundSettings(startup_us=2_000_000))
LEVELS = [190.0, 55.0]


class GivenMotion:
    """Knows the true maps, and is lost in some frames."""

    def __init__(self, lost: Sequence[int] = ()) -> None:
        self._lost = lost

    refusal = "told to be lost"

    def locate(self, frame: Frame, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        return None if frame.index in self._lost else drift(frame.index)


def cars(k: int) -> list[Car]:
    return [(20.0 + 10 * k / 25, 48.0, 0.0, 4.5, 1.8), (150.0 - 12 * k / 25, 53.0, np.pi, 4.5, 1.8)]


def watch(motion: CameraMotion[Frame], frames: int, blank: Sequence[int] = ()) -> list[VisionObjects]:
    """Show the cars to a moving camera; in some frames there is nothing but noise."""
    world, rng = MovingWorld(), np.random.default_rng(7)
    vision = moving_camera(drift(0), [ROAD], SIZE, motion, reach_m=40.0, settings=QUICK)
    results: list[VisionObjects] = []
    for k in range(frames):
        frame = world.frame(drift(k), k, cars(k), LEVELS)
        if k in blank:
            frame = make_frame(rng.normal(110, 40, SIZE[::-1]).clip(0, 255), index=k, t_us=40_000 * k)
        results += vision.observe(frame)
    return [*results, *vision.finish()]


@pytest.mark.long
def test_cars_are_tracked_in_ground_metres() -> None:
    results = watch(Registration(drift(0), SIZE, RegistrationSettings()), 170)
    assert [r.t_us for r in results] == [40_000 * k for k in range(170)]
    errors, seen = [], 0
    for k, r in list(enumerate(results))[60:]:
        inside = [car for car in cars(k) if 35 < car[0] < 115]
        seen += len(inside)
        for car in inside:
            away_m = np.hypot(*(r.centre_m - car[:2]).T)
            if len(away_m) and away_m.min() < 2:
                errors.append(away_m.min())
    assert len(errors) > 0.95 * seen > 100
    assert np.mean(errors) < 0.4
    assert len({name for r in results for name in r.ids}) <= 3


@pytest.mark.long
def test_standing_scene_gives_no_objects() -> None:
    world = MovingWorld()
    vision = moving_camera(
        drift(0), [ROAD], SIZE, Registration(drift(0), SIZE, RegistrationSettings()), reach_m=40.0, settings=QUICK
    )
    results = [one for k in range(150) for one in vision.observe(world.frame(drift(k), k))]
    assert len(results) == 150
    assert all(r.ids == () for r in results)


def test_every_result_carries_the_map_of_its_frame() -> None:
    for k, r in enumerate(watch(GivenMotion(), 60)):
        assert r.pixel_from_ground is not None
        assert np.allclose(r.pixel_from_ground, drift(k))


@pytest.mark.long
def test_lost_frames_say_nothing_and_leave_nothing_behind() -> None:
    blank = range(80, 160)
    results = watch(Registration(drift(0), SIZE, RegistrationSettings()), 190, blank)
    assert [k for k, r in enumerate(results) if r.is_lost] == list(blank)
    assert all(r.ids == () and r.pixel_from_ground is None for r in results if r.is_lost)
    before, after = set(results[79].ids), {name for r in results[160:] for name in r.ids}
    assert before
    assert len(after) == 2  # no ghosts where the cars stood when the view came back
    assert not before & after  # three seconds are more than a track coasts


@pytest.mark.long
def test_short_loss_keeps_the_tracks() -> None:
    results = watch(GivenMotion(lost=range(100, 105)), 120)
    assert [k for k, r in enumerate(results) if r.is_lost] == list(range(100, 105))
    assert set(results[99].ids) == set(results[106].ids) != set()


@pytest.mark.long
def test_frames_lost_in_the_startup_keep_their_place() -> None:
    lost = [3, 4, 20, 51, 52]
    results = watch(GivenMotion(lost), 60)
    assert [r.t_us for r in results] == [40_000 * k for k in range(60)]
    assert [k for k, r in enumerate(results) if r.is_lost] == lost


@pytest.mark.long
def test_flood_of_differences_counts_as_lost() -> None:
    # The maps are right, but the picture shows something else: a hand before the lens, say.
    results = watch(GivenMotion(), 110, blank=range(100, 105))
    assert [k for k, r in enumerate(results) if r.is_lost] == list(range(100, 105))


def test_no_road_in_reach_is_refused() -> None:
    far = np.add(ROAD, [0.0, 5_000.0])
    with pytest.raises(VisionError, match=r"expected road within 40\.0 m of the first view, got none"):
        moving_camera(drift(0), [far], SIZE, GivenMotion(), reach_m=40.0)


def test_sign_of_the_map_does_not_matter() -> None:
    assert np.array_equal(facing(drift(5)), facing(-drift(5)))


def test_a_view_that_is_never_known_is_told_as_lost_all_the_time() -> None:
    results = watch(GivenMotion(lost=range(30)), 30)
    assert [(one.t_us, one.is_lost, len(one.ids)) for one in results] == [(40_000 * k, True, 0) for k in range(30)]
