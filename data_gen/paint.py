"""How are shapes and textures put onto an image? Anti-aliased coverage of ground polygons, and fractal noise.

Everything here runs once a scene, not once a frame, and works in float32.
"""

from collections.abc import Iterable

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from data_gen.states import FloatArray
from gis.camera import GroundCamera

Picture = NDArray[np.float32]
"""(h, w, 3) blue, green, red in 0 to 255, or (h, w) for a single layer."""

_SUPERSAMPLING = 4
_SHIFT_BITS = 4
_CLIP_MARGIN_M = 50.0


class GroundPainter:
    """Paints ground shapes onto the image of one camera.

    Parameters
    ----------
    camera : maps ground to pixels.
    size_px : width and height of the image.
    """

    def __init__(self, camera: GroundCamera, size_px: tuple[int, int]) -> None:
        self.camera = camera
        self.size_px = size_px
        self.view = shapely.Polygon(camera.view_outline(*size_px))
        self._clip = self.view.buffer(_CLIP_MARGIN_M)
        centre_m = np.array([[self.view.centroid.x, self.view.centroid.y]])
        self.metres_per_pixel = float(camera.metres_per_pixel(centre_m)[0])

    def coverage(self, shapes: Iterable[shapely.Geometry]) -> Picture:
        """Measure which part of each pixel a set of shapes covers.

        Parameters
        ----------
        shapes : polygons in the local ground frame; those out of view are skipped, holes are kept.

        Returns
        -------
        (h, w) from 0 to 1; where shapes overlap they count once.
        """
        width_px, height_px = self.size_px
        fine = np.zeros((height_px * _SUPERSAMPLING, width_px * _SUPERSAMPLING), dtype=np.uint8)
        for shape in shapes:
            for part in shapely.get_parts(shapely.intersection(shape, self._clip)):
                if isinstance(part, shapely.Polygon) and not part.is_empty:
                    rings = [self._fine_px(np.asarray(ring.coords)) for ring in (part.exterior, *part.interiors)]
                    cv2.fillPoly(fine, rings, (255,), shift=_SHIFT_BITS)
        area = cv2.resize(fine, self.size_px, interpolation=cv2.INTER_AREA)
        return area.astype(np.float32) / np.float32(255)

    def ground_of_pixels(self) -> tuple[FloatArray, FloatArray]:
        """Give the ground position of each pixel centre: east and north, each (h, w) metres."""
        width_px, height_px = self.size_px
        x_px, y_px = np.meshgrid(np.arange(width_px, dtype=np.float64), np.arange(height_px, dtype=np.float64))
        ground_m = self.camera.to_ground(np.column_stack((x_px.ravel(), y_px.ravel())))
        return ground_m[:, 0].reshape(x_px.shape), ground_m[:, 1].reshape(x_px.shape)

    def _fine_px(self, ring_m: FloatArray) -> NDArray[np.int32]:
        # A pixel's centre is at a whole number; its _SUPERSAMPLING sub-pixels lie evenly around it.
        fine_px = (self.camera.to_pixels(ring_m) + 0.5) * _SUPERSAMPLING - 0.5
        return np.round(fine_px * (1 << _SHIFT_BITS)).astype(np.int32)


def lay_over(picture: Picture, alpha: Picture, colour: Picture | tuple[float, float, float]) -> None:
    """Blend a colour, or another picture, into a picture in place.

    Parameters
    ----------
    picture : (h, w, 3), changed.
    alpha : (h, w) from 0 (keep) to 1 (replace).
    colour : one colour or (h, w, 3).
    """
    picture += alpha[:, :, None] * (np.asarray(colour, dtype=np.float32) - picture)


def fractal_noise(
    rng: np.random.Generator, size_px: tuple[int, int], *, largest_px: float, octaves: int, gain: float = 0.6
) -> Picture:
    """Draw a random texture that has detail at several sizes.

    Parameters
    ----------
    rng : source of the noise.
    size_px : width and height.
    largest_px : size of the largest blotches; each octave halves it.
    octaves : number of sizes.
    gain : strength of each octave relative to the one before.

    Returns
    -------
    (h, w), mean 0, standard deviation 1.
    """
    width_px, height_px = size_px
    total = np.zeros((height_px, width_px), dtype=np.float32)
    for octave in range(octaves):
        blotch_px = max(1.0, largest_px / 2**octave)
        cells = (int(height_px / blotch_px) + 3, int(width_px / blotch_px) + 3)
        grid = rng.standard_normal(cells, dtype=np.float32)
        total += np.float32(gain**octave) * cv2.resize(grid, size_px, interpolation=cv2.INTER_CUBIC)
    total -= total.mean()
    return np.asarray(total / total.std(), dtype=np.float32)
