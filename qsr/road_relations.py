"""How far along, sideways and apart are the two objects of every pair?

Two objects on one road are measured along that road: the gap follows its bends and is continuous in the oncoming lane.
Elsewhere the pair is measured along the mean of the two headings, so that "a behind b" and "b ahead of a" are one fact.
Left and right are of the reference object: across its road in its direction of travel, else across its body.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qsr.conflicts import fill_conflicts
from qsr.headways import fill_headways
from qsr.object_table import ACROSS, ALONG, COS, HALF_LENGTH, HALF_WIDTH, ROAD, SIN, TRAVEL, FloatArray, X, Y
from qsr.relations import Switch
from qsr.settings import RelationSettings

LongArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# Headings that are nearly opposite have no mean; the gap means nothing there and only has to stay finite.
_LEAST_MEAN = 0.01
# On one road, but this many times as far along it as in the plane (or as the near radius): a ring or a hairpin, where
# free space is meant.
_FAR_ALONG = 2.0


@dataclass(slots=True)
class _Measures:
    """Hold what is measured of every pair (a, b), each (pairs,)."""

    gap: FloatArray  # a's centre ahead of b's, in the direction of travel
    lateral: FloatArray  # between the centres, sideways, >= 0
    direction: FloatArray  # above zero in the same direction
    left_of_b: FloatArray  # a's centre, in b's frame
    left_of_a: FloatArray  # b's centre, in a's frame
    apart: FloatArray  # between the bodies, >= 0
    on_one_road: BoolArray


def switch_values(
    table: FloatArray, columns: tuple[LongArray, LongArray], settings: RelationSettings, *, rows: int = len(Switch)
) -> FloatArray:
    """Measure the quantity of every switch of every pair.

    Parameters
    ----------
    table : (13, n) as made by `qsr.object_table.object_table`.
    columns : (pairs,) each, of a and of b.
    settings : thresholds.
    rows : how many switches are asked for, from the first on.

    Returns
    -------
    (rows, pairs) as in `qsr.relations.Switch`; a switch is on above zero. Metres, cosines for the direction, seconds
    for the time gaps; for the conflicts seconds and metres per second squared.
    """
    a, b = table.take(columns[0], axis=1), table.take(columns[1], axis=1)
    measures = _measure_in_free_space(a, b, settings)
    _measure_along_road(a, b, settings, measures)
    values = np.empty((len(Switch), a.shape[1]))
    _fill_positions(values, a, b, measures, settings)
    if rows > Switch.IN_PATH:
        fill_headways(
            values,
            a,
            b,
            gap_m=measures.gap,
            lateral_m=measures.lateral,
            direction=measures.direction,
            columns=columns,
            settings=settings,
        )
    if rows > Switch.SHORT_TTC:
        fill_conflicts(values, a, b, on_one_road=measures.on_one_road, settings=settings)
    return values[:rows]


def _fill_positions(
    values: FloatArray, a: FloatArray, b: FloatArray, measures: _Measures, settings: RelationSettings
) -> None:
    half_lengths = a[HALF_LENGTH] + b[HALF_LENGTH]
    half_widths = a[HALF_WIDTH] + b[HALF_WIDTH]
    values[Switch.PAST_REAR] = measures.gap + half_lengths
    values[Switch.PAST_FRONT] = measures.gap - half_lengths
    values[Switch.LATERAL_NEAR] = settings.beside_lateral_m - measures.lateral
    values[Switch.SAME_DIRECTION] = measures.direction
    values[Switch.CLOSE] = settings.close_m - measures.apart
    values[Switch.A_LEFT_OF_B] = measures.left_of_b - half_widths
    values[Switch.A_RIGHT_OF_B] = -measures.left_of_b - half_widths
    values[Switch.B_LEFT_OF_A] = measures.left_of_a - half_widths
    values[Switch.B_RIGHT_OF_A] = -measures.left_of_a - half_widths


def switch_margins(settings: RelationSettings) -> FloatArray:
    """List the margin of every switch, (switches,), in the unit of its quantity."""
    margins = np.full(len(Switch), settings.margin_m)
    margins[Switch.SAME_DIRECTION] = settings.direction_margin
    margins[Switch.CLOSE] = max(settings.close_margin_m, settings.margin_m)
    margins[Switch.A_FOLLOWS_B : Switch.B_AT_SHORT_HEADWAY + 1] = settings.time_gap_margin_s
    margins[Switch.SHORT_TTC] = settings.conflict_ttc_margin_s
    margins[Switch.HARD_BRAKING] = settings.conflict_braking_margin_mps2
    return margins


def is_on_one_road(a: FloatArray, b: FloatArray, apart_m: FloatArray, settings: RelationSettings) -> BoolArray:
    """Tell which pairs are measured along their common road.

    Parameters
    ----------
    a, b : columns of the object table: the objects of each pair.
    apart_m : (pairs,) between the centres.
    settings : thresholds.
    """
    far_m = _FAR_ALONG * np.maximum(apart_m, settings.leave_radius_m)
    one_road = (a[ROAD] == b[ROAD]) & (a[ROAD] >= 0) & (np.abs(a[ALONG] - b[ALONG]) <= far_m)
    return np.asarray(one_road, dtype=np.bool_)


def _measure_in_free_space(a: FloatArray, b: FloatArray, settings: RelationSettings) -> _Measures:
    apart_x, apart_y = a[X] - b[X], a[Y] - b[Y]
    ahead_of_b = apart_x * b[COS] + apart_y * b[SIN]
    left_of_b = apart_y * b[COS] - apart_x * b[SIN]
    ahead_of_a = -(apart_x * a[COS] + apart_y * a[SIN])
    left_of_a = apart_x * a[SIN] - apart_y * a[COS]
    on_one_road = is_on_one_road(a, b, np.hypot(apart_x, apart_y), settings)
    cos_between = a[COS] * b[COS] + a[SIN] * b[SIN]
    turn = np.abs(cos_between), np.abs(a[COS] * b[SIN] - a[SIN] * b[COS])
    # The unit vectors of both headings add up to their mean direction; the sum is the root of 2 + 2 cos long.
    mean = np.sqrt(np.maximum(2.0 + 2.0 * cos_between, _LEAST_MEAN))
    return _Measures(
        gap=(ahead_of_b - ahead_of_a) / mean,
        lateral=np.abs(left_of_b - left_of_a) / mean,
        direction=cos_between - math.cos(settings.heading_limit_rad),
        left_of_b=left_of_b,
        left_of_a=left_of_a,
        # Each is a lower bound, exact for parallel bodies; the larger is off by a few decimetres at most, which is
        # nothing at the distances where cars are called close.
        apart=np.maximum(
            _distance_to_body(b, a, (ahead_of_b, left_of_b), turn),
            _distance_to_body(a, b, (ahead_of_a, left_of_a), turn),
        ),
        on_one_road=on_one_road,
    )


def _distance_to_body(
    body: FloatArray, other: FloatArray, offset: tuple[FloatArray, FloatArray], turn: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Measure from a body to the box around the other one that is parallel to it; 0 where they overlap."""
    cos, sin = turn
    ahead = np.abs(offset[0]) - (body[HALF_LENGTH] + other[HALF_LENGTH] * cos + other[HALF_WIDTH] * sin)
    aside = np.abs(offset[1]) - (body[HALF_WIDTH] + other[HALF_LENGTH] * sin + other[HALF_WIDTH] * cos)
    distance: FloatArray = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0))
    return distance


def _measure_along_road(a: FloatArray, b: FloatArray, settings: RelationSettings, measures: _Measures) -> None:
    """Overwrite the measures of pairs on one road."""
    on_one_road = measures.on_one_road
    if not on_one_road.any():
        return
    along = a[ALONG] - b[ALONG]
    across = a[ACROSS] - b[ACROSS]
    forward = np.where(a[TRAVEL] + b[TRAVEL] >= 0, 1.0, -1.0)
    np.copyto(measures.gap, along * forward, where=on_one_road)
    np.copyto(measures.lateral, np.abs(across), where=on_one_road)
    np.copyto(measures.direction, a[TRAVEL] * b[TRAVEL] - settings.road_alignment, where=on_one_road)
    np.copyto(measures.left_of_b, np.where(b[TRAVEL] >= 0, across, -across), where=on_one_road)
    np.copyto(measures.left_of_a, np.where(a[TRAVEL] >= 0, -across, across), where=on_one_road)
