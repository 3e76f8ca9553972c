"""Who overtook whom, exactly? Finds overtakes, aborted ones and passes from simulated motion alone.

With s the centre's coordinate along the road in the direction of travel, g = s_a - s_b and h half the sum of the
lengths, a pair is *behind* (g < -h), *overlapping* (|g| <= h) or *ahead* (g > h). An overlap that is entered from
behind and left ahead is an overtake of b by a; left behind again it is an aborted one; a `pass` if b was not faster
than 2 m/s all through the overlap. The core interval runs from the first step of the overlap to the first one after it.

An event is countable only if both centres are in view from 1 s before to 1 s after the core. The others are kept with
the reason: finding them is no mistake and missing them neither. What happened wholly out of view is left out, and
so is a pair that comes together or parts while side by side.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Literal

import numpy as np

from data_gen.motion import Motion, PairRun, pair_runs
from data_gen.view import BoolArray

EventType = Literal["overtake", "aborted_overtake", "pass"]

ROLES: Mapping[EventType, tuple[str, str]] = MappingProxyType(
    {
        "overtake": ("overtaker", "overtaken"),
        "aborted_overtake": ("overtaker", "overtaken"),
        "pass": ("passer", "passed"),
    }
)
"""Role of the vehicle that comes from behind, and of the other one."""

MARGIN_US = 1_000_000
STANDING_MPS = 2.0


@dataclass(frozen=True, slots=True)
class TruthEvent:
    """Something that a vehicle did to another one."""

    type: EventType
    actor: str
    """The vehicle that comes from behind."""
    other: str
    start_us: int
    """Core interval, half-open."""
    end_us: int
    manoeuvre_start_us: int | None
    """When the actor's centre left the other's lane; None if that was before the clip or never."""
    manoeuvre_end_us: int | None
    """When it was back in that lane; None if that is after the clip or never."""
    countable: bool
    why_not_countable: str | None


@dataclass(frozen=True, slots=True)
class _Overlap:
    """Steps of one overlap within a run: [start, end), and from where it was entered and left."""

    start: int
    end: int
    before: int | None
    """-1 behind, +1 ahead, None where the run starts inside the overlap."""
    after: int | None


def find_events(motion: Motion, visible: BoolArray) -> tuple[TruthEvent, ...]:
    """Find every event of which at least a part is in view.

    Parameters
    ----------
    motion : the vehicles' movement; steps at most 100 ms apart, so that no overlap is stepped over.
    visible : (steps, vehicles), True where a vehicle's centre is in view and not hidden.

    Returns
    -------
    Events by start, actor and other.
    """
    events = [
        event
        for run in pair_runs(motion)
        for overlap in _overlaps(run)
        if (event := _event(motion, visible, run, overlap)) is not None
    ]
    return tuple(sorted(events, key=lambda event: (event.start_us, event.actor, event.other)))


def _overlaps(run: PairRun) -> Iterator[_Overlap]:
    phase = np.where(run.gap_m < -run.reach_m, -1, np.where(run.gap_m > run.reach_m, 1, 0))
    edges = [0, *(np.flatnonzero(np.diff(phase)) + 1).tolist(), len(phase)]
    for start, end in pairwise(edges):
        if phase[start] == 0:
            before = int(phase[start - 1]) if start > 0 else None
            after = int(phase[end]) if end < len(phase) else None
            yield _Overlap(start, end, before, after)


def _event(motion: Motion, visible: BoolArray, run: PairRun, overlap: _Overlap) -> TruthEvent | None:
    actor, other = _actor_first(run, overlap)
    by_clip = _reaches_clip_ends(motion, run)
    # Where a pair comes together or parts side by side (a slip road, a turn), nobody has overtaken.
    cut_by_road = (overlap.before is None and not by_clip[0]) or (overlap.after is None and not by_clip[1])
    if actor is None or other is None or cut_by_road:
        return None
    steps = slice(run.first_step + overlap.start, run.first_step + overlap.end)
    # A run that ends inside the overlap has no step after it: the core ends with the last step seen.
    end_step = min(steps.stop, run.first_step + len(run.gap_m) - 1)
    core_us = (int(motion.t_us[steps.start]), int(motion.t_us[end_step]))
    seen = _visibility(motion, visible, (actor, other), core_us)
    if not seen.any():
        return None
    event_type = _event_type(motion, other, overlap, steps)
    reasons = _cut_short(motion, run, overlap, core_us) + _out_of_view(seen, ROLES[event_type])
    leave_us, return_us = _manoeuvre(motion, actor, other, steps.start)
    return TruthEvent(
        type=event_type,
        actor=motion.ids[actor],
        other=motion.ids[other],
        start_us=core_us[0],
        end_us=core_us[1],
        manoeuvre_start_us=leave_us,
        manoeuvre_end_us=return_us,
        countable=not reasons,
        why_not_countable="; ".join(reasons) or None,
    )


def _actor_first(run: PairRun, overlap: _Overlap) -> tuple[int | None, int | None]:
    """Tell who came from behind; nobody, if neither end of the overlap was seen."""
    came_from_behind = overlap.before if overlap.before is not None else -(overlap.after or 0)
    if came_from_behind == 0:
        return None, None
    return (run.a, run.b) if came_from_behind < 0 else (run.b, run.a)


def _event_type(motion: Motion, other: int, overlap: _Overlap, steps: slice) -> EventType:
    if overlap.before is not None and overlap.before == overlap.after:
        return "aborted_overtake"
    return "pass" if motion.speed_mps[steps, other].min() <= STANDING_MPS else "overtake"


def _visibility(motion: Motion, visible: BoolArray, pair: tuple[int, int], core_us: tuple[int, int]) -> BoolArray:
    """Cut out (steps, 2): actor and other, from 1 s before to 1 s after the core as far as the clip goes."""
    first, last = np.searchsorted(motion.t_us, (core_us[0] - MARGIN_US, core_us[1] + MARGIN_US))
    return np.asarray(visible[first : last + 1, list(pair)], dtype=np.bool_)


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


def _out_of_view(seen: BoolArray, roles: tuple[str, str]) -> list[str]:
    return [
        f"the {role} is not in view from 1 s before to 1 s after the core"
        for column, role in enumerate(roles)
        if not seen[:, column].all()
    ]


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
