"""Who drove past waiting vehicles and got in before them? Passes of two or more in one lane, then that lane.

A queue jump is two overlaps, one after the other, with two vehicles of one lane that are slower than 2 m/s when the
overlap with each begins: `last`, which is behind, and `first`, less than 40 m ahead of it. Then, at most 30 s after it
came beside `last`, the jumper's centre comes into their lane ahead of `first`, from 2 s before to 10 s after the
overlap with it ends, and nobody else has come beside it meanwhile. It lasts from the first overlap's begin to the lane
change.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from data_gen.truth.event import TruthEvent
from data_gen.truth.motion import TruthTables

STANDING_MPS = 2.0
QUEUE_M = 40.0
"""Two that wait further apart, bumper to bumper, are no queue."""
WITHIN_US = 30_000_000
BEFORE_US, AFTER_US = 2_000_000, 10_000_000
_NEARLY_MPS = 0.5
_NEARLY_US = 500_000
_NEARLY_M = 5.0
_STAYS_US = 500_000


def find_queue_jumps(tables: TruthTables, passes: Iterable[TruthEvent]) -> Iterator[TruthEvent]:
    """Find every queue jump of which at least a part is in view.

    Parameters
    ----------
    tables : of the clip.
    passes : its events of type `pass`, in order of their start.

    Yields
    ------
    Events.
    """
    of_passer: dict[str, list[TruthEvent]] = {}
    for event in passes:
        if event.type == "pass":
            of_passer.setdefault(event.actor, []).append(event)
    column = {vehicle_id: place for place, vehicle_id in enumerate(tables.ids)}
    for passer, own in of_passer.items():
        for number, (behind, ahead) in enumerate(pairwise(own)):
            nobody_until_us = own[number + 2].start_us if number + 2 < len(own) else None
            vehicles = column[passer], column[ahead.other], column[behind.other]
            yield from _jump(tables, vehicles, behind, ahead, nobody_until_us)


def _jump(
    tables: TruthTables,
    vehicles: tuple[int, int, int],
    behind: TruthEvent,
    ahead: TruthEvent,
    nobody_until_us: int | None,
) -> Iterator[TruthEvent]:
    """Tell of the queue jump that two passes in a row and the lane change after them are, if they are one."""
    jumper, first, last = vehicles
    at_last, at_first = (int(np.searchsorted(tables.t_us, one.start_us)) for one in (behind, ahead))
    lane = int(tables.lane[at_last, last])
    slowness_mps = max(float(tables.speed_mps[at_last, last]), float(tables.speed_mps[at_first, first]))
    in_lane = lane >= 0 and (tables.lane[at_last : at_first + 1, [first, last]] == lane).all()
    apart_m = float(tables.along_m[at_last, first] - tables.along_m[at_last, last])
    free_m = apart_m - float(tables.length_m[first] + tables.length_m[last]) / 2
    in_order = apart_m > 0.0 and free_m < QUEUE_M + _NEARLY_M
    if not in_lane or not in_order or slowness_mps > STANDING_MPS + _NEARLY_MPS:
        return
    step = _comes_into(tables, jumper, lane, ahead)
    if step is None or (tables.lane[at_first : step + 1, first] != lane).any():
        return
    end_us = int(tables.t_us[step])
    is_in_time = behind.start_us < ahead.start_us < end_us <= behind.start_us + WITHIN_US
    if not is_in_time or (nobody_until_us is not None and nobody_until_us < end_us - _NEARLY_US):
        return
    reasons = [*_reasons(tables, vehicles, (behind, ahead), end_us), *_doubts_of_queue(slowness_mps, free_m)]
    if nobody_until_us is not None and nobody_until_us < end_us + _NEARLY_US:
        reasons.append("the jumper is about to come beside another one")
    place = "lane", tables.network.lanes[lane].id
    yield tables.event("queue_jump", vehicles, (behind.start_us, end_us), reasons, places=(place,))


def _doubts_of_queue(slowness_mps: float, free_m: float) -> Iterator[str]:
    """Say what is near to the bounds of a queue: the speed of its cars, or how far they are apart."""
    if slowness_mps > STANDING_MPS - _NEARLY_MPS:
        yield f"a car of the queue is at about {STANDING_MPS:g} m/s"
    if free_m > QUEUE_M - _NEARLY_M:
        yield f"the two of the queue are about {QUEUE_M:g} m apart"


def _reasons(
    tables: TruthTables, vehicles: tuple[int, int, int], passes: tuple[TruthEvent, TruthEvent], end_us: int
) -> list[str]:
    """Say why the passes do not count, what is out of view, and whether the lane change is too early or too late."""
    behind, ahead = passes
    reasons = list(dict.fromkeys(one.why_not_countable for one in passes if one.why_not_countable))
    reasons += tables.doubts_of_view("queue_jump", vehicles, (behind.start_us, end_us))
    if not ahead.end_us - BEFORE_US + _NEARLY_US < end_us < ahead.end_us + AFTER_US - _NEARLY_US:
        reasons.append("the time of the lane change is near to what decides")
    return reasons


def _comes_into(tables: TruthTables, jumper: int, lane: int, ahead: TruthEvent) -> int | None:
    """Find the step at which the jumper comes into the queue's lane, to stay; None if it does not in time."""
    t_us, own = tables.t_us, tables.lane[:, jumper]
    start, end = np.searchsorted(t_us, (ahead.end_us - BEFORE_US, ahead.end_us + AFTER_US)).tolist()
    for step in range(max(start, 1), min(end, len(t_us))):
        stays = own[step : int(np.searchsorted(t_us, t_us[step] + _STAYS_US))]
        if own[step - 1] != lane and (stays == lane).all():
            return step
    return None
