"""Key frames: where their corners are, and finding them in other pictures."""

import numpy as np

from tests.vision.moving_world import MovingWorld, first_key, view
from vision.registration.key_frames import KeyFrame, Landmarks, half_size, to_full, to_half
from vision.registration.plane_fit import transform
from vision.registration.settings import RegistrationSettings

SETTINGS = RegistrationSettings()


def test_no_corner_is_taken_on_a_vehicle() -> None:
    luma = half_size(MovingWorld().frame(view(), 0).luma)
    outline = np.array([[80.0, 40.0], [240.0, 40.0], [240.0, 140.0], [80.0, 140.0]])

    def inside(frame: KeyFrame) -> int:
        return int(np.all((frame.corners_px > outline[0]) & (frame.corners_px < outline[2]), axis=1).sum())

    assert inside(first_key(luma, [], SETTINGS)) > 5
    masked = first_key(luma, [outline], SETTINGS)
    assert inside(masked) == 0
    assert len(masked.corners_px) > 20


def test_half_size_and_back_is_identity() -> None:
    points = np.array([[0.0, 0.0], [13.5, 7.25]])
    assert np.allclose(to_full(to_half(points)), points)


def test_half_size_pixel_is_the_mean_of_four() -> None:
    luma = np.arange(30, dtype=np.uint8).reshape(5, 6)  # an odd row is left out
    assert half_size(luma).tolist() == [[4, 6, 8], [16, 18, 20]]


def test_following_needs_a_guess_some_pixels_near() -> None:
    world = MovingWorld()
    key = first_key(half_size(world.frame(view(), 0).luma), [], SETTINGS)
    there = view(east_m=4.0, north_m=1.0)
    fit, expected = key.follow(half_size(world.frame(there, 1).luma), view(), SETTINGS)
    assert fit is not None
    assert fit.is_inlier.sum() > 0.8 * expected
    moved = transform(there @ np.linalg.inv(view()), key.corners_px)
    assert np.abs(transform(fit.matrix, key.corners_px) - moved).max() < 0.7


def test_key_frame_out_of_view_expects_nothing() -> None:
    world = MovingWorld()
    key = first_key(half_size(world.frame(view(), 0).luma), [], SETTINGS)
    assert key.follow(half_size(world.frame(view(), 1).luma), view(east_m=5_000.0), SETTINGS) == (None, 0)


def test_landmarks_guess_a_turned_and_shifted_view() -> None:
    world = MovingWorld()
    key = first_key(half_size(world.frame(view(), 0).luma), [], SETTINGS)
    other = first_key(half_size(MovingWorld(seed=12).frame(view(), 0).luma), [], SETTINGS)
    there = view(east_m=12.0, turn_rad=0.5)
    guesses = Landmarks(SETTINGS).guess(half_size(world.frame(there, 1).luma), [other, key])
    assert [frame is key for frame, _ in guesses] == [True]
    centre = np.array([[160.0, 90.0]])
    assert np.abs(transform(guesses[0][1] @ np.linalg.inv(there), centre) - centre).max() < 6
