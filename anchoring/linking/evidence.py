"""Is this start of a track that lost car, or has a new car come? Log likelihood ratios, in nats.

A lost car drove on: then the way between the two ends of its tracks is about its mean speed times the time, and its
speed has wandered a little, or much. Or it stopped for a while: then it is anywhere it could have reached, at any
speed. A new car appears where cars come into view, seldom elsewhere, at any speed. The one has the size that was seen
before, the other any that is usual here.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from anchoring.linking.linker import Evidence
from anchoring.linking.ways import Looks, Routes, Ways, ways
from anchoring.observations import BoolArray, FloatArray, LongArray
from anchoring.settings import AnchoringSettings

# What is known of a new car before it is seen: speed, place across the road and size are anywhere in these ranges.
_SPEEDS_MPS = 40.0
_ACROSS_M = 10.0
_SIZES_M = 20.0
_HALF_LOG_TAU = 0.5 * math.log(2 * math.pi)


@dataclass(frozen=True, slots=True)
class NewCars:
    """Say what is expected of a car that has not been seen before.

    Attributes
    ----------
    births_per_m : (s,) how many begin in a metre of road around each start, for each lost one that begins again.
    size_m, spread_m : (2,) length and width usual here, and how far they spread.
    """

    births_per_m: FloatArray
    size_m: FloatArray
    spread_m: FloatArray


def weigh(starts: Looks, ends: Looks, new: NewCars, routes: Routes, settings: AnchoringSettings) -> Evidence:
    """Compare every start of a track with every lost car that can have driven there.

    Parameters
    ----------
    starts, ends : s vision objects as they were seen first, l lost cars as they were seen last.
    new : what else the starts may be.
    routes : ways along the lanes.
    settings : spreads, shares and limits.

    Returns
    -------
    The pairs that are possible at all.
    """
    row, column = _within_reach(starts, ends, settings)
    start, end = starts.take(row), ends.take(column)
    gap_s = np.maximum((start.t_us - end.t_us) * 1e-6, 0.0)
    way = ways(start, end, gap_s, settings).along_lanes(*routes(row, column))
    reach_m = _reach_m(start.speed_mps, end.speed_mps, gap_s, settings)
    possible = way.is_possible & (way.length_m >= -settings.backwards_m) & (way.length_m <= reach_m)
    stopped = -np.log((reach_m + settings.backwards_m) * _SPEEDS_MPS)
    stops = np.where(way.on_road, settings.stop_share, settings.junction_stop_share)
    ratios = (
        np.logaddexp(np.log1p(-stops) + _drove(start, end, way, gap_s, settings), np.log(stops) + stopped)
        + _aside(way, gap_s, settings)
        + _sizes(start, end, new, settings)
        + np.where(way.changes_lane, math.log(settings.change_share), 0.0)
        - np.log(new.births_per_m[row] / _SPEEDS_MPS)
    )
    in_lane = np.abs(way.aside_m[possible]) < settings.same_lane_m
    return _without_passing(Evidence(row, column, ratios).select(possible), in_lane, ends, settings)


def explained(seen: Looks, once: Looks, settings: AnchoringSettings) -> FloatArray:
    """Weigh for every pair how well a body that drove on explains what is seen a moment later.

    Parameters
    ----------
    seen, once : s bodies now, l bodies a moment ago.

    Returns
    -------
    (s, l) logarithm of the density; -inf where nobody can have driven so.
    """
    shape = len(seen.t_us), len(once.t_us)
    row, column = (side.ravel() for side in np.indices(shape))
    start, end = seen.take(row), once.take(column)
    fits = moved(start, end, settings)
    fits += np.where(start.is_whole, _normal(start.length_m - end.length_m, settings.same_length_m), 0.0)
    return fits.reshape(shape)


def coincide(seen: Looks, other: Looks, settings: AnchoringSettings) -> FloatArray:
    """Weigh for p pairs that are seen together: they are one vehicle, against: another one is there at any speed.

    Their sizes say nothing, as each sensor sees other parts of a vehicle.
    """
    return moved(seen, other, settings) - math.log(settings.edge_births_per_m / _SPEEDS_MPS)


def moved(start: Looks, end: Looks, settings: AnchoringSettings) -> FloatArray:
    """Weigh for p pairs how well driving on from the end explains place and speed at the start; -inf if impossible."""
    gap_s = np.maximum((start.t_us - end.t_us) * 1e-6, 0.0)
    way = ways(start, end, gap_s, settings)
    fits = _drove(start, end, way, gap_s, settings) + _aside(way, gap_s, settings)
    return np.where(way.is_possible, fits, -np.inf)


def _within_reach(starts: Looks, ends: Looks, settings: AnchoringSettings) -> tuple[LongArray, LongArray]:
    # First what the fastest could reach in the longest time: few of all pairs are left to compare.
    longest_s = np.maximum((starts.t_us.max() - ends.t_us.min()) * 1e-6, 0.0)
    most_m = float(_reach_m(starts.speed_mps.max(), ends.speed_mps.max(), longest_s, settings))
    near = KDTree(starts.centre_m).sparse_distance_matrix(KDTree(ends.centre_m), most_m, output_type="ndarray")
    row, column = near["i"], near["j"]
    elsewhere = (starts.road[row] != ends.road[column]) | (ends.road[column] < 0)
    # On one road nobody drives back or turns right round; and what was there together with the car cannot be the car.
    ahead_m = (starts.along_m[row] - ends.along_m[column]) * ends.sense[column]
    kept = (elsewhere | (ahead_m >= -settings.backwards_m)).nonzero()[0]
    row, column, elsewhere = row[kept], column[kept], elsewhere[kept]
    goes_on = np.abs(starts.take(row).turned_rad(ends.take(column))) <= settings.back_rad
    gap_s = (starts.t_us[row] - ends.t_us[column]) * 1e-6
    reach_m = _reach_m(starts.speed_mps[row], ends.speed_mps[column], np.maximum(gap_s, 0.0), settings)
    possible = (elsewhere | goes_on) & (gap_s >= -settings.overlap_us * 1e-6) & (near["v"][kept] <= reach_m)
    return np.divmod(np.sort(row[possible] * len(ends.t_us) + column[possible]), len(ends.t_us))


def _reach_m(start_mps: FloatArray, end_mps: FloatArray, gap_s: FloatArray, settings: AnchoringSettings) -> FloatArray:
    fastest_mps = np.maximum(np.maximum(start_mps, end_mps), settings.haste_mps)
    reach_m: FloatArray = settings.haste_share * fastest_mps * gap_s + settings.backwards_m
    return reach_m


def _normal(off: FloatArray, spread: FloatArray | float) -> FloatArray:
    """Give the logarithm of the density of a normal distribution."""
    density: FloatArray = -0.5 * (off / spread) ** 2 - np.log(spread) - _HALF_LOG_TAU
    return density


def _drove(start: Looks, end: Looks, way: Ways, gap_s: FloatArray, settings: AnchoringSettings) -> FloatArray:
    """Weigh the way and the speed of a car that drove on, calmly or lively.

    Its speed is a Wiener process between the two that were measured: the way is then off by the root of t^3 / 12.
    """
    start_mps, end_mps = start.speed_mps, end.speed_mps
    off_m = way.length_m - (start_mps + end_mps) / 2 * gap_s

    def wandered(wander_mps: float) -> FloatArray:
        """Weigh both with a speed that changes by so much in a second, a standard deviation."""
        spread_m = np.hypot(settings.way_m, wander_mps * np.sqrt(gap_s**3 / 12))
        spread_mps = np.hypot(settings.pace_mps, wander_mps * np.sqrt(gap_s))
        return _normal(off_m, spread_m) + _normal(start_mps - end_mps, spread_mps)

    both: FloatArray = np.logaddexp(wandered(settings.calm_mps), wandered(settings.lively_mps)) - math.log(2)
    return both


def _aside(way: Ways, gap_s: FloatArray, settings: AnchoringSettings) -> FloatArray:
    """Weigh how far to the side it went: that takes time, and nobody goes aside without going on."""
    gone_m = np.minimum(settings.side_mps * gap_s, settings.side_share * np.abs(way.length_m))
    spread_m = np.minimum(settings.side_m + gone_m, settings.side_limit_m)
    return _normal(way.aside_m, spread_m) + math.log(_ACROSS_M)


def _sizes(start: Looks, end: Looks, new: NewCars, settings: AnchoringSettings) -> FloatArray:
    """Compare sizes where both are seen in full; some are measured badly and some new cars are no usual ones."""
    total = np.zeros(len(start.t_us))
    odd, other = (math.log(share / _SIZES_M) for share in (settings.odd_share, settings.other_share))
    pairs = (start.length_m, end.length_m, settings.same_length_m), (start.width_m, end.width_m, settings.same_width_m)
    for (seen_m, known_m, same_m), usual_m, spread_m in zip(pairs, new.size_m, new.spread_m, strict=True):
        total += np.logaddexp(_normal(seen_m - known_m, same_m), odd)
        total -= np.logaddexp(_normal(seen_m - usual_m, spread_m), other)
    return np.where(start.is_whole & end.is_whole, total, 0.0)


def _without_passing(evidence: Evidence, in_lane: BoolArray, ends: Looks, settings: AnchoringSettings) -> Evidence:
    """Count against each pair the lost cars that the start could be too, and that went into the hidden place first.

    Only those in whose lane it begins: whoever comes out beside it may have overtaken inside.
    """
    first, behind = _queued(ends, settings)
    starts, count = evidence.starts.max(initial=0) + 1, len(ends.t_us)
    could_be = csr_array((in_lane.astype(np.float64), (evidence.starts, evidence.ends)), shape=(starts, count))
    passed = could_be @ csr_array((np.ones(len(first)), (first, behind)), shape=(count, count))
    passes = np.asarray(passed[evidence.starts, evidence.ends]).ravel()
    return replace(evidence, ratios=evidence.ratios - settings.pass_nats * passes)


def _queued(ends: Looks, settings: AnchoringSettings) -> tuple[LongArray, LongArray]:
    """Pair the lost cars that went into one hidden place in one lane: the rows of the first, and of those behind."""
    near = KDTree(ends.centre_m).query_pairs(settings.edge_m, output_type="ndarray")
    near = np.concatenate([near, near[:, ::-1]])
    first, behind = ends.take(near[:, 0]), ends.take(near[:, 1])
    queued = (first.t_us < behind.t_us) & (first.road == behind.road) & (first.road >= 0)
    queued &= np.cos(first.heading_rad - behind.heading_rad) > 0.0
    queued &= np.abs(first.across_m - behind.across_m) < settings.same_lane_m
    return near[queued, 0], near[queued, 1]
