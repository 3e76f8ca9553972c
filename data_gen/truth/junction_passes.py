"""Who may have passed whom where no road says what is ahead? Overlaps in junctions, which never count.

A driver who goes straight on past one who waits to turn left passes him, if one likes. Along which line the two are
compared is a matter of taste there, and so is the time: such passes are kept as events that do not count. Two vehicles
of about the same heading are compared along the mean of their headings, loosely: they overlap while the gap is at most
half the sum of the lengths and 1 m, less than 9 m apart sideways.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from data_gen.simulation.states import BoolArray, FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.motion import TruthTables, stretches

SLOWEST_MPS = 1.5
_SAME_HEADING_COS = math.cos(math.radians(50.0))
_BESIDE_M, _LONGER_M = 9.0, 1.0
_REACH_M = 30.0
_REASON = "it is in a junction, where no road says who is ahead"


def find_junction_passes(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every overlap of two vehicles of which one is off the roads meanwhile, or on another road.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    Events of type `pass` that do not count; where a part of the overlap is on one road, `overtake` and
    `aborted_overtake` as well.
    """
    overlaps: dict[tuple[int, int], dict[int, float]] = {}
    for step in range(len(tables.motion.t_us)):
        for a, b, gap_m in _overlapping(tables, step):
            overlaps.setdefault((a, b), {})[step] = gap_m
    for pair, gaps_m in sorted(overlaps.items()):
        steps = np.array(list(gaps_m))
        for first, end in stretches(np.isin(np.arange(steps[-1] + 1), steps)):
            together = _on_one_road(tables, pair, slice(max(first - 1, 0), end + 1))
            if not together.all():
                passer, passed = pair if gaps_m[end - 1] > gaps_m[first] else pair[::-1]
                yield from _border_events(tables, (passer, passed), (first, end), is_road_near=bool(together.any()))


def _on_one_road(tables: TruthTables, pair: tuple[int, int], steps: slice) -> BoolArray:
    road = tables.motion.road[steps, :][:, list(pair)]
    return np.asarray((road[:, 0] == road[:, 1]) & (road[:, 0] >= 0), dtype=np.bool_)


def _overlapping(tables: TruthTables, step: int) -> Iterator[tuple[int, int, float]]:
    """Give pairs a < b that overlap: their columns, and the gap from b to a."""
    here = np.flatnonzero(tables.seen[step])
    x_m, y_m, heading_rad = (table[step, here] for table in (tables.x_m, tables.y_m, tables.heading_rad))
    apart_m = np.hypot(x_m[:, None] - x_m[None, :], y_m[:, None] - y_m[None, :])
    first, second = np.nonzero(np.triu(apart_m < _REACH_M, k=1))
    turn_rad = heading_rad[first] - heading_rad[second]
    mean_rad = heading_rad[second] + np.arctan2(np.sin(turn_rad), np.cos(turn_rad)) / 2
    east_m, north_m = x_m[first] - x_m[second], y_m[first] - y_m[second]
    gap_m: FloatArray = east_m * np.cos(mean_rad) + north_m * np.sin(mean_rad)
    aside_m = np.abs(north_m * np.cos(mean_rad) - east_m * np.sin(mean_rad))
    length_m = tables.motion.length_m[here]
    overlap = np.abs(gap_m) <= (length_m[first] + length_m[second]) / 2 + _LONGER_M
    overlap &= (aside_m < _BESIDE_M) & (np.cos(turn_rad) > _SAME_HEADING_COS)
    for row in np.flatnonzero(overlap).tolist():
        yield int(here[first[row]]), int(here[second[row]]), float(gap_m[row])


def _border_events(
    tables: TruthTables, pair: tuple[int, int], steps: tuple[int, int], *, is_road_near: bool
) -> Iterator[TruthEvent]:
    """Make a pass of the overlap if the one who gains ever moves; all that it may be if a part of it is on one road."""
    motion = tables.motion
    rows = slice(*steps)
    # Loosely, the overlap may begin while both still stand at a light.
    fastest_mps = motion.speed_mps[rows, :][:, list(pair)].max(axis=0)
    names = motion.ids[pair[0]], motion.ids[pair[1]]
    pass_ = TruthEvent(
        type="pass",
        vehicles=names,
        start_us=int(motion.t_us[steps[0]]),
        end_us=int(motion.t_us[min(steps[1], len(motion.t_us) - 1)]),
        countable=False,
        why_not_countable=_REASON,
    )
    if fastest_mps[0] > SLOWEST_MPS:
        yield pass_
    if is_road_near and fastest_mps.min() > SLOWEST_MPS:
        yield replace(pass_, type="overtake")
        yield replace(pass_, type="aborted_overtake")
        yield replace(pass_, type="aborted_overtake", vehicles=names[::-1])
