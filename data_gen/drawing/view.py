"""What does the camera of a scenario see at one instant, and which part of its image holds some points?

Of the ground that a moving camera sees all is painted once, seen from above, and warped for each frame (`Raster`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from data_gen.scenario import View
from data_gen.simulation.states import BoolArray, ByteArray, FloatArray, VehicleStates
from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraPose

_FINER = 1.15
"""The raster is this much finer than the finest frame: bilinear sampling then keeps what a lens would keep."""
_LARGEST_PX = 24_000_000

Bounds = tuple[float, float, float, float]
"""West, south, east, north."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraView:
    """A camera at one instant and its image size."""

    camera: GroundCamera
    size_px: tuple[int, int]
    """Width and height."""
    pose: CameraPose | None = None
    """Where the camera is; None for one that looks straight down from infinitely high, where heights do not show."""

    def contains(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground points lie in the image.

        Parameters
        ----------
        points_m : (n, 2), local east/north frame.

        Returns
        -------
        (n,); a point on the image border is inside.
        """
        points_px = self.camera.to_pixels(points_m)
        # Pixel centres have whole numbers: the image reaches half a pixel further.
        inside = (points_px >= -0.5) & (points_px <= np.array(self.size_px) - 0.5)
        return np.asarray(inside.all(axis=1), dtype=np.bool_)

    def touches(self, states: VehicleStates) -> BoolArray:
        """Tell which vehicles have at least one corner of the body, or the centre, in the image.

        Parameters
        ----------
        states : n vehicles.

        Returns
        -------
        (n,).
        """
        points_m = np.concatenate((corners_m(states), states.centre_m[:, None, :]), axis=1)
        return np.asarray(self.contains(points_m.reshape(-1, 2)).reshape(-1, 5).any(axis=1), dtype=np.bool_)


def views_of(poses: Sequence[CameraPose], size_px: tuple[int, int]) -> tuple[CameraView, ...]:
    """Give what a camera sees from each pose: the very same view from the same pose."""
    seen = {pose: CameraView(pose.camera(*size_px), size_px, pose) for pose in dict.fromkeys(poses)}
    return tuple(seen[pose] for pose in poses)


def camera_over(view: View, size_px: tuple[int, int]) -> CameraView:
    """Hang a camera that looks straight down over a view, north up.

    Parameters
    ----------
    view : ground to cover; its width fills the image width.
    size_px : width and height.

    Returns
    -------
    The camera.

    Examples
    --------
    >>> seen = camera_over(View(centre_m=(500.0, 0.0), width_m=600.0), (1280, 720))
    >>> seen.camera.to_ground(np.array([[-0.5, 359.5], [1279.5, 359.5]])).round(6).tolist()
    [[200.0, 0.0], [800.0, 0.0]]
    """
    width_px, height_px = size_px
    pixel_m = view.width_m / width_px
    east_m, north_m = view.centre_m
    west_m, top_m = east_m - pixel_m * (width_px - 1) / 2, north_m + pixel_m * (height_px - 1) / 2
    return CameraView(_north_up(pixel_m, west_m, top_m), size_px)


def _north_up(pixel_m: float, west_m: float, north_m: float) -> GroundCamera:
    """Look straight down; the centre of the top-left pixel is over a place."""
    return GroundCamera.from_homography([[pixel_m, 0.0, west_m], [0.0, -pixel_m, north_m], [0.0, 0.0, 1.0]])


def widened(bounds_m: Bounds, by_m: float) -> Bounds:
    """Move the west, south, east and north ends of some ground outwards."""
    west_m, south_m, east_m, north_m = bounds_m
    return west_m - by_m, south_m - by_m, east_m + by_m, north_m + by_m


def corners_m(states: VehicleStates) -> FloatArray:
    """Give the corners of each body.

    Parameters
    ----------
    states : n vehicles.

    Returns
    -------
    (n, 4, 2), local east/north frame, counter-clockwise from rear right.
    """
    forward = np.column_stack((np.cos(states.heading_rad), np.sin(states.heading_rad)))
    left = np.column_stack((-forward[:, 1], forward[:, 0]))
    along = np.array([-0.5, 0.5, 0.5, -0.5])[None, :, None] * (states.length_m[:, None] * forward)[:, None, :]
    across = np.array([-0.5, -0.5, 0.5, 0.5])[None, :, None] * (states.width_m[:, None] * left)[:, None, :]
    return np.asarray(states.centre_m[:, None, :] + along + across, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A part of the image; all edges are even."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def window(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.right - self.left, self.bottom - self.top


def rectangle_around(points_px: FloatArray, size_px: tuple[int, int], *, margin_px: float = 0.0) -> Rectangle | None:
    """Give the part of the image around points.

    Parameters
    ----------
    points_px : (n, 2).
    size_px : width and height of the image, both even.
    margin_px : added on all sides.

    Returns
    -------
    The smallest rectangle on even pixels that holds the points' pixels; None if it lies outside the image, or without
    points.

    Examples
    --------
    >>> rectangle_around(np.array([[3.2, 5.0], [8.9, 6.0]]), (64, 64))
    Rectangle(left=2, top=4, right=10, bottom=8)
    """
    if not len(points_px):
        return None
    low, high = points_px.min(axis=0) - margin_px, points_px.max(axis=0) + margin_px
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return None
    left, top = (max(0, int(np.floor(edge)) & ~1) for edge in low)
    right, bottom = (min(size, (int(np.floor(edge)) + 2 + 1) & ~1) for size, edge in zip(size_px, high, strict=True))
    return Rectangle(left, top, right, bottom) if left < right and top < bottom else None


class Raster:
    """A north-up raster of the ground, with room around it for what a camera may reach.

    Parameters
    ----------
    reach_m : west, south, east, north.
    pixel_m : size of a pixel of the finest frame; the raster is a little finer, unless it got larger than 24 million
        pixels.
    """

    def __init__(self, reach_m: Bounds, pixel_m: float) -> None:
        west_m, south_m, east_m, north_m = reach_m
        area_m2 = (east_m - west_m) * (north_m - south_m)
        self.pixel_m = max(pixel_m / _FINER, math.sqrt(area_m2 / _LARGEST_PX))
        self.size_px = (
            2 * math.ceil((east_m - west_m) / self.pixel_m / 2),
            2 * math.ceil((north_m - south_m) / self.pixel_m / 2),
        )
        self.camera = _north_up(self.pixel_m, west_m + self.pixel_m / 2, north_m - self.pixel_m / 2)

    def seen_by(self, picture: ByteArray, view: CameraView) -> ByteArray:
        """Warp a picture of the raster into a camera's image.

        Parameters
        ----------
        picture : of the raster's size, any number of channels.
        view : the camera.

        Returns
        -------
        (h, w, ...); where the raster ends, its border is repeated.
        """
        matrix = plane_to_pixels(view, 0.0) @ self.camera.ground_from_pixel
        return np.asarray(
            cv2.warpPerspective(picture, matrix, view.size_px, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
            dtype=np.uint8,
        )

    def patch_in(self, picture: ByteArray, view: CameraView, height_m: float) -> tuple[Rectangle, ByteArray] | None:
        """Warp a picture of the raster into the part of a camera's image that it covers.

        Parameters
        ----------
        picture : of the raster's size.
        view : the camera.
        height_m : of the plane that the picture lies in, over the ground; other than 0 needs a view with a pose.

        Returns
        -------
        The part and its picture, 0 where the raster ends; None if all of it is out of the image.
        """
        matrix = plane_to_pixels(view, height_m) @ self.camera.ground_from_pixel
        if (found := warp_into(matrix, self.size_px, view.size_px)) is None:
            return None
        part, to_part = found
        return part, np.asarray(cv2.warpPerspective(picture, to_part, part.size_px), dtype=np.uint8)


def plane_to_pixels(view: CameraView, height_m: float) -> FloatArray:
    """Give the map from a level plane to the image.

    Parameters
    ----------
    view : without a pose the camera stands infinitely high, and all heights look alike.
    height_m : of the plane over the ground.

    Returns
    -------
    (3, 3), homogeneous pixels from homogeneous east and north.
    """
    if view.pose is None:
        return view.camera.pixel_from_ground
    space = view.pose.projection(*view.size_px)
    return np.column_stack((space[:, 0], space[:, 1], space[:, 3] + height_m * space[:, 2]))


def at_height(points_m: FloatArray, height_m: float, view: CameraView) -> FloatArray:
    """Map points of a level plane into the image: (n, 2) metres to (n, 2) pixels."""
    mapped = np.column_stack((points_m, np.ones(len(points_m)))) @ plane_to_pixels(view, height_m).T
    return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)


def silhouette_px(outline_m: FloatArray, up_m: float, view: CameraView) -> FloatArray:
    """Outline an upright prism as the camera sees it: (n, 2) pixels from the (k, 2) metres of its foot."""
    return hull_of(np.vstack((at_height(outline_m, 0.0, view), at_height(outline_m, up_m, view))))


def hull_of(points: FloatArray) -> FloatArray:
    """Give the corners of the convex hull of points, (n, 2)."""
    return cv2.convexHull(points.astype(np.float32)).reshape(-1, 2).astype(np.float64)


def warp_into(
    to_pixel: FloatArray, source_px: tuple[int, int], size_px: tuple[int, int]
) -> tuple[Rectangle, FloatArray] | None:
    """Find the part of an image that a warped picture covers.

    Parameters
    ----------
    to_pixel : (3, 3), from the picture's pixels to the image's.
    source_px, size_px : width and height of picture and image.

    Returns
    -------
    The part, and the map into the part's own pixels; None if all of it is out of the image.
    """
    width, height = source_px
    corners = to_pixel @ np.array([[0, width, width, 0], [0, 0, height, height], [1.0, 1, 1, 1]])
    part = rectangle_around((corners[:2] / corners[2]).T, size_px)
    if part is None:
        return None
    return part, to_pixel - np.outer((part.left, part.top, 0.0), to_pixel[2])


def plane_camera(view: CameraView, height_m: float) -> GroundCamera:
    """Give the camera that sees a level plane as if that were the ground; parameters are those of `plane_to_pixels`."""
    return GroundCamera.from_homography(np.linalg.inv(plane_to_pixels(view, height_m)))
