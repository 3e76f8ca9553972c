"""Who followed whom, and who drove on whose bumper? Stretches of time gaps between a vehicle and the next one ahead.

The next one ahead drives the same way on the same road, in the lane under the follower's centre, and nobody drives in
between. The time gap is the distance from bumper to bumper over the follower's speed. A `follow` is a time gap below
3 s for 5 s or more, faster than 2 m/s; `tailgating` one below 1 s for 3 s or more, faster than 30 km/h. Both last while
both vehicles are seen.

Each condition is asked three times: as it stands, *strictly* (limits a tenth tighter, speeds 0.5 m/s higher, in one
lane and overlapping sideways as well) and *loosely* (limits a tenth wider, speeds 0.5 m/s lower, either of the two; in
a junction, where no lane tells who is next, somebody ahead of about the same heading is enough). An event counts if the
three agree within 1 s on when it is.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import BoolArray, FloatArray
from data_gen.truth.event import TruthEvent, reasons_cut_by_clip
from data_gen.truth.motion import LOOSE, NOMINAL, STRICT, TruthTables, stretches

SAME_HEADING_COS = math.cos(math.radians(50.0))
_NEARLY_US = 1_000_000
_SLOWER_MPS = 0.5
_FARTHEST_M = 160.0
_BETWEEN_M = 30.0
_BORDER_SHARE = 0.6
"""Shorter stretches are no events at all: an observer may be off by a second at both ends."""


@dataclass(frozen=True, slots=True)
class GapRule:
    """One type of event that is made of a short time gap."""

    type: str
    gap_s: float
    least_mps: float
    least_us: int


RULES = (
    GapRule("follow", gap_s=3.0, least_mps=2.0, least_us=5_000_000),
    GapRule("tailgating", gap_s=1.0, least_mps=30 / 3.6, least_us=3_000_000),
)

_FACTOR = {NOMINAL: 1.0, STRICT: 0.9, LOOSE: 1.1}
_FASTER_MPS = {NOMINAL: 0.0, STRICT: _SLOWER_MPS, LOOSE: -_SLOWER_MPS}


@dataclass(frozen=True, slots=True, eq=False)
class NextAhead:
    """At each step, pairs in which the second one may be the next one ahead of the first."""

    follower: NDArray[np.intp]
    """(pairs,) columns of the tables."""
    leader: NDArray[np.intp]
    bumper_m: FloatArray
    """From bumper to bumper."""
    level: BoolArray
    """(pairs, 3): nominally, strictly, loosely next ahead."""


def find_following(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every stretch of following and of tailgating.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    Events; those that do not count have the interval of the loose condition.
    """
    holds = _short_gaps(tables)
    for (rule_number, follower, leader), levels in sorted(holds.items()):
        yield from _events(tables, RULES[rule_number], follower, leader, levels)


def _short_gaps(tables: TruthTables) -> dict[tuple[int, int, int], BoolArray]:
    """By rule, follower and leader: (steps, 3), where the rule's gap and speed hold; only pairs that ever do."""
    steps = len(tables.t_us)
    found: dict[tuple[int, int, int], BoolArray] = {}
    for step in range(steps):
        pairs = next_ahead(tables, step)
        speed_mps = tables.speed_mps[step, pairs.follower]
        for number, rule in enumerate(RULES):
            short = np.column_stack(
                [
                    pairs.level[:, level]
                    & (pairs.bumper_m < rule.gap_s * _FACTOR[level] * speed_mps)
                    & (speed_mps > rule.least_mps + _FASTER_MPS[level])
                    for level in (NOMINAL, STRICT, LOOSE)
                ]
            )
            for row in np.flatnonzero(short[:, LOOSE]).tolist():
                key = number, int(pairs.follower[row]), int(pairs.leader[row])
                found.setdefault(key, np.zeros((steps, 3), dtype=np.bool_))[step] = short[row]
    return found


def next_ahead(tables: TruthTables, step: int) -> NextAhead:
    """Find who drives behind whom, with nobody in between.

    Parameters
    ----------
    tables : of the clip.
    step : which one.

    Returns
    -------
    Pairs that are at least loosely so.
    """
    here = np.flatnonzero(tables.present[step] & _around_seen(tables, step))
    length_m = tables.length_m[here]
    half_m = (length_m[:, None] + length_m[None, :]) / 2
    on_road = (tables.road[step, here] >= 0) & (tables.direction[step, here] != 0)
    way = np.where(on_road, 2 * tables.road[step, here] + (tables.direction[step, here] > 0), -1)
    one_way = (way[:, None] == way[None, :]) & on_road[:, None]
    along_m = tables.along_m[step, here]
    bumper_m = along_m[None, :] - along_m[:, None] - half_m
    levels = _levels_on_road(tables, step, here, one_way, np.where(bumper_m > -half_m / 4, bumper_m, np.inf))
    off_m, off = _over_junction(tables, step, here, half_m, one_way)
    levels[..., LOOSE] |= off
    bumper_m = np.where(one_way, bumper_m, off_m)
    follower, leader = np.nonzero(levels[..., LOOSE] & (bumper_m < _FARTHEST_M))
    return NextAhead(here[follower], here[leader], bumper_m[follower, leader], levels[follower, leader])


def _levels_on_road(
    tables: TruthTables, step: int, here: NDArray[np.intp], one_way: BoolArray, ahead_m: FloatArray
) -> BoolArray:
    """Say who is nominally, strictly and loosely next on one road; `ahead_m` is endless for who is not ahead."""
    across_m, width_m, lane = tables.across_m[step, here], tables.width_m[here], tables.lane[step, here]
    apart_m = np.abs(across_m[None, :] - across_m[:, None])
    overlap = one_way & (apart_m < (width_m[:, None] + width_m[None, :]) / 2)
    one_lane = one_way & (lane[:, None] == lane[None, :]) & (lane[:, None] >= 0)
    return np.stack(
        [
            _nearest(one_lane, ahead_m),
            _nearest(one_lane & overlap, ahead_m) & _nearest(one_lane | overlap, ahead_m),
            _nearest(one_lane, ahead_m) | _nearest(overlap, ahead_m),
        ],
        axis=-1,
    )


def _around_seen(tables: TruthTables, step: int) -> BoolArray:
    """Mark who is in view or may be between two that are: the others cost time only."""
    seen: BoolArray = np.asarray(tables.seen[step], dtype=np.bool_)
    if not seen.any():
        return seen
    near = np.ones(len(seen), dtype=np.bool_)
    for place_m in (tables.x_m[step], tables.y_m[step]):
        with np.errstate(invalid="ignore"):
            near &= (place_m > place_m[seen].min() - _BETWEEN_M) & (place_m < place_m[seen].max() + _BETWEEN_M)
    return near


def _nearest(candidates: BoolArray, ahead_m: FloatArray) -> BoolArray:
    """Keep of each row's candidates the nearest one ahead."""
    distance_m = np.where(candidates, ahead_m, np.inf)
    nearest_m = distance_m.min(axis=1, initial=np.inf)
    return np.asarray(np.isfinite(distance_m) & (distance_m <= nearest_m[:, None]), dtype=np.bool_)


def _over_junction(
    tables: TruthTables, step: int, here: NDArray[np.intp], half_m: FloatArray, one_way: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """Measure pairs that do not share a road in a straight line, and say who may be next ahead."""
    x_m, y_m, heading_rad = (table[step, here] for table in (tables.x_m, tables.y_m, tables.heading_rad))
    east_m, north_m = x_m[None, :] - x_m[:, None], y_m[None, :] - y_m[:, None]
    forward_m = east_m * np.cos(heading_rad)[:, None] + north_m * np.sin(heading_rad)[:, None]
    bumper_m = np.hypot(east_m, north_m) - half_m
    alike = np.cos(heading_rad[None, :] - heading_rad[:, None]) > SAME_HEADING_COS
    return bumper_m, np.asarray(~one_way & alike & (forward_m > 0), dtype=np.bool_)


def _events(tables: TruthTables, rule: GapRule, follower: int, leader: int, levels: BoolArray) -> Iterator[TruthEvent]:
    both = tables.seen[:, follower] & tables.seen[:, leader]
    t_us = tables.t_us
    for start, end in stretches(levels[:, LOOSE]):
        in_view = np.flatnonzero(both[start:end])
        if not len(in_view):
            continue
        first, last = start + int(in_view[0]), start + int(in_view[-1]) + 1
        loose_us = tables.span_us(first, last)
        if loose_us[1] - loose_us[0] < _BORDER_SHARE * rule.least_us:
            continue
        reasons = reasons_cut_by_clip(t_us, *loose_us)
        if len(in_view) < last - first:
            reasons.append("one of the two is hidden meanwhile")
        core_us = tables.agreed_us(levels[first:last], first, within_us=_NEARLY_US)
        if core_us is None:
            reasons.append("the time gap, the speed or the lane is near to what decides")
        elif core_us[1] - core_us[0] < 1.1 * rule.least_us:
            reasons.append(f"it lasts about {rule.least_us / 1e6:g} s, which is what decides")
        told_us = core_us if core_us is not None and not reasons else loose_us
        yield tables.event(rule.type, (follower, leader), told_us, reasons)
