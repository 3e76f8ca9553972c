"""Where are oriented boxes on the ground, and which points do they cover? The shape shared by vision's stages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.objects import FloatArray, Table


@dataclass(frozen=True, slots=True)
class Boxes(Table):
    """Oriented boxes on the ground, one row each.

    Attributes
    ----------
    centre_m : (n, 2) x east, y north.
    heading_rad : (n,) direction of the length, 0 east, counter-clockwise.
    length_m, width_m : (n,).
    """

    centre_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray

    def __len__(self) -> int:
        return len(self.heading_rad)

    @classmethod
    def none(cls) -> Boxes:
        """Make the empty set of boxes."""
        nothing = np.zeros(0)
        return cls(np.zeros((0, 2)), nothing, nothing, nothing)

    def corners(self, margin_m: float = 0.0) -> FloatArray:
        """Compute the corners of every box.

        Parameters
        ----------
        margin_m : how much every side is moved outwards.

        Returns
        -------
        (n, 4, 2), counter-clockwise from the front left.

        Examples
        --------
        >>> box = Boxes(np.array([[1.0, 2.0]]), np.array([0.0]), np.array([4.0]), np.array([2.0]))
        >>> box.corners()[0].tolist()
        [[3.0, 3.0], [-1.0, 3.0], [-1.0, 1.0], [3.0, 1.0]]
        """
        ahead = axis(self.heading_rad) * (self.length_m / 2 + margin_m)[:, None]
        left = axis(self.heading_rad + np.pi / 2) * (self.width_m / 2 + margin_m)[:, None]
        around = np.empty((len(self), 4, 2))
        np.add(ahead, left, out=around[:, 0])
        np.subtract(left, ahead, out=around[:, 1])
        np.negative(around[:, :2], out=around[:, 2:])
        around += self.centre_m[:, None, :]
        return np.asarray(around.round(9))


def axis(heading_rad: FloatArray) -> FloatArray:
    """Turn directions into unit vectors.

    Parameters
    ----------
    heading_rad : (n,).

    Returns
    -------
    (n, 2) east, north.
    """
    # Called some thirty times a frame for few boxes: `np.stack` would cost more than both functions.
    unit = np.empty((len(heading_rad), 2))
    np.cos(heading_rad, out=unit[:, 0])
    np.sin(heading_rad, out=unit[:, 1])
    return unit


def distance_to_boxes(points_m: FloatArray, boxes: Boxes) -> FloatArray:
    """Measure how far points lie outside boxes, in the boxes' own axes.

    Parameters
    ----------
    points_m : (p, 2).
    boxes : n boxes.

    Returns
    -------
    (p, n) metres by the larger of the two overhangs (Chebyshev distance); negative inside, least at the middle line.

    Examples
    --------
    >>> box = Boxes(np.array([[0.0, 0.0]]), np.array([0.0]), np.array([4.0]), np.array([2.0]))
    >>> distance_to_boxes(np.array([[3.0, 0.0], [0.0, 0.5]]), box).ravel().tolist()
    [1.0, -0.5]
    """
    east = points_m[:, 0, None] - boxes.centre_m[:, 0]
    north = points_m[:, 1, None] - boxes.centre_m[:, 1]
    cos, sin = np.cos(boxes.heading_rad), np.sin(boxes.heading_rad)
    along_m = np.abs(east * cos + north * sin) - boxes.length_m / 2
    across_m = np.abs(north * cos - east * sin) - boxes.width_m / 2
    return np.asarray(np.maximum(along_m, across_m))


def wrap_angle(angle_rad: FloatArray) -> FloatArray:
    """Bring angles into (-pi, pi].

    Parameters
    ----------
    angle_rad : any shape.

    Returns
    -------
    The same directions.

    Examples
    --------
    >>> np.round(wrap_angle(np.array([3 * np.pi, -np.pi, 0.5])), 3).tolist()
    [3.142, 3.142, 0.5]
    """
    return np.asarray(np.pi - np.mod(np.pi - angle_rad, 2 * np.pi))
