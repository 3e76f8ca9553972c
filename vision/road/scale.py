"""How big is a pixel, if nobody says? A scale for the image plane from the typical length of what moves in it.

For a video without a site file: the first seconds are compared with their own median picture, and the most frequent
length of the moving blobs is taken to be that of a car. Good for one camera that looks down; in perspective it holds
in the middle distance only. The caller says so to the user.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.errors import VisionError
from vision.objects import ByteArray, FloatArray
from vision.road.settings import RoadSettings
from vision.settings import VisionSettings

# A blurred edge lies where half of the contrast is reached. What the strongest tenth of a thing differs by is its
# contrast: a single pixel may be a glint.
EDGE_SHARE, STRONG_QUANTILE = 0.5, 0.9
GRID_LENGTHS = 200


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
    Metres per pixel, such that the most frequent length of moving blobs is that of a usual car.

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
    return settings.usual_length_m / _most_frequent(np.sort(lengths_px), settings.road)


def _most_frequent(lengths_px: FloatArray, settings: RoadSettings) -> float:
    """Find the length, of some in order, to which most of those come near that may be lengths of vehicles.

    Not the middle one: lorries are few, but slow, so that they are seen often, and long; cars outnumber them and are
    alike. Not the most frequent one of all: specks of noise and people outnumber vehicles in many a picture. But they
    do not add up to them, so the length up to which blobs make half of the length of all is that of some vehicle.

    Examples
    --------
    >>> lengths_px = np.array([3.0, 3, 3, 3, 3, 3, 12, 12.3, 12.3, 31, 32, 43])
    >>> round(_most_frequent(lengths_px, RoadSettings()))
    12
    """
    total_px = np.cumsum(lengths_px)
    of_vehicle_px = lengths_px[np.searchsorted(total_px, total_px[-1] / 2)]
    logs = np.log(lengths_px[lengths_px >= settings.scale_least_part * of_vehicle_px])
    grid = np.linspace(logs[0], logs[-1], GRID_LENGTHS)
    alike = np.exp(-(((grid[:, None] - logs) / settings.scale_alike) ** 2) / 2).sum(axis=1)
    return float(np.exp(grid[alike.argmax()]))


def _blob_lengths(picture: ByteArray, background: ByteArray, settings: RoadSettings) -> list[float]:
    """Return the long sides in pixels of the compact blobs that are wholly in the picture."""
    differences = cv2.absdiff(picture, background)
    moving = (differences > settings.scale_difference_levels).astype(np.uint8)
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
            window = differences[top : top + height, left : left + width]
            lengths_px.append(_length(np.asarray(window, np.uint8), outline - (left, top), settings))
    return lengths_px


def _length(differences: ByteArray, outline: cv2.typing.MatLike, settings: RoadSettings) -> float:
    """Measure how long a blob is from edge to edge, blur and soft shadow left out."""
    inside = cv2.drawContours(np.zeros_like(differences), [outline], -1, (1,), cv2.FILLED) > 0
    edge_levels = EDGE_SHARE * np.quantile(differences[inside], STRONG_QUANTILE)
    is_thing = inside & (differences > max(settings.scale_difference_levels, edge_levels))
    _, sides, _ = cv2.minAreaRect(np.argwhere(is_thing).astype(np.float32))
    # A rectangle through pixel centres is one pixel shorter than what it covers.
    return float(max(sides)) + 1.0
