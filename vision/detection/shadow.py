"""How far does the shadow of a vehicle reach, and to which side? Learned from vehicles that are brighter than it.

Detection and splitting take vehicle and shadow as one thing: telling them apart cell by cell eats dark cars. But one
sun shines on the whole road. On a bright or coloured vehicle the shadow shows as a border of dark, colourless road on
the sides away from the sun. To which sides shadows fall is the median over all vehicles, since dark screens and
bumpers come on either side; how far they reach is then the width of the border on those sides.
"""

import numpy as np
from numpy.typing import NDArray

from vision.detection.blobs import Cells, measure
from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes, axis

IntArray = NDArray[np.int64]


def measure_shadows(
    cells: Cells, is_shadow: BoolArray, boxes: Boxes, side: float, settings: DetectionSettings
) -> FloatArray:
    """Measure the dark borders of groups of cells.

    Parameters
    ----------
    cells : one group per vehicle.
    is_shadow : (p,) cells that look like road in shadow.
    boxes : of the groups.
    side : of a cell, metres.
    settings : what is a body.

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
    bodies, _ = measure(body, whole.heading_rad, side, settings)
    ahead, left = axis(whole.heading_rad), axis(whole.heading_rad + np.pi / 2)
    offset = bodies.centre_m - whole.centre_m
    along, across = np.einsum("ni,ni->n", offset, ahead), np.einsum("ni,ni->n", offset, left)
    spare_length, spare_width = (whole.length_m - bodies.length_m) / 2, (whole.width_m - bodies.width_m) / 2
    borders = np.stack([spare_length - along, spare_length + along, spare_width - across, spare_width + across], axis=1)
    is_clear = (body.sizes >= settings.body_share * cells.sizes[rows]) & (bodies.length_m >= settings.body_length_m)
    is_clear &= bodies.width_m >= settings.body_width_m
    result[rows[is_clear]] = borders[is_clear]
    return result


class Sun:
    """The reach of shadows in one clip, by the median over what was measured so far."""

    def __init__(self, settings: DetectionSettings) -> None:
        self._settings = settings
        # Of short and of long vehicles: heading, then the four borders.
        self._measured: list[FloatArray] = [np.zeros((0, 5)), np.zeros((0, 5))]
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
        rows, is_long = np.column_stack([heading_rad, borders_m]), length_m > self._settings.long_vehicle_m
        for kind, is_new in enumerate((is_measured & ~is_long, is_measured & is_long)):
            self._measured[kind] = np.concatenate([self._measured[kind], rows[is_new]])[-self._settings.shadow_memory :]
        least, (short, long) = self._settings.shadow_measurements, self._measured
        both = short if len(short) >= least else np.concatenate([short, long])
        ahead, left = _axes(both[:, 0])
        self._direction = _middle(
            (both[:, 1] - both[:, 2])[:, None] * ahead + (both[:, 3] - both[:, 4])[:, None] * left, least
        )
        usual_m = [_middle(self._on_shadow_side(*_axes(kind[:, 0]), kind[:, 1:]), least) for kind in (short, long)]
        is_guess = len(long) < least
        self._usual_m = np.array(
            [usual_m[0], self._settings.long_shadow_factor * usual_m[0] if is_guess else usual_m[1]]
        )

    def shadows(
        self, heading_rad: FloatArray, length_m: FloatArray, borders_m: FloatArray, seen_us: IntArray
    ) -> FloatArray:
        """Say how far the shadows of vehicles reach.

        Parameters
        ----------
        heading_rad, length_m : (n,).
        borders_m, seen_us : (n, 4) mean of what was measured of each vehicle itself, and (n,) for how long.

        Returns
        -------
        (n, 2) metres east and north; zero until enough was measured.
        """
        usual_m = self._usual_m[(length_m > self._settings.long_vehicle_m).astype(np.intp)]
        if not usual_m.any() and not self._direction.any():
            return usual_m
        ahead, left = _axes(heading_rad)
        own_m = self._on_shadow_side(ahead, left, borders_m)
        limited_m = np.zeros_like(own_m)
        for direction in (ahead, left):
            usual = np.abs(np.einsum("ni,ni->n", usual_m, direction))
            most_m = self._settings.own_factor * usual + self._settings.own_slack_m
            part_m = np.minimum(np.maximum(np.einsum("ni,ni->n", own_m, direction), -most_m), most_m)
            limited_m += part_m[:, None] * direction
        return np.where((seen_us >= self._settings.own_us)[:, None], limited_m, usual_m)

    def _on_shadow_side(self, ahead: FloatArray, left: FloatArray, borders_m: FloatArray) -> FloatArray:
        """Keep the borders on the sides to which shadows fall, as vectors on the ground."""
        along = np.where(ahead @ self._direction > 0, borders_m[:, 0], -borders_m[:, 1])
        across = np.where(left @ self._direction > 0, borders_m[:, 2], -borders_m[:, 3])
        if not self._direction.any():
            return np.zeros((len(ahead), 2))
        return np.asarray(along[:, None] * ahead + across[:, None] * left)


def without_shadow(boxes: Boxes, shadow_m: FloatArray, settings: DetectionSettings) -> Boxes:
    """Take the shadow off boxes of vehicles with their shadows.

    Parameters
    ----------
    boxes : around both.
    shadow_m : (n, 2) reach of the shadows.
    settings : what remains at least.

    Returns
    -------
    Boxes around the vehicles.

    Examples
    --------
    >>> both = Boxes(np.array([[0.0, 0.0]]), np.array([0.0]), np.array([5.0]), np.array([3.0]))
    >>> body = without_shadow(both, np.array([[0.5, -1.0]]), DetectionSettings())
    >>> body.centre_m.round(3).tolist(), body.length_m.tolist(), body.width_m.tolist()
    ([[-0.25, 0.5]], [4.5], [2.0])
    """
    ahead, left = _axes(boxes.heading_rad)
    along, across = np.einsum("ni,ni->n", shadow_m, ahead), np.einsum("ni,ni->n", shadow_m, left)
    is_long = boxes.length_m > settings.long_vehicle_m
    along = _limited(along, boxes.length_m - np.where(is_long, settings.long_length_m, settings.short_length_m))
    across = _limited(across, boxes.width_m - np.where(is_long, settings.long_width_m, settings.short_width_m))
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


def _middle(vectors: FloatArray, least: int) -> FloatArray:
    if len(vectors) < least:
        return np.zeros(2)
    vectors = np.sort(vectors, axis=0)  # np.median takes several times as long
    return np.asarray((vectors[(len(vectors) - 1) // 2] + vectors[len(vectors) // 2]) / 2)
