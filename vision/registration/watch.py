"""Does a camera move, though nobody said so? Its first picture, looked for again a few times a second.

Mostly the corners of the first picture look as they did, and more so than a step to any side, and that is all. Else the
picture is followed as a moving camera's would be (`registration.py`). What that finds may be the motion of traffic that
fills the picture, so the corners decide: each says whether what is around it is seen again where it was, or where the
followed motion has brought it. A corner that something covers says neither.
"""

from typing import Final

import numpy as np

from vision.objects import BoolArray, ByteArray, FloatArray
from vision.registration.key_frames import corners_of, half_size
from vision.registration.plane_fit import transform
from vision.registration.registration import Registration, likeness, patches, surroundings
from vision.registration.settings import RegistrationSettings
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frame import Frame

SIDES: Final = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def noticed_px(pixel_from_ground: FloatArray, image_size_px: tuple[int, int], settings: VisionSettings) -> float:
    """Tell from how many pixels on a shift matters.

    Where vehicles are large, a small one moves nobody elsewhere; where they are a few pixels wide, it moves them into
    the next lane.

    Parameters
    ----------
    pixel_from_ground : (3, 3) of the first picture.
    image_size_px : (width, height).
    settings : the usual car, what counts as a shift.
    """
    view = GroundView(pixel_from_ground, image_size_px, settings)
    width, height = image_size_px
    lattice_px = np.stack(np.meshgrid(np.linspace(0, width - 1, 9), np.linspace(0, height - 1, 9)), axis=-1)
    ground_m, is_ground = view.to_ground(lattice_px.reshape(-1, 2))
    scales = view.sight(ground_m[is_ground]).across_m
    scales = scales[scales <= settings.max_metres_per_pixel]
    numbers = settings.registration
    if len(scales) == 0:
        return numbers.moved_px
    car_px = settings.car_width_m / float(np.median(scales))
    return max(numbers.moved_widths * car_px, min(numbers.moved_px, numbers.moved_most_widths * car_px))


class MovementWatch:
    """Compares the pictures of a camera with its first one.

    Parameters
    ----------
    image_size_px : (width, height).
    settings : of this room.
    least_px : a smaller shift is none.

    Attributes
    ----------
    present_from_first : (3, 3) map from pixels of the first picture to those of the one last looked at, where it is
        known; else that of the one before.
    """

    def __init__(self, image_size_px: tuple[int, int], settings: RegistrationSettings, *, least_px: float) -> None:
        self._least_px = least_px
        self._settings = settings
        self._size_px = np.array(image_size_px, np.float64)
        # The first picture's pixels take the place of the ground.
        self._registration = Registration(np.eye(3), image_size_px, settings)
        self._corners_px: FloatArray | None = None
        self._first_patches = np.zeros((0, 0), np.float32)
        self._places = np.zeros((0, 0, 0, 2), np.float32)
        self._looked_us: int | None = None
        self._moved_looks = 0
        self.present_from_first: FloatArray = np.eye(3)

    def look(self, frame: Frame) -> bool:
        """Look at a picture, if the last look was long enough ago.

        Parameters
        ----------
        frame : later than the one before.

        Returns
        -------
        Whether the camera has moved for some looks in a row.
        """
        if self._looked_us is None or frame.t_us - self._looked_us >= self._settings.watch_us:
            self._looked_us = frame.t_us
            luma = half_size(frame.luma)
            if self._corners_px is None:
                self._registration.locate(frame, ())
                self._corners_px = corners_of(luma, (), self._settings)
                # Around the corners, and some pixels away to each side.
                self._places = surroundings(self._corners_px + self._least_px * SIDES[:, None])
                self._first_patches = patches(luma, self._places[0])
            self._moved_looks = self._moved_looks + 1 if self._has_moved(self._corners_px, luma, frame) else 0
        return self._moved_looks >= self._settings.watch_looks

    def _has_moved(self, corners_px: FloatArray, luma: ByteArray, frame: Frame) -> bool:
        settings, first = self._settings, self._first_patches
        there, *beside = likeness(first, patches(luma, self._places))
        # Blurred ones look nearly as they did from two pixels away.
        is_better_beside = any(_most(one > there) for one in beside)
        if _most(there >= settings.least_likeness) and not is_better_beside:
            return False
        found = self._registration.locate(frame, ())
        if found is None:
            return False
        self.present_from_first = found
        moved_px = transform(self.present_from_first, corners_px)
        shift_px = np.hypot(*(moved_px - corners_px).T)
        is_in_view = ((moved_px >= 0) & (moved_px <= self._size_px - 1)).all(axis=1)
        if not is_in_view.any() or np.median(shift_px[is_in_view]) < self._least_px:
            return False
        moved = likeness(first, patches(luma, surroundings(moved_px)))
        says_moved = is_in_view & (moved >= settings.least_likeness) & (moved > there)
        says_stood = (there >= settings.least_likeness) & (there >= moved)
        voters = np.count_nonzero(says_moved) + np.count_nonzero(says_stood)
        return bool(voters >= settings.least_inliers and np.count_nonzero(says_moved) >= settings.moved_share * voters)


def _most(of: BoolArray) -> bool:
    return bool(2 * np.count_nonzero(of) > len(of))
