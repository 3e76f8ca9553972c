"""What are pairs of objects measured from? One array with a column an object."""

import numpy as np
from numpy.typing import NDArray

from qsr.measuring.footprints import Footprints

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Rows of the object table.
X, Y, COS, SIN, HALF_LENGTH, HALF_WIDTH, HALF_PATH, SPEED, ALONG, ACROSS, TRAVEL, ROAD, OBSERVED = range(13)


def object_table(footprints: Footprints, *, widest_m: float) -> FloatArray:
    """Lay out what pairs are measured from.

    Parameters
    ----------
    footprints : of one frame.
    widest_m : no vehicle needs a wider path.

    Returns
    -------
    (13, n): x, y, cosine and sine of the heading, half length, half width, half the width of the path, speed, along,
    across, cosine between heading and road (0 off the roads), road, 1 where the object was seen (0: only predicted).
    """
    heading_rad = footprints.heading_rad
    table = np.empty((13, len(footprints.ids)))
    table[X], table[Y] = footprints.centre_m.T
    table[COS], table[SIN] = np.cos(heading_rad), np.sin(heading_rad)
    table[HALF_LENGTH], table[HALF_WIDTH] = 0.5 * footprints.length_m, 0.5 * footprints.width_m
    table[HALF_PATH] = np.minimum(table[HALF_WIDTH], 0.5 * widest_m)
    table[SPEED] = footprints.speed_mps
    table[ALONG], table[ACROSS] = footprints.along_m, footprints.across_m
    table[TRAVEL] = np.cos(heading_rad - footprints.tangent_rad)
    table[ROAD] = footprints.road
    table[OBSERVED] = footprints.observed
    off_road = footprints.road < 0
    if off_road.any():
        table[ALONG : TRAVEL + 1, off_road] = 0.0
    return table
