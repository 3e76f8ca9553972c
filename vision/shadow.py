"""How far does the shadow of a vehicle reach, and to which side? Learned from vehicles that are brighter than it.

Detection and splitting take vehicle and shadow as one thing: telling them apart cell by cell eats dark cars. But one
sun shines on the whole road. On a bright or coloured vehicle the shadow shows as a border of dark, colourless road on
the sides away from the sun only; its reach, learned over time, then corrects the boxes of all tracks at output.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from vision.blobs import Cells, measure
from vision.boxes import Boxes, axis

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# A body is recognised if the cells that are no shadow are this much of the blob and fill at least a small car.
BODY_SHARE = 0.35
BODY_LENGTH_M = 2.5
BODY_WIDTH_M = 1.2
# Longer vehicles are taller: their shadows are learned apart.
LONG_VEHICLE_M = 7.5
# What the middle value is taken over, and the fewest measurements it needs.
MEMORY = 300
MIN_MEASUREMENTS = 10
# What remains of a box at least: length and width of small vehicles of both kinds. A shadow that falls off the watched
# road is not in the box, so there may be less to take off than the sun would have it.
LEAST_SHORT_M = (3.0, 1.6)
LEAST_LONG_M = (6.0, 2.3)


def measure_shadows(cells: Cells, is_shadow: BoolArray, boxes: Boxes, side: float) -> FloatArray:
    """Measure how far each group of cells goes on as shadow past its body.

    Dark ends that a body has on both sides (screens, bumpers) cancel: only the difference between opposite sides
    counts, since a shadow falls to one of them.

    Parameters
    ----------
    cells : one group per vehicle.
    is_shadow : (p,) cells that look like road in shadow.
    boxes : of the groups.
    side : of a cell, metres.

    Returns
    -------
    (n, 2) offset of the shadow's far corner from the body's, metres east and north; nan where no body stands out.
    """
    result = np.full((len(boxes), 2), np.nan)
    if cells.count == 0:
        return result
    body = cells.regroup(np.where(is_shadow, -1, cells.group))
    rows = body.key
    whole = boxes.select(rows)
    bodies = measure(body, whole.heading_rad, side).boxes
    offset = whole.centre_m - bodies.centre_m
    # The centre of vehicle and shadow lies half the shadow's reach away from the vehicle's.
    is_clear = (body.sizes >= BODY_SHARE * cells.sizes[rows]) & (bodies.length_m >= BODY_LENGTH_M)
    is_clear &= bodies.width_m >= BODY_WIDTH_M
    result[rows[is_clear]] = 2 * offset[is_clear]
    return result


class Sun:
    """The reach of shadows in one clip, by the median over what was measured so far."""

    def __init__(self) -> None:
        # Of short and of long vehicles.
        self._measured: tuple[deque[tuple[float, float]], ...] = (deque(maxlen=MEMORY), deque(maxlen=MEMORY))
        self._usual_m = np.zeros((2, 2))

    def learn(self, shadow_m: FloatArray, length_m: FloatArray) -> None:
        """Add measurements.

        Parameters
        ----------
        shadow_m : (n, 2) offsets; rows with nan are left out.
        length_m : (n,) of the vehicles.
        """
        is_measured = ~np.isnan(shadow_m[:, 0])
        for (east_m, north_m), length in zip(shadow_m[is_measured], length_m[is_measured], strict=True):
            self._measured[int(length > LONG_VEHICLE_M)].append((float(east_m), float(north_m)))
        if is_measured.any():
            self._usual_m = np.array([_middle(measured) for measured in self._measured])

    def shadows(self, length_m: FloatArray) -> FloatArray:
        """Say how far the shadow of a vehicle reaches.

        Parameters
        ----------
        length_m : (n,).

        Returns
        -------
        (n, 2) metres east and north; zero until enough was measured.
        """
        return np.asarray(self._usual_m[(length_m > LONG_VEHICLE_M).astype(np.intp)])


def without_shadow(boxes: Boxes, shadow_m: FloatArray) -> Boxes:
    """Take the shadow off boxes of vehicles with their shadows.

    Parameters
    ----------
    boxes : around both.
    shadow_m : (n, 2) reach of the shadows.

    Returns
    -------
    Boxes around the vehicles.

    Examples
    --------
    >>> both = Boxes(np.array([[0.0, 0.0]]), np.array([0.0]), np.array([5.0]), np.array([3.0]))
    >>> body = without_shadow(both, np.array([[0.5, -1.0]]))
    >>> body.centre_m.round(3).tolist(), body.length_m.tolist(), body.width_m.tolist()
    ([[-0.25, 0.5]], [4.5], [2.0])
    """
    ahead, left = axis(boxes.heading_rad), axis(boxes.heading_rad + np.pi / 2)
    along, across = np.einsum("ni,ni->n", shadow_m, ahead), np.einsum("ni,ni->n", shadow_m, left)
    is_long = boxes.length_m > LONG_VEHICLE_M
    along = _limited(along, boxes.length_m - np.where(is_long, LEAST_LONG_M[0], LEAST_SHORT_M[0]))
    across = _limited(across, boxes.width_m - np.where(is_long, LEAST_LONG_M[1], LEAST_SHORT_M[1]))
    return Boxes(
        centre_m=boxes.centre_m - along[:, None] * ahead / 2 - across[:, None] * left / 2,
        heading_rad=boxes.heading_rad,
        length_m=boxes.length_m - np.abs(along),
        width_m=boxes.width_m - np.abs(across),
    )


def _limited(value: FloatArray, limit: FloatArray) -> FloatArray:
    return np.clip(value, -np.maximum(limit, 0.0), np.maximum(limit, 0.0))


def _middle(memory: deque[tuple[float, float]]) -> FloatArray:
    return np.median(np.array(memory), axis=0) if len(memory) >= MIN_MEASUREMENTS else np.zeros(2)
