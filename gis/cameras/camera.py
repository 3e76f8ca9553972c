"""Which ground point does a pixel show, and which pixel shows a ground point?

The ground is a plane, so the map is a homography, after which a lens may bend the picture. The homography has a sign:
on one side of the horizon a camera above the ground sees it unmirrored (x to the right and y down in the image, x east
and y north on the ground), and only that side is ground. The matrix is kept so that the third homogeneous coordinate is
positive there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from gis.cameras.homography import fit_camera, transform
from gis.cameras.lens import Lens
from gis.errors import GisError
from gis.polyline import FloatArray

Fit = Callable[[FloatArray, FloatArray], tuple[FloatArray, Lens | None]]

# Marks clicked by hand in a small image are a few pixels off; past this a pair is wrong.
MAX_RESIDUAL_PX = 10.0
# The border of a picture that a lens bends is followed in so many steps a side.
_BENT_STEPS = 24
# Ground this many times farther away than the nearest is too coarse to be of use.
MAX_DEPTH_RATIO = 50.0


@dataclass(frozen=True, slots=True, eq=False)
class GroundCamera:
    """A fixed camera over a flat ground.

    Attributes
    ----------
    ground_from_pixel : (3, 3), maps homogeneous pixels to homogeneous ground metres; positive third coordinate on
        the ground side of the horizon.
    lens : bends the picture, so that pixels must be straightened before the homography; None for a straight one.

    Examples
    --------
    >>> camera = GroundCamera.from_homography([[0.5, 0.0, 100.0], [0.0, -0.5, 80.0], [0.0, 0.0, 1.0]])
    >>> camera.to_ground([[10.0, 20.0]]).tolist()
    [[105.0, 70.0]]
    >>> camera.to_pixels([[105.0, 70.0]]).tolist()
    [[10.0, 20.0]]
    """

    ground_from_pixel: FloatArray
    lens: Lens | None = None

    @classmethod
    def from_homography(cls, ground_from_pixel: ArrayLike, lens: Lens | None = None) -> GroundCamera:
        """Take a camera from its matrix.

        Parameters
        ----------
        ground_from_pixel : (3, 3), any scale; of straightened pixels where there is a lens.
        lens : None for a straight one.

        Raises
        ------
        GisError
            If it is not a finite, invertible 3 x 3 matrix, or a mirrored one (y must be north, not south).
        """
        matrix = _as_matrix(ground_from_pixel)
        if np.linalg.det(matrix) > 0:
            matrix = -matrix
        if (matrix[2, :2] == 0).all() and matrix[2, 2] < 0:
            expected = "x right and y down in the image to become x east and y north on the ground"
            raise GisError(f"camera: expected {expected}, got a mirrored homography {matrix.tolist()!r}")
        matrix.flags.writeable = False
        return cls(matrix, lens)

    @classmethod
    def from_point_pairs(
        cls,
        pixels_px: ArrayLike,
        ground_m: ArrayLike,
        *,
        max_residual_px: float = MAX_RESIDUAL_PX,
        size_px: tuple[int, int] | None = None,
        radial: float | None = None,
    ) -> GroundCamera:
        """Fit a camera to points whose pixel and ground position are both known.

        Parameters
        ----------
        pixels_px : (n, 2), n >= 4, spread over the image rather than along one line.
        ground_m : (n, 2), the same points on the ground.
        max_residual_px : how far the fitted camera may put a point beside its pixel.
        size_px, radial : size of the picture, and what is known of its lens; see `gis.cameras.homography.fit_camera`.

        Raises
        ------
        GisError
            If there are fewer than four pairs, they lie on one line, a point is outside of the picture, no plane
            explains them within `max_residual_px` (the message names each pair's residual), or the ground is mirrored.

        Examples
        --------
        >>> camera = GroundCamera.from_point_pairs(
        ...     [[0, 0], [100, 0], [100, 100], [0, 100]], [[0, 50], [50, 50], [50, 0], [0, 0]])
        >>> camera.to_ground([[50.0, 50.0]]).round(6).tolist()
        [[25.0, 25.0]]
        """
        pixels_px, ground_m = _as_points(pixels_px), _as_points(ground_m)
        _check_inside(pixels_px, size_px)
        fit = partial(fit_camera, size_px=size_px, radial=radial)
        inverse, lens = fit(ground_m, pixels_px)
        residuals_px = _residuals(inverse, lens, pixels_px, ground_m)
        # Written so that a residual of nan, from a point on the horizon, fails too.
        if not (residuals_px <= max_residual_px).all():
            expected = f"point pairs that one camera explains within {max_residual_px:g} px"
            came = _describe_residuals(residuals_px, pixels_px, ground_m, fit)
            raise GisError(f"camera: expected {expected}, got {came}")
        camera = cls.from_homography(np.linalg.inv(inverse), lens)
        _check_side(camera, pixels_px)
        return camera

    @property
    def pixel_from_ground(self) -> FloatArray:
        """The inverse map, (3, 3), positive third coordinate in front of the camera; to the straight picture."""
        return np.asarray(np.linalg.inv(self.ground_from_pixel), dtype=np.float64)

    def to_ground(self, points_px: ArrayLike) -> FloatArray:
        """Map pixels to the ground.

        Parameters
        ----------
        points_px : (n, 2).

        Returns
        -------
        (n, 2) metres; nan for a pixel on or above the horizon.
        """
        return _apply(self.ground_from_pixel, self._straight(points_px))

    def to_pixels(self, points_m: ArrayLike) -> FloatArray:
        """Map ground points to pixels.

        Parameters
        ----------
        points_m : (n, 2).

        Returns
        -------
        (n, 2) pixels, also outside the image; nan for a point behind the camera.
        """
        straight_px = _apply(self.pixel_from_ground, points_m)
        return straight_px if self.lens is None else self.lens.bend(straight_px)

    def metres_per_pixel(self, points_m: ArrayLike) -> FloatArray:
        """Tell how large a pixel is on the ground: the root of its area.

        Parameters
        ----------
        points_m : (n, 2).

        Returns
        -------
        (n,) metres; nan for a point behind the camera.
        """
        inverse = self.pixel_from_ground
        depth = _homogeneous(points_m) @ inverse[2]
        # The map (x, y) -> pixel has the Jacobian determinant det(inverse) / depth^3.
        with np.errstate(invalid="ignore"):
            area = np.where(depth > 0, depth, np.nan) ** 3 / abs(np.linalg.det(inverse))
        if self.lens is not None:
            area = area / np.linalg.det(self.lens.derivative(_apply(inverse, points_m)))
        return np.asarray(np.sqrt(area), dtype=np.float64)

    def view_outline(self, width_px: int, height_px: int) -> FloatArray:
        """Draw what the image shows on the ground.

        Parameters
        ----------
        width_px, height_px : image size.

        Returns
        -------
        (n, 2) metres, counter-clockwise, open. Four corners, starting with the image's top left one; where the
        horizon is in the image, three to five, and the view ends where the ground is `MAX_DEPTH_RATIO` times as
        far away as at the nearest corner.

        Raises
        ------
        GisError
            If the image shows no ground.

        Examples
        --------
        >>> camera = GroundCamera.from_homography([[0.5, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 1.0]])
        >>> camera.view_outline(100, 60).tolist()
        [[-0.25, 0.25], [-0.25, -29.75], [49.75, -29.75], [49.75, 0.25]]
        """
        left, top, right, bottom = -0.5, -0.5, width_px - 0.5, height_px - 0.5
        border_px = np.array([[left, top], [left, bottom], [right, bottom], [right, top]])
        if self.lens is not None:
            share = np.linspace(0, 1, _BENT_STEPS, endpoint=False)[:, None]
            sides = zip(border_px, np.roll(border_px, -1, axis=0), strict=True)
            border_px = self.lens.straighten(np.concatenate([start + share * (end - start) for start, end in sides]))
        nearness = _homogeneous(border_px) @ self.ground_from_pixel[2]
        if nearness.max() <= 0:
            raise GisError(f"camera: expected ground in the {width_px} x {height_px} image, got only sky")
        return _apply(self.ground_from_pixel, clip_ring(border_px, nearness - nearness.max() / MAX_DEPTH_RATIO))

    def _straight(self, points_px: ArrayLike) -> ArrayLike:
        return points_px if self.lens is None else self.lens.straighten(_as_points(points_px))


def _check_inside(pixels_px: FloatArray, size_px: tuple[int, int] | None) -> None:
    if size_px is None:
        return
    inside = ((pixels_px >= -0.5) & (pixels_px <= np.array(size_px) - 0.5)).all(axis=1)
    if not inside.all():
        number = int(np.argmin(inside)) + 1
        expected = f"pixels inside the picture of {size_px[0]} x {size_px[1]} px"
        raise GisError(f"camera: expected {expected}, got pair {number} at {pixels_px[number - 1].tolist()!r}")


def _residuals(inverse: FloatArray, lens: Lens | None, pixels_px: FloatArray, ground_m: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore"):
        straight_px = transform(inverse, ground_m)
        seen_px = straight_px if lens is None else lens.bend(straight_px)
        return np.asarray(np.hypot(*(seen_px - pixels_px).T), dtype=np.float64)


def _describe_residuals(residuals_px: FloatArray, pixels_px: FloatArray, ground_m: FloatArray, fit: Fit) -> str:
    listed = ", ".join(f"{residual:.1f}" for residual in residuals_px)
    said = f"these residuals in px, pair by pair: {listed}"
    # Least squares spreads the error of one wrong pair over all; what is left without a pair tells more. Any four
    # pairs fit, so this takes six.
    if len(residuals_px) < 6:
        return said
    without_px = [_worst_without(place, pixels_px, ground_m, fit) for place in range(len(residuals_px))]
    suspect = int(np.argmin(without_px))
    if not np.isfinite(without_px[suspect]):
        return said
    return f"{said}; without pair {suspect + 1} the others are within {without_px[suspect]:.1f} px"


def _worst_without(place: int, pixels_px: FloatArray, ground_m: FloatArray, fit: Fit) -> float:
    pixels_px, ground_m = np.delete(pixels_px, place, axis=0), np.delete(ground_m, place, axis=0)
    try:
        worst_px = float(_residuals(*fit(ground_m, pixels_px), pixels_px, ground_m).max())
    except GisError:
        return np.inf
    return worst_px if np.isfinite(worst_px) else np.inf


def _check_side(camera: GroundCamera, pixels_px: FloatArray) -> None:
    is_ground = np.isfinite(camera.to_ground(pixels_px)).all(axis=1)
    if is_ground.all():
        return
    if not is_ground.any():
        raise GisError("camera: expected ground_m with x east and y north, got points that form a mirror image of it")
    above = [int(place) + 1 for place in np.flatnonzero(~is_ground)]
    raise GisError(f"camera: expected all points on one side of the horizon, got points {above!r} beyond it")


def clip_ring(ring: FloatArray, height: FloatArray) -> FloatArray:
    """Keep the part of a ring, (n, k), where a linear function, (n,) at its corners, is >= 0; it may be empty."""
    kept: list[FloatArray] = []
    for here, after in zip(range(len(ring)), [*range(1, len(ring)), 0], strict=True):
        if height[here] >= 0:
            kept.append(ring[here])
        if (height[here] >= 0) != (height[after] >= 0):
            share = height[here] / (height[here] - height[after])
            kept.append(ring[here] + share * (ring[after] - ring[here]))
    return np.array(kept).reshape(-1, ring.shape[1])


def _as_matrix(values: ArrayLike) -> FloatArray:
    try:
        matrix = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise GisError(f"camera: expected a homography of 3 rows of 3 numbers, got {values!r}") from error
    if matrix.shape != (3, 3):
        raise GisError(f"camera: expected a homography of shape (3, 3), got shape {matrix.shape!r}")
    # Any scale is the same camera; a power of two keeps every digit, and no product overflows.
    scaled = np.ldexp(matrix, -int(np.frexp(np.abs(matrix).max())[1]))
    if not np.isfinite(matrix).all() or not _is_invertible(scaled):
        raise GisError(f"camera: expected a finite, invertible homography, got {matrix.tolist()!r}")
    return scaled


def _is_invertible(matrix: FloatArray) -> bool:
    """Judge a matrix as if the origin lay where pixel (0, 0) looks, in units that make all rows and columns alike.

    Grid coordinates are millions of metres and pixels may be millimetres: that alone is no singularity.
    """
    origin_m = matrix[:2, 2] / matrix[2, 2] if matrix[2, 2] != 0 else np.zeros(2)
    near = matrix - np.outer([*origin_m, 0.0], matrix[2])
    for axis in (1, 0):
        largest = np.abs(near).max(axis=axis, keepdims=True)
        if (largest == 0).any():
            return False
        near = near / largest
    return bool(abs(np.linalg.det(near)) > 1e-9)


def _as_points(points: ArrayLike) -> FloatArray:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2:
        raise GisError(f"camera: expected points of shape (n, 2), got shape {array.shape!r}")
    return array


def _homogeneous(points: ArrayLike) -> FloatArray:
    array = _as_points(points)
    return np.column_stack((array, np.ones(len(array))))


def _apply(matrix: FloatArray, points: ArrayLike) -> FloatArray:
    mapped = _homogeneous(points) @ matrix.T
    depth = mapped[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(depth > 0, mapped[:, :2] / depth, np.nan), dtype=np.float64)
