"""How far does the height of a vehicle smear it over the road, and to which side? Seen slantwise, it covers ground.

A camera that looks across the road sees the roof of a car project onto road behind it. On the rectified road the car
is then longer than it is: every point moves away from the camera by its height over the tangent of the viewing angle.
The near end still stands where the car stands, so a footprint is what remains when the smear is cut off the far end.
Where the smear is longer than a car, the car's own length cannot be seen, and a usual car is assumed.
"""

import numpy as np

from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes, axis
from vision.road.kinds import TRUCK, heights_m
from vision.road.view import GroundView
from vision.settings import VisionSettings


class Parallax:
    """The smear of vehicles of usual height, for one camera.

    Parameters
    ----------
    view : of the camera.
    settings : height and size of a usual vehicle.

    Attributes
    ----------
    is_steep : whether the camera looks straight down all over the view: nothing leans.
    lean : as of the view.
    """

    def __init__(self, view: GroundView, settings: VisionSettings) -> None:
        self.lean = view.lean
        self._settings = settings
        low, high = view.extent()
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 2)
        self._places_m = np.concatenate([corners, (low + high)[None] / 2])
        self.is_steep = not np.any(self.lean(self._places_m))

    def reach_m(self) -> FloatArray:
        """List how far trucks lean, at some places all over the view: (k, 2)."""
        return TRUCK.height_m * self.lean(self._places_m)

    def footprints(self, seen: Boxes) -> Boxes:
        """Cut the smear off boxes around what is seen.

        Parameters
        ----------
        seen : boxes measured on the rectified road.

        Returns
        -------
        Boxes on the ground; the side towards the camera stays where it is.
        """
        if self.is_steep or len(seen) == 0:
            return seen
        # The middle of what is seen lies half the smear behind the footprint's middle.
        usual, least = self._settings, self._settings.road
        shift_m = usual.usual_height_m * self.lean(seen.centre_m) / 2
        lean = self.lean(seen.centre_m - shift_m)
        along, across = _turn(lean, seen.heading_rad)
        height_m = heights_m(seen.length_m - usual.usual_height_m * np.abs(along))
        # Where a car's smear is longer than the car, what is seen says nothing of its size.
        hidden = np.abs([along, across]) > usual.usual_length_m / usual.usual_height_m
        along, across = height_m * along, height_m * across
        length_m = _cut(seen.length_m, np.abs(along), usual.usual_length_m, least.least_length_m, hidden[0])
        width_m = _cut(seen.width_m, np.abs(across), usual.usual_width_m, least.least_width_m, hidden[1])
        ahead = axis(seen.heading_rad) * (np.sign(along) * (seen.length_m - length_m) / 2)[:, None]
        left = axis(seen.heading_rad + np.pi / 2) * (np.sign(across) * (seen.width_m - width_m) / 2)[:, None]
        return Boxes(seen.centre_m - ahead - left, seen.heading_rad, length_m, width_m)

    def appearances(self, footprints: Boxes) -> Boxes:
        """Predict what is seen of boxes on the ground.

        Parameters
        ----------
        footprints : boxes on the ground.

        Returns
        -------
        Boxes with their smear.
        """
        if self.is_steep or len(footprints) == 0:
            return footprints
        smear_m = heights_m(footprints.length_m)[:, None] * self.lean(footprints.centre_m)
        along, across = _turn(smear_m, footprints.heading_rad)
        return Boxes(
            footprints.centre_m + smear_m / 2,
            footprints.heading_rad,
            footprints.length_m + np.abs(along),
            footprints.width_m + np.abs(across),
        )


def _cut(seen_m: FloatArray, smear_m: FloatArray, usual_m: float, least_m: float, is_hidden: BoolArray) -> FloatArray:
    """Take smears off lengths; of what is hidden by them the usual length is assumed."""
    return np.minimum(np.where(is_hidden, usual_m, np.maximum(seen_m - smear_m, least_m)), seen_m)


def _turn(vector_m: FloatArray, heading_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split vectors into their parts along and across headings."""
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    return vector_m[:, 0] * cos + vector_m[:, 1] * sin, vector_m[:, 1] * cos - vector_m[:, 0] * sin
