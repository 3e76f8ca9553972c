"""Who drove the wrong way, and who stopped again and again? Events of a single vehicle.

`wrong_way`: for 12 s the vehicle drives against the direction of the lane under its centre, faster than 2 m/s, and is
beside nobody who goes its way (overlapping along the road, less than 8 m apart sideways).

`stop_and_go`: within 2 min and on one road the speed falls three times below 2 m/s. The vehicle has driven faster than
2.5 m/s before each stop, and is slower than 1.5 m/s in it.
"""

from collections.abc import Iterator

import numpy as np

from data_gen.simulation.states import BoolArray, FloatArray, IntArray
from data_gen.truth.event import TruthEvent, reasons_cut_by_clip
from data_gen.truth.motion import TruthTables, stretches

STANDING_MPS = 2.0
WRONG_WAY_US = 12_000_000
STOPS_WITHIN_US = 120_000_000
_NEARLY_US = 500_000
_BESIDE_M = 8.0
_NEARLY_BESIDE_M = 1.5
_MARGINS_MPS = (0.5, 0.25, 0.9)
"""About the speed that decides: the first is the definition, the others tell whether much hangs on it."""


def find_solitary(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every `wrong_way` and `stop_and_go` in view.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    Events.
    """
    for vehicle in range(len(tables.ids)):
        yield from _wrong_ways(tables, vehicle)
        yield from _stops_and_goes(tables, vehicle)


def _wrong_ways(tables: TruthTables, vehicle: int) -> Iterator[TruthEvent]:
    for start, end in stretches(tables.is_against_lane(slice(None), vehicle) & tables.seen[:, vehicle]):
        start_us, last_us = tables.span_us(start, end)
        core_us = start_us, start_us + WRONG_WAY_US
        core = tables.steps(*core_us)
        if last_us - start_us < WRONG_WAY_US - _NEARLY_US or tables.speed_mps[core, vehicle].min() <= STANDING_MPS:
            continue
        nearest_m = _least_overlap_m(tables, vehicle, core)
        if nearest_m <= 0.0:
            continue
        reasons = reasons_cut_by_clip(tables.t_us, *core_us)
        if last_us - start_us < WRONG_WAY_US + _NEARLY_US:
            reasons.append("it lasts about 12 s, which is what decides")
        if nearest_m <= _NEARLY_BESIDE_M:
            reasons.append("the car is nearly beside another one")
        yield tables.event("wrong_way", [vehicle], core_us, reasons)


def _least_overlap_m(tables: TruthTables, vehicle: int, steps: slice) -> float:
    """Measure how far the vehicle stays from being beside somebody, along the road; 0 or less if it ever is."""
    same = (tables.road[steps] == tables.road[steps, vehicle][:, None]) & (
        tables.direction[steps] == tables.direction[steps, vehicle][:, None]
    )
    same[:, vehicle] = False
    with np.errstate(invalid="ignore"):
        near = np.abs(tables.across_m[steps] - tables.across_m[steps, vehicle][:, None]) < _BESIDE_M
        gap_m = np.abs(tables.along_m[steps] - tables.along_m[steps, vehicle][:, None])
    free_m: FloatArray = gap_m - (tables.length_m + tables.length_m[vehicle]) / 2
    return float(np.where(same & near, free_m, np.inf).min(initial=np.inf))


def _stops_and_goes(tables: TruthTables, vehicle: int) -> Iterator[TruthEvent]:
    road = tables.road[:, vehicle]
    for number in np.unique(road[road >= 0]).tolist():
        for start, end in stretches((road == number) & tables.seen[:, vehicle]):
            t_us, speed_mps = tables.t_us[start:end], tables.speed_mps[start:end, vehicle]
            stops_us, *others_us = (stop_times_us(t_us, speed_mps, margin_mps) for margin_mps in _MARGINS_MPS)
            unclear = any(len(other_us) != len(stops_us) for other_us in others_us)
            place = ("road", tables.network.roads[number].id)
            for nth, core_us in enumerate(_triples(stops_us)):
                reasons = reasons_cut_by_clip(tables.t_us, *core_us)
                if unclear:
                    reasons.append(f"the car is at about {STANDING_MPS:g} m/s")
                if nth:
                    reasons.append("stop-and-go that goes on may be told in other pieces")
                yield tables.event("stop_and_go", [vehicle], core_us, reasons, places=(place,))


def stop_times_us(t_us: IntArray, speed_mps: FloatArray, margin_mps: float) -> list[int]:
    """Find when a vehicle stops.

    Parameters
    ----------
    t_us, speed_mps : (n,) each.
    margin_mps : it must have been faster than 2 m/s by this much, and become slower by as much.

    Returns
    -------
    For each stop the first time below 2 m/s.

    Examples
    --------
    >>> stop_times_us(np.arange(6), np.array([5.0, 1.9, 1.0, 1.9, 3.0, 0.0]), 0.5)
    [1, 5]
    """
    fast: BoolArray = speed_mps > STANDING_MPS + margin_mps
    slow: BoolArray = speed_mps < STANDING_MPS - margin_mps
    stops_us: list[int] = []
    moving, since = False, 0
    for step in range(len(t_us)):
        if fast[step]:
            moving = True
        if speed_mps[step] >= STANDING_MPS:
            since = step + 1
        if slow[step] and moving:
            stops_us.append(int(t_us[since]))
            moving = False
    return stops_us


def _triples(stops_us: list[int]) -> Iterator[tuple[int, int]]:
    place = 0
    while place + 2 < len(stops_us):
        if stops_us[place + 2] - stops_us[place] <= STOPS_WITHIN_US:
            yield stops_us[place], stops_us[place + 2]
            place += 2
        else:
            place += 1
