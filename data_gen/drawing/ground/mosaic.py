"""What does a moving camera see of the ground? All of it is painted once, seen from above, and warped per frame."""

import math

import cv2
import numpy as np

from data_gen.drawing.view import CameraView, Rectangle, rectangle_around
from data_gen.simulation.states import ByteArray, FloatArray
from gis.camera import GroundCamera

_FINER = 1.15
"""The raster is this much finer than the finest frame: bilinear sampling then keeps what a lens would keep."""
_LARGEST_PX = 24_000_000


class Raster:
    """A north-up raster of the ground, with room around it for what a camera may reach.

    Parameters
    ----------
    reach_m : west, south, east, north.
    pixel_m : size of a pixel of the finest frame; the raster is a little finer, unless it got larger than 24 million
        pixels.
    """

    def __init__(self, reach_m: tuple[float, float, float, float], pixel_m: float) -> None:
        west_m, south_m, east_m, north_m = reach_m
        area_m2 = (east_m - west_m) * (north_m - south_m)
        self.pixel_m = max(pixel_m / _FINER, math.sqrt(area_m2 / _LARGEST_PX))
        self.size_px = (
            2 * math.ceil((east_m - west_m) / self.pixel_m / 2),
            2 * math.ceil((north_m - south_m) / self.pixel_m / 2),
        )
        self.camera = GroundCamera.from_homography(
            [
                [self.pixel_m, 0.0, west_m + self.pixel_m / 2],
                [0.0, -self.pixel_m, north_m - self.pixel_m / 2],
                [0.0, 0.0, 1.0],
            ]
        )

    def seen_by(self, picture: ByteArray, view: CameraView, height_m: float = 0.0) -> ByteArray:
        """Warp a picture of the raster into a camera's image.

        Parameters
        ----------
        picture : of the raster's size, any number of channels.
        view : the camera.
        height_m : of the plane that the picture lies in, over the ground; other than 0 needs a view with a pose.

        Returns
        -------
        (h, w, ...); where the raster ends, its border is repeated.
        """
        matrix = plane_to_pixels(view, height_m) @ self.camera.ground_from_pixel
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
        height_m : as for `seen_by`.

        Returns
        -------
        The part and its picture, 0 where the raster ends; None if all of it is out of the image.
        """
        matrix = plane_to_pixels(view, height_m) @ self.camera.ground_from_pixel
        width_px, height_px = self.size_px
        corners = matrix @ np.array([[0, width_px, width_px, 0], [0, 0, height_px, height_px], [1.0, 1, 1, 1]])
        part = rectangle_around((corners[:2] / corners[2]).T, view.size_px)
        if part is None:
            return None
        matrix[:2] -= np.outer((part.left, part.top), matrix[2])
        return part, np.asarray(cv2.warpPerspective(picture, matrix, part.size_px), dtype=np.uint8)


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


def plane_camera(view: CameraView, height_m: float) -> GroundCamera:
    """Give the camera that sees a level plane as if that were the ground; parameters are those of `plane_to_pixels`."""
    return GroundCamera.from_homography(np.linalg.inv(plane_to_pixels(view, height_m)))
