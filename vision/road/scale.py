"""How big is a pixel, if nobody says? A scale for the image plane from the typical length of what moves in it.

For a video without a site file: the first seconds are compared with their own median picture, and the typical length
of the moving blobs, long ones counting for more, is taken to be the typical length of a car. Good for one camera that
looks down; in perspective it holds in the middle distance only. The caller says so to the user.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.errors import VisionError
from vision.objects import ByteArray, FloatArray
from vision.road.settings import RoadSettings
from vision.settings import VisionSettings


def image_plane(metres_per_pixel: float, *, width_px: int, height_px: int) -> FloatArray:
    """Lay the ground into the image: x right, y up, the middle of the image at (0, 0).

    Returns
    -------
    (3, 3) homography, ground metres from pixels.

    Examples
    --------
    >>> plane = image_plane(0.5, width_px=101, height_px=51)
    >>> (plane @ [50, 0, 1])[:2].tolist()
    [0.0, 12.5]
    """
    s = metres_per_pixel
    return np.array([[s, 0.0, -s * (width_px - 1) / 2], [0.0, -s, s * (height_px - 1) / 2], [0.0, 0.0, 1.0]])


def estimate_scale(pictures: Sequence[ByteArray], settings: VisionSettings) -> float:
    """Estimate metres per pixel from what moves.

    Parameters
    ----------
    pictures : (h, w) luma of frames spread over some seconds of one fixed camera.
    settings : how long a usual car is, and what is taken for one.

    Returns
    -------
    Metres per pixel, such that the typical moving blob is as long as a usual car.

    Raises
    ------
    VisionError
        If too little moves to tell.
    """
    least_pictures, least_blobs = settings.road.scale_least_pictures, settings.road.scale_least_blobs
    if len(pictures) < least_pictures:
        raise VisionError(f"scale: expected at least {least_pictures} pictures, got {len(pictures)}")
    background = np.median(np.stack(pictures), axis=0).astype(np.uint8)
    lengths_px = [length for picture in pictures for length in _blob_lengths(picture, background, settings.road)]
    if len(lengths_px) < least_blobs:
        raise VisionError(f"scale: expected at least {least_blobs} moving blobs to take it from, got {len(lengths_px)}")
    return settings.usual_length_m / _middle(np.sort(lengths_px))


def _middle(lengths_px: FloatArray) -> float:
    """Find the length, of some in order, up to which blobs make half of the length of all.

    Specks of noise and people outnumber vehicles in many a picture, but do not add up to them.

    Examples
    --------
    >>> _middle(np.array([3.0, 3, 3, 3, 40, 42, 44]))
    42.0
    """
    total_px = np.cumsum(lengths_px)
    return float(lengths_px[np.searchsorted(total_px, total_px[-1] / 2)])


def _blob_lengths(picture: ByteArray, background: ByteArray, settings: RoadSettings) -> list[float]:
    """Return the long sides in pixels of the compact blobs that are wholly in the picture."""
    moving = (cv2.absdiff(picture, background) > settings.scale_difference_levels).astype(np.uint8)
    closed = cv2.morphologyEx(moving, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    lengths_px = []
    for outline in outlines:
        area_px = cv2.contourArea(outline)
        left, top, width, height = cv2.boundingRect(outline)
        is_whole = left > 0 and top > 0 and left + width < picture.shape[1] and top + height < picture.shape[0]
        _, sides, _ = cv2.minAreaRect(outline)
        least_px = max(settings.scale_least_area_px, settings.scale_least_fill * sides[0] * sides[1])
        if is_whole and area_px >= least_px:
            # A rectangle through pixel centres is one pixel shorter than what it covers.
            lengths_px.append(float(max(sides)) + 1.0)
    return lengths_px
