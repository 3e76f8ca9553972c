"""What does a detector say that looks at pictures and knows no ground? Boxes with scores and classes.

A trained network and a file of somebody else's detections both answer in boxes, in pixels or (a file only) in metres.
`detection_ground.py` puts either on the ground, where the tracker takes them like the boxes of the motion detector.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol, TypeVar

import numpy as np

from vision.networks.settings import UsualSizes
from vision.objects import BoolArray, FloatArray, IntArray, Table

# The words for classes.
CLASS_NAMES = tuple(one.name for one in fields(UsualSizes))
UNKNOWN = CLASS_NAMES[-1]


class Instant(Protocol):
    """A moment of a source: a frame is one, and so is a line of a file without a video."""

    @property
    def index(self) -> int:
        """0, 1, 2... over the moments of the source, those included that are not looked at."""
        ...

    @property
    def t_us(self) -> int:
        """When."""
        ...


@dataclass(frozen=True, slots=True)
class Shifts(Table):
    """How far the feet of boxes have moved in the picture, one row each.

    Attributes
    ----------
    shift_px : (n, 2) x right, y down; nan where it is not known.
    noise_px : (n,) standard deviation of each coordinate.
    over_s : (n,) in which time.
    """

    shift_px: FloatArray
    noise_px: FloatArray
    over_s: FloatArray

    def __len__(self) -> int:
        return len(self.over_s)


@dataclass(frozen=True, slots=True)
class ImageBoxes(Table):
    """Boxes in one picture, one row each.

    Attributes
    ----------
    centre_px : (n, 2) x right, y down.
    size_px : (n, 2) extent along the box's own axis and across it; width and height of an upright box.
    angle_rad : (n,) of that axis, from the image's x towards its y; 0 for an upright box.
    is_oriented : (n,) True if the axis is that of the vehicle; an upright box says nothing about direction.
    score : (n,) 0 to 1: how sure the detector is.
    class_number : (n,) row of `CLASS_NAMES`.
    is_weak : (n,) True if it is too unsure to count but where a vehicle is expected; None for nowhere.
    edge_share : (n,) standard deviation of the edges, as a part of the size; None for that of the settings.
    shifts : how far their feet have moved of late; None for not known.
    """

    centre_px: FloatArray
    size_px: FloatArray
    angle_rad: FloatArray
    is_oriented: BoolArray
    score: FloatArray
    class_number: IntArray
    is_weak: BoolArray | None = None
    edge_share: FloatArray | None = None
    shifts: Shifts | None = None

    def __len__(self) -> int:
        return len(self.score)

    def evidence(self) -> FloatArray:
        """Say how much each tells for a vehicle, (n,): its score, or nothing if it is weak."""
        return self.score if self.is_weak is None else np.where(self.is_weak, 0.0, self.score)

    @classmethod
    def none(cls) -> ImageBoxes:
        """Make the empty set of boxes."""
        nothing, points = np.zeros(0), np.zeros((0, 2))
        return cls(points, points, nothing, np.zeros(0, np.bool_), nothing, np.zeros(0, np.intp))

    def bounds_px(self) -> FloatArray:
        """Bound every box upright.

        Returns
        -------
        (n, 4) left, top, right, bottom.

        Examples
        --------
        >>> one = np.ones(1)
        >>> box = ImageBoxes(
        ...     np.array([[10.0, 20.0]]), np.array([[8.0, 4.0]]), one * np.pi / 2, one > 0, one, np.zeros(1, np.intp)
        ... )
        >>> box.bounds_px().round(6).tolist()
        [[8.0, 16.0, 12.0, 24.0]]
        """
        cos, sin = np.abs(np.cos(self.angle_rad)), np.abs(np.sin(self.angle_rad))
        along, across = self.size_px.T
        reach = np.column_stack([along * cos + across * sin, along * sin + across * cos]) / 2
        return np.column_stack([self.centre_px - reach, self.centre_px + reach])


@dataclass(frozen=True, slots=True)
class GroundBoxes(Table):
    """Boxes on the ground as a file gives them, one row each; nan where it does not say.

    Attributes
    ----------
    centre_m : (n, 2) x east, y north.
    heading_rad, length_m, width_m : (n,), nan where not given.
    score, class_number : as of `ImageBoxes`.
    """

    centre_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    score: FloatArray
    class_number: IntArray

    def __len__(self) -> int:
        return len(self.score)


InstantT_contra = TypeVar("InstantT_contra", bound=Instant, contravariant=True)


class Flow(Protocol[InstantT_contra]):
    """What follows boxes back to an instant before the look at which they were seen."""

    def keep(self, instant: InstantT_contra, next_us: int) -> None:
        """Take an instant at which nobody looks; the next look is due at `next_us`."""

    def shifts(self, instant: InstantT_contra, boxes: ImageBoxes) -> Shifts | None:
        """Say how far the boxes of a look have moved; None if that cannot be told of any."""


class BoxDetector(Protocol[InstantT_contra]):
    """Anything that finds vehicles without knowing the road: a network on frames, a file at instants."""

    def detect(self, instant: InstantT_contra) -> ImageBoxes | GroundBoxes:
        """Find vehicles.

        Parameters
        ----------
        instant : the next frame, or the next moment.

        Returns
        -------
        What was found, in no order.
        """
        ...


def whole_boxes(boxes: ImageBoxes, image_size_px: tuple[int, int]) -> ImageBoxes:
    """Drop boxes that are none: not finite, without area, or with the centre farther out than the box reaches.

    Parameters
    ----------
    boxes : as they came.
    image_size_px : width and height of the picture.

    Returns
    -------
    Boxes that share ground with the picture.
    """
    values = np.column_stack([boxes.centre_px, boxes.size_px, boxes.angle_rad, boxes.score])
    is_good = np.isfinite(values).all(axis=1) & (boxes.size_px > 0).all(axis=1)
    boxes = boxes.select(np.asarray(is_good, np.bool_))
    bounds = boxes.bounds_px()
    last = np.array(image_size_px) - 0.5
    return boxes.select(np.asarray((bounds[:, 2:] > -0.5).all(axis=1) & (bounds[:, :2] < last).all(axis=1)))
