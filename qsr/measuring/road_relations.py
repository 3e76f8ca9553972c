"""How far along, sideways and apart are the two objects of every pair?

Two objects on one road are measured along that road: the gap follows its bends and is continuous in the oncoming lane.
Elsewhere, if the map says how one comes to where the other is, the pair is measured along that route, else along the
mean of the two headings, so that "a behind b" and "b ahead of a" are one fact.
Left and right are of the reference object: across its road in its direction of travel, else across its body.
"""

import math
from dataclasses import dataclass

import numpy as np

from qsr.measuring.conflicts import conflict_noise, fill_conflicts, fill_headways
from qsr.measuring.footprints import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    ROAD,
    TRAVEL,
    BoolArray,
    FloatArray,
    LongArray,
    shares_road,
)
from qsr.measuring.free_space import FreeSpace
from qsr.measuring.routes import Routes
from qsr.relations import Switch
from qsr.settings import RelationSettings

# Headings that are nearly opposite have no mean; the gap means nothing there and only has to stay finite.
_LEAST_MEAN = 0.01


@dataclass(slots=True)
class _Measures:
    """Hold what is measured of every pair (a, b), each (pairs,) except where noted."""

    gap: FloatArray  # a's centre ahead of b's, in the direction of travel
    lateral: FloatArray  # between the centres, sideways, >= 0
    direction: FloatArray  # above zero in the same direction
    left: FloatArray  # (2, pairs): b's centre in a's frame, a's in b's
    on_one_road: BoolArray


def switch_values(
    table: FloatArray,
    columns: LongArray,
    settings: RelationSettings,
    *,
    rows: int = len(Switch),
    routes: Routes | None = None,
) -> FloatArray:
    """Measure the quantity of every switch of every pair.

    Parameters
    ----------
    table : (13, n) as made by `qsr.measuring.footprints.object_table`.
    columns : (2, pairs), of a and of b.
    settings : thresholds.
    rows : how many switches are asked for, from the first on.
    routes : the ways between the columns of the table; None where the map says nothing of them.

    Returns
    -------
    (rows, pairs) as in `qsr.relations.Switch`; a switch is on above zero. Metres, cosines for the direction, seconds
    for the time gaps; for the conflicts seconds and metres per second squared.
    """
    ends = table.take(columns, axis=1)
    free = FreeSpace.of(ends)
    measures = _measure(ends, free, settings)
    if routes is not None:
        _measure_along_routes(routes, columns, settings, measures)
    values = np.empty((len(Switch), columns.shape[1]))
    _fill_positions(values, ends, free, measures, settings)
    if rows > Switch.IN_PATH:
        fill_headways(
            values,
            ends,
            gap_m=measures.gap,
            lateral_m=measures.lateral,
            direction=measures.direction,
            columns=columns,
            settings=settings,
        )
    if rows > Switch.SHORT_TTC:
        fill_conflicts(values, ends, free, on_one_road=measures.on_one_road, settings=settings)
    return values[:rows]


def _fill_positions(
    values: FloatArray, ends: FloatArray, free: FreeSpace, measures: _Measures, settings: RelationSettings
) -> None:
    half_lengths = ends[HALF_LENGTH, 0] + ends[HALF_LENGTH, 1]
    half_widths = ends[HALF_WIDTH, 0] + ends[HALF_WIDTH, 1]
    values[Switch.PAST_REAR] = measures.gap + half_lengths
    values[Switch.PAST_FRONT] = measures.gap - half_lengths
    # On one carriageway cars are beside each other however many lanes are between them.
    aside_m = np.where(measures.on_one_road, 0.0, measures.lateral)
    values[Switch.LATERAL_NEAR] = settings.beside_lateral_m - aside_m
    values[Switch.SAME_DIRECTION] = measures.direction
    values[Switch.CLOSE] = settings.close_m - free.apart_m(ends)
    left_of_a, left_of_b = measures.left
    values[Switch.A_LEFT_OF_B] = left_of_b - half_widths
    values[Switch.A_RIGHT_OF_B] = -left_of_b - half_widths
    values[Switch.B_LEFT_OF_A] = left_of_a - half_widths
    values[Switch.B_RIGHT_OF_A] = -left_of_a - half_widths


def switch_margins(settings: RelationSettings) -> FloatArray:
    """List the margin of every switch, (switches,), in the unit of its quantity."""
    margins = np.full(len(Switch), settings.margin_m)
    margins[Switch.SAME_DIRECTION] = settings.direction_margin
    margins[Switch.CLOSE] = max(settings.close_margin_m, settings.margin_m)
    margins[Switch.A_FOLLOWS_B : Switch.B_AT_SHORT_HEADWAY + 1] = settings.time_gap_margin_s
    margins[Switch.SHORT_TTC] = settings.conflict_ttc_margin_s
    margins[Switch.HARD_BRAKING] = settings.conflict_braking_margin_mps2
    return margins


def switch_noise(
    values: FloatArray, sigma_m: FloatArray, *, margins: FloatArray, settings: RelationSettings
) -> FloatArray:
    """Say how far the quantities of a pair may be off, (switches,): their standard deviations, each in its unit.

    Parameters
    ----------
    values : (switches,) the quantities, as many as were asked for.
    sigma_m : (2,) standard deviations of the two places.
    margins : (switches,); each is as many standard deviations as that of positions, save where speeds matter more.
    settings : thresholds.
    """
    noise = margins * (math.hypot(*sigma_m) / settings.margin_m)
    if len(values) > Switch.HARD_BRAKING:
        noise[[Switch.SHORT_TTC, Switch.HARD_BRAKING]] = conflict_noise(values, sigma_m, settings)
    return noise


def is_on_one_road(ends: FloatArray, apart_m: FloatArray, settings: RelationSettings) -> BoolArray:
    """Tell which pairs are measured along their common road.

    Parameters
    ----------
    ends : (13, 2, pairs) columns of the object table: a and b of each pair.
    apart_m : (pairs,) between the centres.
    settings : thresholds.
    """
    far_m = settings.far_along * np.maximum(apart_m, settings.leave_radius_m)
    return np.asarray(shares_road(ends[ROAD]) & (np.abs(ends[ALONG, 0] - ends[ALONG, 1]) <= far_m))


def _measure(ends: FloatArray, free: FreeSpace, settings: RelationSettings) -> _Measures:
    """Measure along the common road, or else along the mean of the headings."""
    # The unit vectors of both headings add up to their mean direction; the sum is the root of 2 + 2 cos long.
    mean = np.sqrt(np.maximum(2.0 + 2.0 * free.cos_between, _LEAST_MEAN))
    measures = _Measures(
        gap=(free.ahead[1] - free.ahead[0]) / mean,
        lateral=np.abs(free.left[1] - free.left[0]) / mean,
        direction=free.cos_between - math.cos(settings.heading_limit_rad),
        left=free.left,
        on_one_road=is_on_one_road(ends, np.hypot(free.x[0], free.y[0]), settings),
    )
    if measures.on_one_road.any():
        _measure_along_road(ends, settings, measures)
    return measures


def _measure_along_road(ends: FloatArray, settings: RelationSettings, measures: _Measures) -> None:
    """Replace the measures of pairs on one road."""
    on_one_road = measures.on_one_road
    travel = ends[TRAVEL]
    along = ends[ALONG, 0] - ends[ALONG, 1]
    across = ends[ACROSS, ::-1] - ends[ACROSS]
    forward = np.where(travel[0] + travel[1] >= 0, along, -along)
    np.copyto(measures.gap, forward, where=on_one_road)
    np.copyto(measures.lateral, np.abs(across[0]), where=on_one_road)
    np.copyto(measures.direction, travel[0] * travel[1] - settings.road_alignment, where=on_one_road)
    measures.left = np.where(on_one_road, np.where(travel >= 0, across, -across), measures.left)


def _measure_along_routes(routes: Routes, columns: LongArray, settings: RelationSettings, measures: _Measures) -> None:
    """Replace the measures of pairs that are not on one road, but of which one may come to where the other is.

    Left and right stay those of the bodies.
    """
    asked = (~measures.on_one_road).nonzero()[0]
    to_b_m, to_a_m = routes.ways_m(columns.take(asked, axis=1))
    # On a ring each is ahead of the other: only who is much nearer this way round than that is behind.
    leads = settings.far_along * np.minimum(to_b_m, to_a_m) < np.maximum(to_b_m, to_a_m)
    found = asked[leads]
    measures.gap[found] = np.where(to_b_m < to_a_m, -to_b_m, to_a_m)[leads]
    measures.lateral[found] = routes.aside_m(columns.take(found, axis=1), settings.widest_m)
    measures.direction[found] = 1.0 - math.cos(settings.heading_limit_rad)
