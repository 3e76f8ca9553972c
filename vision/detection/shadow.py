"""How far does the shadow of a vehicle reach, and to which side? Learned from vehicles that are brighter than it.

Detection and splitting take vehicle and shadow as one thing: telling them apart cell by cell eats dark cars. But one
sun shines on the whole road. On a bright or coloured vehicle the shadow shows as a border of dark, colourless road on
the sides away from the sun. To which sides shadows fall is the median over all vehicles, since dark screens and
bumpers come on either side; how far they reach is then the width of the border on those sides.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from vision.detection.blobs import Cells, measure
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes, axis

IntArray = NDArray[np.int64]

# A body is recognised if the cells that are no shadow are this much of the blob and fill at least a small car.
BODY_SHARE = 0.35
BODY_LENGTH_M = 2.5
BODY_WIDTH_M = 1.2
# Longer vehicles are taller: their shadows are learned apart, and are this much longer until enough was seen of them.
LONG_VEHICLE_M = 7.5
LONG_FACTOR = 1.5
# What the middle value is taken over, and the fewest measurements it needs.
MEMORY = 300
MIN_MEASUREMENTS = 10
# From this many measurements on, a vehicle's own shadow counts and not that of its kind; but no more than this of it.
OWN_MEASUREMENTS = 5
OWN_FACTOR, OWN_SLACK_M = 1.25, 0.25
# What remains of a box at least: length and width of small vehicles of both kinds. A shadow that falls off the watched
# road is not in the box, so there may be less to take off than the sun would have it.
LEAST_SHORT_M = (3.0, 1.6)
LEAST_LONG_M = (6.0, 2.3)


def measure_shadows(cells: Cells, is_shadow: BoolArray, boxes: Boxes, side: float) -> FloatArray:
    """Measure the dark borders of groups of cells.

    Parameters
    ----------
    cells : one group per vehicle.
    is_shadow : (p,) cells that look like road in shadow.
    boxes : of the groups.
    side : of a cell, metres.

    Returns
    -------
    (n, 4) metres of border in front, behind, left and right of the body; nan where no body stands out.
    """
    result = np.full((len(boxes), 4), np.nan)
    if cells.count == 0:
        return result
    body = cells.regroup(np.where(is_shadow, -1, cells.group))
    rows = body.key
    whole = boxes.select(rows)
    bodies = measure(body, whole.heading_rad, side).boxes
    ahead, left = axis(whole.heading_rad), axis(whole.heading_rad + np.pi / 2)
    offset = bodies.centre_m - whole.centre_m
    along, across = np.einsum("ni,ni->n", offset, ahead), np.einsum("ni,ni->n", offset, left)
    spare_length, spare_width = (whole.length_m - bodies.length_m) / 2, (whole.width_m - bodies.width_m) / 2
    borders = np.stack([spare_length - along, spare_length + along, spare_width - across, spare_width + across], axis=1)
    is_clear = (body.sizes >= BODY_SHARE * cells.sizes[rows]) & (bodies.length_m >= BODY_LENGTH_M)
    is_clear &= bodies.width_m >= BODY_WIDTH_M
    result[rows[is_clear]] = borders[is_clear]
    return result


class Sun:
    """The reach of shadows in one clip, by the median over what was measured so far."""

    def __init__(self) -> None:
        # Of short and of long vehicles: heading, then the four borders.
        self._measured: tuple[deque[FloatArray], ...] = (deque(maxlen=MEMORY), deque(maxlen=MEMORY))
        self._direction = np.zeros(2)
        self._usual_m = np.zeros((2, 2))

    def learn(self, borders_m: FloatArray, heading_rad: FloatArray, length_m: FloatArray) -> None:
        """Add measurements.

        Parameters
        ----------
        borders_m : (n, 4) from `measure_shadows`; rows with nan are left out.
        heading_rad, length_m : (n,) of the vehicles.
        """
        is_measured = ~np.isnan(borders_m[:, 0])
        if not is_measured.any():
            return
        rows = np.column_stack([heading_rad, borders_m])[is_measured]
        for row, length in zip(rows, length_m[is_measured], strict=True):
            self._measured[int(length > LONG_VEHICLE_M)].append(row)
        short, long = (np.array(measured).reshape(-1, 5) for measured in self._measured)
        both = short if len(short) >= MIN_MEASUREMENTS else np.concatenate([short, long])
        ahead, left = _axes(both[:, 0])
        self._direction = _middle(
            (both[:, 1] - both[:, 2])[:, None] * ahead + (both[:, 3] - both[:, 4])[:, None] * left
        )
        self._usual_m[0] = _middle(self._on_shadow_side(*_axes(short[:, 0]), short[:, 1:]))
        self._usual_m[1] = LONG_FACTOR * self._usual_m[0]
        if len(long) >= MIN_MEASUREMENTS:
            self._usual_m[1] = _middle(self._on_shadow_side(*_axes(long[:, 0]), long[:, 1:]))

    def shadows(
        self, heading_rad: FloatArray, length_m: FloatArray, borders_m: FloatArray, count: IntArray
    ) -> FloatArray:
        """Say how far the shadows of vehicles reach.

        Parameters
        ----------
        heading_rad, length_m : (n,).
        borders_m, count : (n, 4) mean of what was measured of each vehicle itself, and (n,) how often.

        Returns
        -------
        (n, 2) metres east and north; zero until enough was measured.
        """
        usual_m = self._usual_m[(length_m > LONG_VEHICLE_M).astype(np.intp)]
        if not usual_m.any() and not self._direction.any():
            return usual_m
        ahead, left = _axes(heading_rad)
        own_m = self._on_shadow_side(ahead, left, borders_m)
        limited_m = np.zeros_like(own_m)
        for direction in (ahead, left):
            most_m = OWN_FACTOR * np.abs(np.einsum("ni,ni->n", usual_m, direction)) + OWN_SLACK_M
            part_m = np.minimum(np.maximum(np.einsum("ni,ni->n", own_m, direction), -most_m), most_m)
            limited_m += part_m[:, None] * direction
        return np.where((count >= OWN_MEASUREMENTS)[:, None], limited_m, usual_m)

    def _on_shadow_side(self, ahead: FloatArray, left: FloatArray, borders_m: FloatArray) -> FloatArray:
        """Keep the borders on the sides to which shadows fall, as vectors on the ground."""
        along = np.where(ahead @ self._direction > 0, borders_m[:, 0], -borders_m[:, 1])
        across = np.where(left @ self._direction > 0, borders_m[:, 2], -borders_m[:, 3])
        if not self._direction.any():
            return np.zeros((len(ahead), 2))
        return np.asarray(along[:, None] * ahead + across[:, None] * left)


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
    ahead, left = _axes(boxes.heading_rad)
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
    most = np.maximum(limit, 0.0)
    return np.minimum(np.maximum(value, -most), most)


def _axes(heading_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    return axis(heading_rad), axis(heading_rad + np.pi / 2)


def _middle(vectors: FloatArray) -> FloatArray:
    return np.median(vectors, axis=0) if len(vectors) >= MIN_MEASUREMENTS else np.zeros(2)
