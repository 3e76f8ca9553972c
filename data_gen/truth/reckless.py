"""Which overtakes put others at risk? Those that end just before an oncoming vehicle, or that lead into a junction.

*Before an oncoming vehicle*: when the overlap ends, the overtaker is still in a lane against its direction, and it and
a vehicle that comes towards it on the same road will meet, bumper to bumper, in less than 3 s at their speeds.

*Into a junction*: both drove in one lane before, and the overtaker is in a junction at some time of the overlap. Where
no road says who is ahead the time of an overlap is a matter of taste, so these never count.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from data_gen.truth.event import ROLES, TruthEvent, reasons_out_of_view
from data_gen.truth.motion import TruthTables

MEET_S = 3.0
FARTHEST_M = 150.0
"""Nobody is asked to look further ahead."""
_NEARLY_SHARE, _NEARLY_M = 0.1, 10.0
_BEFORE_US, _AFTER_US = 500_000, 300_000
_LANE_BEFORE_US = 20_000_000


def find_reckless(tables: TruthTables, overlaps: Iterable[TruthEvent]) -> Iterator[TruthEvent]:
    """Find every overtake that put somebody at risk.

    Parameters
    ----------
    tables : of the clip.
    overlaps : its overtakes, and its passes in junctions.

    Yields
    ------
    Events with the interval of the overtake.
    """
    column = {vehicle_id: place for place, vehicle_id in enumerate(tables.ids)}
    for event in overlaps:
        if event.type in ("overtake", "pass"):
            pair = column[event.actor], column[event.other]
            if event.type == "overtake":
                yield from _before_oncoming(tables, event, pair)
            yield from _in_junction(tables, event, pair)


def _before_oncoming(tables: TruthTables, event: TruthEvent, pair: tuple[int, int]) -> Iterator[TruthEvent]:
    step = int(np.searchsorted(tables.t_us, event.end_us))
    if not tables.is_against_lane(slice(step, step + 1), pair[0]).all():
        return
    around = tables.steps(event.end_us - _BEFORE_US, event.end_us + _AFTER_US)
    clearly_wrong = bool(tables.is_against_lane(around, pair[0]).all())
    for danger, meet_s, free_m in _oncoming(tables, step, pair[0]):
        seen = tables.seen_around([danger], (event.start_us, event.end_us))
        if not seen.any():
            continue
        reasons = [event.why_not_countable] if event.why_not_countable else []
        reasons += reasons_out_of_view(seen, ROLES["reckless_overtake"][2:])
        if not clearly_wrong:
            reasons.append("the overtaker is about to leave the oncoming lane")
        if meet_s > MEET_S * (1 - _NEARLY_SHARE) or free_m > FARTHEST_M - _NEARLY_M:
            reasons.append(f"the two meet in about {MEET_S:g} s, or are about {FARTHEST_M:g} m apart")
        yield replace(
            event,
            type="reckless_overtake",
            vehicles=(*event.vehicles, tables.ids[danger]),
            why_not_countable="; ".join(reasons) or None,
        )


def _oncoming(tables: TruthTables, step: int, vehicle: int) -> Iterator[tuple[int, float, float]]:
    """Give who comes towards a vehicle on its road: column, seconds until they meet, metres between the bumpers."""
    ways = tables.direction[step]
    there = (tables.road[step] == tables.road[step, vehicle]) & (ways == -ways[vehicle]) & (ways != 0)
    # In driving direction of the vehicle; the tables count in that of each.
    ahead_m = -tables.along_m[step] - tables.along_m[step, vehicle]
    for other in np.flatnonzero(there).tolist():
        free_m = float(ahead_m[other] - (tables.length_m[other] + tables.length_m[vehicle]) / 2)
        closing_mps = float(tables.speed_mps[step, other] + tables.speed_mps[step, vehicle])
        if free_m > 0.0 and free_m < min(FARTHEST_M, MEET_S * (1 + _NEARLY_SHARE) * closing_mps):
            yield other, free_m / closing_mps, free_m


def _in_junction(tables: TruthTables, event: TruthEvent, pair: tuple[int, int]) -> Iterator[TruthEvent]:
    steps = tables.steps(event.start_us, event.end_us + 1)
    inside = tables.junction[steps, pair[0]]
    inside = inside[inside >= 0]
    lanes = [_last_lane(tables, vehicle, steps.stop) for vehicle in pair]
    if not len(inside) or lanes[0] < 0 or lanes[0] != lanes[1]:
        return
    yield replace(
        event,
        type="reckless_overtake",
        why_not_countable="it is in a junction, where no road says who is ahead",
        places=(("danger", tables.network.junctions[int(inside[0])].id),),
    )


def _last_lane(tables: TruthTables, vehicle: int, before: int) -> int:
    """Give the last lane under a vehicle's centre before it came into a junction, -1 without one."""
    first = int(np.searchsorted(tables.t_us, tables.t_us[min(before, len(tables.t_us)) - 1] - _LANE_BEFORE_US))
    lane = tables.lane[first:before, vehicle]
    in_junction = np.flatnonzero(tables.junction[first:before, vehicle] >= 0)
    lane = lane[: in_junction[0]] if len(in_junction) else lane
    known = np.flatnonzero(lane >= 0)
    return int(lane[known[-1]]) if len(known) else -1
