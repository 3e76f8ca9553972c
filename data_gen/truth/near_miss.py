"""Who nearly collided with whom? Bodies that would touch soon, and only hard braking would prevent it.

Two vehicles are in danger while, both going on as they do, their bodies would touch within 1.5 s, and stopping their
approach in that time takes more than 3.4 m/s2. On one road both keep their place across it; elsewhere they go straight
on. When two rectangles touch is exact: along each of the four directions of their sides their shadows overlap from one
time to another, and they touch while all four do (separating axes; Gottschalk, Lin, Manocha 1996, "OBBTree").

The condition is asked three times, as for time gaps: as it stands, strictly and loosely. A `near_miss` lasts for 0.2 s
or more; it counts if it does so strictly, and the three agree on when it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import BoolArray, FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.motion import LOOSE, NOMINAL, STRICT, TruthTables, stretches

CONTACT_S = 1.5
BRAKING_MPS2 = 3.4
LEAST_US = 200_000
_LIMITS = {NOMINAL: (CONTACT_S, BRAKING_MPS2), STRICT: (1.2, 4.2), LOOSE: (1.8, 2.6)}
_AGREED_US = 700_000
_LONGEST_STEP_US = 100_000
_NEVER_S = 1e3
_AT_ONCE_S = 0.05
_STILL_MPS = 1e-9

IndexArray = NDArray[np.intp]
Interval = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class _Bodies:
    """Bodies of one step as seen from one side: entry k of every array is one of a pair."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    vx_mps: FloatArray
    vy_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray


def find_near_misses(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every near miss of which at least a part is in view.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    Events; who of the two is named first says nothing.
    """
    danger: dict[tuple[int, int], BoolArray] = {}
    steps = len(tables.t_us)
    for step in range(steps):
        for pair, levels in _dangers(tables, step):
            danger.setdefault(pair, np.zeros((steps, 3), dtype=np.bool_))[step] = levels
    for pair, levels in sorted(danger.items(), key=lambda item: item[0]):
        for start, end in stretches(levels[:, LOOSE]):
            yield from _event(tables, pair, levels[start:end], start)


def _dangers(tables: TruthTables, step: int) -> Iterator[tuple[tuple[int, int], BoolArray]]:
    """Give the pairs that are at least loosely in danger at a step, and at which levels."""
    first, second = _approaching(tables, step)
    if not len(first):
        return
    a, b = _bodies(tables, step, first), _bodies(tables, step, second)
    free = contact_s(a, b), np.hypot(a.vx_mps - b.vx_mps, a.vy_mps - b.vy_mps)
    road, on_road = _along_road(tables, step, first, second)
    usual = np.where(on_road, road[0], free[0]), np.where(on_road, road[1], free[1])
    levels = np.column_stack([_is_danger(*usual, level=level) for level in (NOMINAL, STRICT, LOOSE)])
    # Along a bend, or half off the road, it is a matter of taste which way somebody would go on.
    levels[:, LOOSE] |= _is_danger(*free, level=LOOSE)
    for row in np.flatnonzero(levels[:, LOOSE]).tolist():
        yield (int(first[row]), int(second[row])), levels[row]


def _is_danger(contact: FloatArray, closing_mps: FloatArray, *, level: int) -> BoolArray:
    within_s, braking_mps2 = _LIMITS[level]
    # Ending a motion of v within the distance v * t takes v / (2 t).
    needed_mps2 = closing_mps / (2.0 * np.maximum(contact, _AT_ONCE_S))
    return np.asarray((contact < within_s) & (needed_mps2 > braking_mps2), dtype=np.bool_)


def _approaching(tables: TruthTables, step: int) -> tuple[IndexArray, IndexArray]:
    """List the pairs, the lower column first, that may touch in time at all."""
    here = np.flatnonzero(tables.present[step])
    x_m, y_m = tables.x_m[step, here], tables.y_m[step, here]
    speed_mps, length_m = tables.speed_mps[step, here], tables.length_m[here]
    seen = tables.seen[step, here]
    first, second = np.triu_indices(len(here), k=1)
    first, second = (places[seen[first] & seen[second]] for places in (first, second))
    apart_m = np.hypot(x_m[first] - x_m[second], y_m[first] - y_m[second])
    reach_m = _LIMITS[LOOSE][0] * (speed_mps[first] + speed_mps[second]) + length_m[first] + length_m[second]
    near = apart_m < reach_m
    return here[first[near]], here[second[near]]


def _bodies(tables: TruthTables, step: int, columns: IndexArray) -> _Bodies:
    heading_rad, speed_mps = tables.heading_rad[step, columns], tables.speed_mps[step, columns]
    return _Bodies(
        x_m=tables.x_m[step, columns],
        y_m=tables.y_m[step, columns],
        heading_rad=heading_rad,
        vx_mps=speed_mps * np.cos(heading_rad),
        vy_mps=speed_mps * np.sin(heading_rad),
        length_m=tables.length_m[columns],
        width_m=tables.width_m[columns],
    )


def contact_s(a: _Bodies, b: _Bodies) -> FloatArray:
    """Compute when two bodies of constant velocity first touch: 0 if they do, a very long time if never."""
    start, end = np.zeros(len(a.x_m)), np.full(len(a.x_m), _NEVER_S)
    for turn_rad in (a.heading_rad, a.heading_rad + np.pi / 2, b.heading_rad, b.heading_rad + np.pi / 2):
        east, north = np.cos(turn_rad), np.sin(turn_rad)
        apart_m = (b.x_m - a.x_m) * east + (b.y_m - a.y_m) * north
        rate_mps = (b.vx_mps - a.vx_mps) * east + (b.vy_mps - a.vy_mps) * north
        from_s, to_s = _while_within(apart_m, rate_mps, _shadow_m(a, turn_rad) + _shadow_m(b, turn_rad))
        start, end = np.maximum(start, from_s), np.minimum(end, to_s)
    return np.where(start < end, start, _NEVER_S)


def _shadow_m(body: _Bodies, turn_rad: FloatArray) -> FloatArray:
    """Half the extent of a body along a direction."""
    turn = turn_rad - body.heading_rad
    half_m: FloatArray = (body.length_m * np.abs(np.cos(turn)) + body.width_m * np.abs(np.sin(turn))) / 2
    return half_m


def _while_within(apart_m: FloatArray, rate_mps: FloatArray, reach_m: FloatArray) -> Interval:
    """Say from when to when a distance that changes at a constant rate is at most the reach."""
    rate_mps = np.where(np.abs(rate_mps) < _STILL_MPS, _STILL_MPS, rate_mps)
    one_s, other_s = (-reach_m - apart_m) / rate_mps, (reach_m - apart_m) / rate_mps
    return np.minimum(one_s, other_s), np.maximum(one_s, other_s)


def _along_road(
    tables: TruthTables, step: int, first: IndexArray, second: IndexArray
) -> tuple[tuple[FloatArray, FloatArray], BoolArray]:
    """Measure contact and closing speed along the common road, and say which pairs have one."""
    way_a, way_b = tables.direction[step, first], tables.direction[step, second]
    on_road = (tables.road[step, first] == tables.road[step, second]) & (tables.road[step, first] >= 0)
    # The tables count in driving direction; here both must count the same way.
    apart_m = tables.along_m[step, second] * way_b - tables.along_m[step, first] * way_a
    rate_mps = tables.speed_mps[step, second] * way_b - tables.speed_mps[step, first] * way_a
    aside_m = np.abs(tables.across_m[step, second] * way_b - tables.across_m[step, first] * way_a)
    half_m = (tables.length_m[first] + tables.length_m[second]) / 2
    from_s, to_s = _while_within(apart_m, rate_mps, half_m)
    meets = (to_s > 0) & (aside_m < (tables.width_m[first] + tables.width_m[second]) / 2)
    contact = np.where(meets, np.maximum(from_s, 0.0), _NEVER_S)
    return (contact, np.abs(rate_mps)), np.asarray(on_road, dtype=np.bool_)


def _event(tables: TruthTables, pair: tuple[int, int], levels: BoolArray, first: int) -> Iterator[TruthEvent]:
    """Tell of a stretch of loose danger; shorter ones than half of what is asked for are nothing."""
    loose_us = tables.span_us(first, first + len(levels))
    if loose_us[1] - loose_us[0] < LEAST_US // 2:
        return
    core_us = tables.agreed_us(levels, first, within_us=_AGREED_US, least_us=LEAST_US + _LONGEST_STEP_US)
    told_us = loose_us if core_us is None else core_us
    reasons = tables.doubts_of_view("near_miss", pair, told_us)
    if core_us is None:
        reasons.append("the time to contact or the braking is near to what decides")
    yield tables.event("near_miss", pair, told_us, reasons)
