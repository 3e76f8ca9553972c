"""Which two tracks are one vehicle? Those that follow each other more closely than anybody drives.

A long vehicle may come into view in pieces: its shadow first, then a dark cab, then a light body. Each piece starts a
track, and since each track claims its part of the blob, they would go on dividing it for good. Real vehicles in motion
keep a distance that grows with speed.
"""

import numpy as np

from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes, axis
from vision.tracking.settings import TrackingSettings


def find_couples(boxes: Boxes, velocity_mps: FloatArray, settings: TrackingSettings) -> BoolArray:
    """Find pairs of boxes that move as one, the front of one at the rear of the other.

    Parameters
    ----------
    boxes : of n tracks.
    velocity_mps : (n, 2).
    settings : how near and how alike a couple is.

    Returns
    -------
    (n, n), symmetric, False on the diagonal.

    Examples
    --------
    >>> cab_and_body = Boxes(np.array([[0.0, 0.0], [6.0, 0.2]]), np.zeros(2), np.array([3.0, 6.5]), np.full(2, 2.4))
    >>> find_couples(cab_and_body, np.full((2, 2), 13.0), TrackingSettings()).tolist()
    [[False, True], [True, False]]
    """
    offset_m = boxes.centre_m[None] - boxes.centre_m[:, None]
    along_m = np.abs(np.einsum("nmk,nk->nm", offset_m, axis(boxes.heading_rad)))
    across_m = np.abs(np.einsum("nmk,nk->nm", offset_m, axis(boxes.heading_rad + np.pi / 2)))
    gap_m = along_m - np.add.outer(boxes.length_m, boxes.length_m) / 2
    speed_mps = np.hypot(velocity_mps[:, 0], velocity_mps[:, 1])
    slower_mps = np.minimum.outer(speed_mps, speed_mps)
    change_mps = velocity_mps[None] - velocity_mps[:, None]
    is_alike = np.hypot(change_mps[..., 0], change_mps[..., 1]) < settings.couple_change_mps
    is_near = gap_m < np.minimum(settings.couple_gap_s * slower_mps, settings.couple_gap_m)
    is_near &= across_m < settings.couple_across_m
    is_one = is_near & is_alike & (slower_mps > settings.couple_speed_mps)
    np.fill_diagonal(is_one, False)
    return np.asarray(is_one & is_one.T)
