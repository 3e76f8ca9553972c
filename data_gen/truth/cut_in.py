"""Who cut in on whom? Lane changes that leave the next vehicle behind a time gap below 1 s.

It happens at the step at which the cutter's centre comes into another lane of its direction. The one cut in on is the
next vehicle behind in that lane, where it has been for 1 s; it is faster than 30 km/h, and its time gap to the cutter
is below 1 s at some step from 1 s before to 2 s after the change at which the two overlap sideways.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from data_gen.simulation.states import FloatArray
from data_gen.truth.event import MARGIN_US, TruthEvent
from data_gen.truth.motion import TruthTables

SHORT_S = 1.0
LEAST_MPS = 30 / 3.6
_NEARLY_S, _NEARLY_MPS, _NEARLY_M = 0.1, 0.5, 0.7
_BEFORE_US, _AFTER_US, _STAYS_US = 1_000_000, 2_000_000, 500_000
_DWELL_US = 200_000


@dataclass(frozen=True, slots=True)
class _Change:
    """A vehicle's centre is in another lane of its direction from `step` on."""

    cutter: int
    step: int
    lane: int


def find_cut_ins(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every cut-in of which at least a part is in view.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    Events without duration.
    """
    for cutter in range(len(tables.ids)):
        for change in _lane_changes(tables, cutter):
            car = _next_behind(tables, change)
            if car is not None and (event := _event(tables, change, car)) is not None:
                yield event


def _lane_changes(tables: TruthTables, cutter: int) -> Iterator[_Change]:
    lane, road, direction = tables.lane[:, cutter], tables.road[:, cutter], tables.direction[:, cutter]
    changed = (lane[1:] != lane[:-1]) & (lane[1:] >= 0) & (lane[:-1] >= 0) & (road[1:] == road[:-1])
    for step in (np.flatnonzero(changed) + 1).tolist():
        stays = tables.steps(tables.t_us[step], tables.t_us[step] + _STAYS_US)
        if tables.network.lanes[lane[step]].direction == direction[step] and (lane[stays] == lane[step]).all():
            yield _Change(cutter, step, int(lane[step]))


def _next_behind(tables: TruthTables, change: _Change) -> int | None:
    gap_m = tables.along_m[change.step, change.cutter] - tables.along_m[change.step]
    same = (tables.lane[change.step] == change.lane) & (tables.direction[change.step] != 0)
    same &= tables.direction[change.step] == tables.direction[change.step, change.cutter]
    with np.errstate(invalid="ignore"):
        behind = np.flatnonzero(same & (gap_m > 0))
    return int(behind[np.argmin(gap_m[behind])]) if len(behind) else None


@dataclass(frozen=True, slots=True, eq=False)
class _Gap:
    """The steps around a change at which cutter and car overlap sideways."""

    bumper_m: FloatArray
    speed_mps: FloatArray
    """Of the car that is cut in on."""
    sideways_m: FloatArray
    """How much of the widths overlaps."""

    @property
    def shortest_s(self) -> float:
        return float((self.bumper_m / np.maximum(self.speed_mps, 0.1)).min())


def _event(tables: TruthTables, change: _Change, car: int) -> TruthEvent | None:
    gap = _gap(tables, change, car)
    if gap is None or gap.shortest_s >= SHORT_S + _NEARLY_S or gap.speed_mps.max() < LEAST_MPS - _NEARLY_MPS:
        return None
    at_us = int(tables.t_us[change.step])
    vehicles = change.cutter, car
    # Until the gap may have become short.
    core_us = at_us, at_us + _AFTER_US - MARGIN_US
    if not tables.seen_around(vehicles, core_us).any():
        return None
    reasons = [*tables.doubts_of_view("cut_in", vehicles, core_us), *_unclear(tables, change, car, gap)]
    lane = tables.network.lanes[change.lane].id
    return tables.event("cut_in", vehicles, (at_us, at_us), reasons, places=(("lane", lane),))


def _gap(tables: TruthTables, change: _Change, car: int) -> _Gap | None:
    """Measure from 1 s before to 2 s after the change; None if the two never overlap sideways."""
    at_us = int(tables.t_us[change.step])
    rows = tables.steps(at_us - _BEFORE_US, at_us + _AFTER_US)
    half_m = (tables.length_m[change.cutter] + tables.length_m[car]) / 2
    apart_m = np.abs(tables.across_m[rows, change.cutter] - tables.across_m[rows, car])
    sideways_m: FloatArray = (tables.width_m[change.cutter] + tables.width_m[car]) / 2 - apart_m
    overlap = sideways_m > 0
    overlap &= tables.road[rows, change.cutter] == tables.road[rows, car]
    if not overlap.any():
        return None
    bumper_m = tables.along_m[rows, change.cutter] - tables.along_m[rows, car] - half_m
    return _Gap(bumper_m[overlap], tables.speed_mps[rows, car][overlap], sideways_m[overlap])


def _unclear(tables: TruthTables, change: _Change, car: int, gap: _Gap) -> list[str]:
    """Say what is near to what decides."""
    reasons: list[str] = []
    if gap.shortest_s > SHORT_S - _NEARLY_S:
        reasons.append(f"the time gap is about {SHORT_S:g} s")
    if gap.speed_mps.min() < LEAST_MPS + _NEARLY_MPS:
        reasons.append("the car drives at about 30 km/h")
    if gap.sideways_m.max() < _NEARLY_M:
        reasons.append("the two hardly overlap sideways")
    if gap.bumper_m.min() < _NEARLY_M:
        reasons.append("the cutter is hardly ahead of the car")
    at_us = int(tables.t_us[change.step])
    rows = tables.steps(at_us - _BEFORE_US - _DWELL_US, at_us + _STAYS_US + _DWELL_US)
    if (tables.lane[rows, car] != change.lane).any():
        reasons.append("the car changes lanes as well")
    return reasons
