"""Who overtook whom, exactly? Finds overtakes, aborted ones and passes from simulated motion alone.

With s the centre's coordinate along the road in the direction of travel, g = s_a - s_b and h half the sum of the
lengths, a pair is *behind* (g < -h), *overlapping* (|g| <= h) or *ahead* (g > h). An overlap that is entered from
behind and left ahead is a `pass` of b by a if a was faster than 2 m/s all through it, and an `overtake` as well if b
was; left behind again it is an `aborted_overtake`. The core interval runs from the first step of the overlap to the
first one after it.

An event is countable only if both centres are in view from 1 s before to 1 s after the core, and if no speed came
within 0.5 m/s of the one that decides and no distance within 1 m. The others are kept with the reason: finding them is
no mistake and missing them neither. What happened wholly out of view is left out, and so is a pair that comes together
or parts while side by side.

In junctions no road says what is ahead. A driver who goes straight on past one who waits to turn left passes him, if
one likes; along which line the two are compared is a matter of taste there, and so is the time: such passes are kept as
events that do not count. Two vehicles of about the same heading are compared along the mean of their headings, loosely:
they overlap while the gap is at most half the sum of the lengths and 1 m, less than 9 m apart sideways.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import BoolArray, FloatArray
from data_gen.truth.event import MARGIN_US, ROLES, TruthEvent, in_order, reasons_out_of_view, rows_around
from data_gen.truth.motion import Motion, PairRun, TruthTables, pair_runs, stretches

STANDING_MPS = 2.0
NEARLY_MPS = 0.5
"""A speed that comes so near to the one that decides leaves open what an observer calls it."""
NEARLY_M = 1.0
"""So does an overlap, or a distance after it, that is shorter."""
SLOWEST_MPS = 1.5
_SAME_HEADING_COS = math.cos(math.radians(50.0))
_BESIDE_M, _LONGER_M = 9.0, 1.0
_REACH_M = 30.0
_REASON = "it is in a junction, where no road says who is ahead"


@dataclass(frozen=True, slots=True)
class _Overlap:
    """Steps of one overlap within a run: [start, end), and from where it was entered and left."""

    start: int
    end: int
    before: int | None
    """-1 behind, +1 ahead, None where the run starts inside the overlap."""
    after: int | None
    clear_m: float
    """How far apart the bodies get along the road, before and after it; the smaller of the two."""
    depth_m: float
    """How far the bodies come to overlap."""


def find_events(motion: Motion, visible: BoolArray) -> tuple[TruthEvent, ...]:
    """Find every overtake, aborted overtake and pass of which at least a part is in view.

    Parameters
    ----------
    motion : the vehicles' movement; steps at most 100 ms apart, so that no overlap is stepped over.
    visible : (steps, vehicles), True where a vehicle's centre is in view and not hidden.

    Returns
    -------
    Events by start, vehicles and type.
    """
    return in_order(
        event
        for run in pair_runs(motion)
        for overlap in _overlaps(run)
        for event in _events(motion, visible, run, overlap)
    )


def _overlaps(run: PairRun) -> Iterator[_Overlap]:
    phase = np.where(run.gap_m < -run.reach_m, -1, np.where(run.gap_m > run.reach_m, 1, 0))
    edges = [0, *(np.flatnonzero(np.diff(phase)) + 1).tolist(), len(phase)]
    for start, end in pairwise(edges):
        if phase[start] == 0:
            before = int(phase[start - 1]) if start > 0 else None
            after = int(phase[end]) if end < len(phase) else None
            free_m = np.abs(run.gap_m) - run.reach_m
            clear_m = min(_farthest(free_m, phase, start - 1, -1), _farthest(free_m, phase, end, 1))
            yield _Overlap(start, end, before, after, clear_m, -float(free_m[start:end].min()))


def _farthest(free_m: FloatArray, phase: NDArray[np.int_], step: int, way: int) -> float:
    """Give the largest distance while the phase lasts, from a step forwards or backwards; no limit where it is none."""
    rest = phase[step::way] if 0 <= step < len(phase) else phase[:0]
    if not len(rest):
        return np.inf
    other = np.flatnonzero(rest != rest[0])
    return float(free_m[step::way][: other[0] if len(other) else len(rest)].max())


def _events(motion: Motion, visible: BoolArray, run: PairRun, overlap: _Overlap) -> Iterator[TruthEvent]:
    actor, other = _actor_first(run, overlap)
    by_clip = _reaches_clip_ends(motion, run)
    # Where a pair comes together or parts side by side (a slip road, a turn), nobody has overtaken.
    cut_by_road = (overlap.before is None and not by_clip[0]) or (overlap.after is None and not by_clip[1])
    if actor is None or other is None or cut_by_road:
        return
    steps = slice(run.first_step + overlap.start, run.first_step + overlap.end)
    # A run that ends inside the overlap has no step after it: the core ends with the last step seen.
    end_step = min(steps.stop, run.first_step + len(run.gap_m) - 1)
    core_us = motion.span_us(steps.start, end_step)
    seen = visible[rows_around(motion.t_us, *core_us), :][:, [actor, other]]
    if not seen.any():
        return
    cut_short = _cut_short(motion, run, overlap, core_us)
    nearly = _nearly_none(overlap)
    leave_us, return_us = _manoeuvre(motion, actor, other, steps.start)
    for event_type, unclear in _types(motion, (actor, other), overlap, steps):
        reasons = [*cut_short, *reasons_out_of_view(seen, ROLES[event_type], "core"), *unclear, *nearly]
        told = motion.event(event_type, (actor, other), core_us, reasons)
        yield replace(told, manoeuvre_start_us=leave_us, manoeuvre_end_us=return_us)


def _nearly_none(overlap: _Overlap) -> list[str]:
    """Say what hangs on less than a metre."""
    reasons: list[str] = []
    if overlap.clear_m < NEARLY_M:
        reasons.append("the two are hardly clear of each other before or after it")
    if overlap.before == overlap.after and overlap.depth_m < NEARLY_M:
        reasons.append("the two hardly overlap")
    return reasons


def _actor_first(run: PairRun, overlap: _Overlap) -> tuple[int | None, int | None]:
    """Tell who came from behind; nobody, if neither end of the overlap was seen."""
    came_from_behind = overlap.before if overlap.before is not None else -(overlap.after or 0)
    if came_from_behind == 0:
        return None, None
    return (run.a, run.b) if came_from_behind < 0 else (run.b, run.a)


def _types(motion: Motion, pair: tuple[int, int], overlap: _Overlap, steps: slice) -> Iterator[tuple[str, list[str]]]:
    """Tell what an overlap is, and for each what leaves it open."""
    slowest_mps: FloatArray = motion.speed_mps[steps, :][:, list(pair)].min(axis=0)
    fell_back = overlap.before is not None and overlap.before == overlap.after
    for event_type, asked in (("aborted_overtake", 2),) if fell_back else (("pass", 1), ("overtake", 2)):
        moving = list(zip(ROLES[event_type], slowest_mps.tolist(), strict=True))[:asked]
        if all(speed_mps > STANDING_MPS - NEARLY_MPS for _, speed_mps in moving):
            nearly = [role for role, speed_mps in moving if speed_mps <= STANDING_MPS + NEARLY_MPS]
            yield event_type, [f"the {role} is at about {STANDING_MPS:g} m/s" for role in nearly]


def _reaches_clip_ends(motion: Motion, run: PairRun) -> tuple[bool, bool]:
    return run.first_step == 0, run.first_step + len(run.gap_m) == len(motion.t_us)


def _cut_short(motion: Motion, run: PairRun, overlap: _Overlap, core_us: tuple[int, int]) -> list[str]:
    """Say where the clip, or the road that the pair shares, does not reach 1 s beyond the core."""
    run_us = (int(motion.t_us[run.first_step]), int(motion.t_us[run.first_step + len(run.gap_m) - 1]))
    first, last = ("the clip" if by_clip else "the common road" for by_clip in _reaches_clip_ends(motion, run))
    reasons: list[str] = []
    if overlap.before is None:
        reasons.append("the clip starts during the overlap")
    elif core_us[0] - MARGIN_US < run_us[0]:
        reasons.append(f"{first} starts less than 1 s before the core")
    if overlap.after is None:
        reasons.append("the clip ends during the overlap")
    elif core_us[1] + MARGIN_US > run_us[1]:
        reasons.append(f"{last} ends less than 1 s after the core")
    return reasons


def _manoeuvre(motion: Motion, actor: int, other: int, start: int) -> tuple[int | None, int | None]:
    """Find when the actor was out of the lane in which the other one drives as the core starts."""
    own_lane = motion.lane[start, other]
    away = (motion.lane[:, actor] != own_lane) & (motion.lane[:, actor] >= 0)
    if not away[start]:
        return None, None
    in_lane = motion.lane[:, actor] == own_lane
    before = np.flatnonzero(in_lane[:start])
    after = np.flatnonzero(in_lane[start:])
    leave_us = int(motion.t_us[before[-1] + 1]) if len(before) else None
    return_us = int(motion.t_us[start + after[0]]) if len(after) else None
    return leave_us, return_us


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
    for step in range(len(tables.t_us)):
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
    road = tables.road[steps, :][:, list(pair)]
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
    length_m = tables.length_m[here]
    overlap = np.abs(gap_m) <= (length_m[first] + length_m[second]) / 2 + _LONGER_M
    overlap &= (aside_m < _BESIDE_M) & (np.cos(turn_rad) > _SAME_HEADING_COS)
    for row in np.flatnonzero(overlap).tolist():
        yield int(here[first[row]]), int(here[second[row]]), float(gap_m[row])


def _border_events(
    tables: TruthTables, pair: tuple[int, int], steps: tuple[int, int], *, is_road_near: bool
) -> Iterator[TruthEvent]:
    """Make a pass of the overlap if the one who gains ever moves; all that it may be if a part of it is on one road."""
    rows = slice(*steps)
    # Loosely, the overlap may begin while both still stand at a light.
    fastest_mps = tables.speed_mps[rows, :][:, list(pair)].max(axis=0)
    pass_ = tables.event("pass", pair, tables.span_us(*steps), [_REASON])
    if fastest_mps[0] > SLOWEST_MPS:
        yield pass_
    if is_road_near and fastest_mps.min() > SLOWEST_MPS:
        yield replace(pass_, type="overtake")
        yield replace(pass_, type="aborted_overtake")
        yield replace(pass_, type="aborted_overtake", vehicles=pass_.vehicles[::-1])
