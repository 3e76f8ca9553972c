"""Which ground does a fixed camera see, and how finely? Geometry of one plane homography, and of a lens after it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vision.errors import VisionError
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes
from vision.settings import VisionSettings

# The extent of the seen ground is sampled on image positions this far apart.
STEP_PX = 8.0


class Lens(Protocol):
    """How a lens bends the picture of a homography. Points are (..., 2) pixels."""

    def straighten(self, points_px: FloatArray) -> FloatArray:
        """Move pixels to where a straight lens has them."""

    def bend(self, points_px: FloatArray) -> FloatArray:
        """Move them back; what is outside of the picture stays outside."""

    def derivative(self, points_px: FloatArray) -> FloatArray:
        """Differentiate `bend` at points of the straight picture: (..., 2, 2)."""


@dataclass(frozen=True, slots=True)
class Sight:
    """How the camera sees the ground around some points.

    Attributes
    ----------
    across_m : (n,) metres per pixel across the line of sight.
    along_m : (n,) metres per pixel along it; more, the more slanting the view.
    away : (n, 2) unit vectors on the ground, along the line of sight, away from the camera.
    up_px : (n, 2) by how much in the picture what is a metre above the ground is seen elsewhere.
    steep_sine : of the viewing angle; above it the scales are taken for equal.
    """

    across_m: FloatArray
    along_m: FloatArray
    away: FloatArray
    up_px: FloatArray
    steep_sine: float

    def smear_m(self, height_m: float) -> FloatArray:
        """Measure over how much ground an upright thing is projected, if it is low beside the camera.

        Parameters
        ----------
        height_m : of the thing.

        Returns
        -------
        (n,) metres along `away`; 0 where the view is so steep that the scales cannot tell.
        """
        return np.asarray(height_m * np.hypot(*self.up_px.T) * self.along_m)


class GroundView:
    """The part of the ground plane in front of the camera, inside the image, and fine enough.

    The sign of the homography is fixed so that the third coordinate is positive in front of the camera: with a
    right-handed ground (x east, y north) seen from above, that is the sign with a negative determinant.
    """

    def __init__(
        self,
        pixel_from_ground: FloatArray,
        image_size_px: tuple[int, int],
        settings: VisionSettings,
        lens: Lens | None = None,
    ) -> None:
        matrix = np.asarray(pixel_from_ground, np.float64)
        if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)) or np.linalg.matrix_rank(matrix) < 3:
            raise VisionError(f"camera: expected an invertible (3, 3) homography, got {pixel_from_ground!r}")
        if min(image_size_px) < 2:
            raise VisionError(f"camera: expected an image of at least 2 x 2 px, got {image_size_px!r}")
        determinant = np.linalg.det(matrix)
        self._matrix = -matrix if determinant > 0 else matrix
        self._lens = lens
        self._inverse = np.linalg.inv(self._matrix)
        self._scale = 1.0 / np.sqrt(abs(determinant))
        self._last_px = np.array([image_size_px[0] - 1.0, image_size_px[1] - 1.0])
        self._max_metres_per_pixel = settings.max_metres_per_pixel
        self._steep_sine = settings.road.steep_sine

    def to_pixels(self, points_m: FloatArray) -> FloatArray:
        """Project ground points in front of the camera; others get meaningless positions.

        Parameters
        ----------
        points_m : (..., 2).

        Returns
        -------
        (..., 2) pixels.
        """
        straight = self._to_straight(points_m)
        return straight if self._lens is None else self._lens.bend(straight)

    def lean(self, points_m: FloatArray) -> FloatArray:
        """Measure how far a metre of height shifts what is seen.

        Parameters
        ----------
        points_m : (n, 2) on the ground.

        Returns
        -------
        (n, 2) metres, away from the camera.
        """
        sight = self.sight(points_m)
        return sight.away * sight.smear_m(1.0)[:, None]

    def metres_per_pixel(self, points_m: FloatArray) -> FloatArray:
        """Measure how much ground a pixel covers, as the side of a square of that area.

        Parameters
        ----------
        points_m : (..., 2).

        Returns
        -------
        (...,) metres; infinite at and behind the horizon.
        """
        depth = self._depths(points_m)
        scale = np.where(depth > 0, np.maximum(depth, 0.0) ** 1.5 * self._scale, np.inf)
        if self._lens is None:
            return scale
        return np.asarray(scale / np.sqrt(np.linalg.det(self._lens.derivative(self._to_straight(points_m)))))

    def sees(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground points are in view and fine enough.

        Parameters
        ----------
        points_m : (..., 2).

        Returns
        -------
        (...,).
        """
        is_fine = self.metres_per_pixel(points_m) <= self._max_metres_per_pixel
        pixels = self.to_pixels(points_m)
        return np.asarray(is_fine & np.all((pixels >= 0) & (pixels <= self._last_px), axis=-1))

    def to_ground(self, pixels: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Find the ground that pixels show.

        Parameters
        ----------
        pixels : (..., 2).

        Returns
        -------
        (..., 2) metres, and (...,) False for pixels at or above the horizon.
        """
        pixels = pixels if self._lens is None else self._lens.straighten(pixels)
        homogeneous = pixels @ self._inverse[:, :2].T + self._inverse[:, 2]
        is_below = homogeneous[..., 2] > 0
        return homogeneous[..., :2] / np.where(is_below, homogeneous[..., 2], 1.0)[..., None], is_below

    def sight(self, points_m: FloatArray) -> Sight:
        """Describe how the ground around points is foreshortened.

        The scales are those of the homography's derivative: for a small angle of view their ratio is the sine of the
        angle under which the camera looks at the ground there.

        Parameters
        ----------
        points_m : (n, 2) on the ground, in front of the camera.

        Returns
        -------
        The two scales, the direction away from the camera, and that of height.
        """
        depth = np.maximum(self._depths(points_m), 1e-12)
        pixels = self._to_straight(points_m)
        derivative = (self._matrix[:2, :2] - pixels[:, :, None] * self._matrix[2, :2]) / depth[:, None, None]
        if self._lens is not None:
            derivative = self._lens.derivative(pixels) @ derivative
        across, stretch, axes = np.linalg.svd(derivative)
        away, up = axes[:, 1], across[:, :, 1]
        # Farther means deeper; where depth does not change over the view, it means higher up in the image.
        farther = np.broadcast_to(self._matrix[2, :2], away.shape)
        if np.allclose(self._matrix[2, :2] / self._matrix[2, 2], 0.0, atol=1e-9):
            farther = -derivative[:, 1]
        sign = np.where(np.einsum("ni,ni->n", away, farther) < 0, -1.0, 1.0)
        along_m = 1 / np.maximum(stretch[:, 1], 1e-12)
        # Their ratio is the sine of the angle between ground and line of sight; height is foreshortened by the cosine.
        sine = stretch[:, 1] / stretch[:, 0]
        rise = np.where(sine < self._steep_sine, np.sqrt(np.maximum(1 - sine**2, 0.0)) * stretch[:, 0], 0.0)
        return Sight(1 / stretch[:, 0], along_m, away * sign[:, None], up * (sign * rise)[:, None], self._steep_sine)

    def corners_px(self, footprints: Boxes, height_m: FloatArray) -> FloatArray:
        """Project bodies that stand on the ground, in front of the camera.

        Parameters
        ----------
        footprints : n boxes.
        height_m : (n,).

        Returns
        -------
        (n, 8, 2) pixels: four corners at the foot, then those at the top.
        """
        corners_m = footprints.corners()
        foot_px = self.to_pixels(corners_m)
        # A metre is the higher, the nearer it stands.
        nearer = self._depths(footprints.centre_m)[:, None] / np.maximum(self._depths(corners_m), 1e-12)
        up_px = self.sight(footprints.centre_m).up_px * height_m[:, None]
        return np.concatenate([foot_px, foot_px + nearer[:, :, None] * up_px[:, None]], axis=1)

    def _depths(self, points_m: FloatArray) -> FloatArray:
        """Give the distances along the optical axis, (...,), in a unit of their own."""
        return np.asarray(points_m @ self._matrix[2, :2] + self._matrix[2, 2])

    def _to_straight(self, points_m: FloatArray) -> FloatArray:
        homogeneous = points_m @ self._matrix[:, :2].T + self._matrix[:, 2]
        return np.asarray(homogeneous[..., :2] / np.maximum(homogeneous[..., 2:], 1e-12))

    def extent(self) -> tuple[FloatArray, FloatArray]:
        """Bound the seen ground.

        Returns
        -------
        (2,) lowest and (2,) highest x, y of the ground in view.

        Raises
        ------
        VisionError
            If no pixel shows ground finely enough.
        """
        ground_m = self.seen_ground()
        return ground_m.min(axis=0), ground_m.max(axis=0)

    def seen_ground(self) -> FloatArray:
        """Project a grid of image positions to the ground.

        Returns
        -------
        (n, 2) metres, only where the ground is seen finely enough.

        Raises
        ------
        VisionError
            If that is nowhere.
        """
        axes = [np.linspace(0.0, last, max(2, int(last / STEP_PX))) for last in self._last_px]
        pixels = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        ground_m, is_below = self.to_ground(pixels)
        ground_m = ground_m[is_below]
        scale = self.metres_per_pixel(ground_m)
        ground_m = ground_m[scale <= self._max_metres_per_pixel]
        if len(ground_m) == 0:
            best = float(scale.min()) if len(scale) else float("inf")
            raise VisionError(
                f"camera: expected ground at {self._max_metres_per_pixel} m per pixel or finer, got {best:.3g} at best"
            )
        return np.asarray(ground_m)
