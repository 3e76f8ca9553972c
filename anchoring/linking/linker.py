"""Which unlinked vision object is which lost car? Predictions compared with what is seen, one to one, or not at all.

A car may be anywhere in a window around its predicted place, which grows with the time since it was last seen;
heading, speed and length must fit too. All pairs are decided together, and a pair only counts if every other choice is
worse by a margin: with two cars equally likely nothing is linked, since a wrong link tells lies about two cars.
"""

import itertools
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import linear_sum_assignment

from anchoring.observations import BoolArray, FloatArray, IntArray
from anchoring.settings import AnchoringSettings


@dataclass(frozen=True, slots=True)
class Looks:
    """Hold what is compared, of n bodies at one time: seen ones, or predicted ones.

    Attributes
    ----------
    centre_m, velocity_mps : (n, 2).
    heading_rad, length_m : (n,).
    road : (n,) -1 for none; along_m, across_m, tangent_rad : (n,).
    """

    centre_m: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    road: IntArray
    along_m: FloatArray
    across_m: FloatArray
    tangent_rad: FloatArray


def fit_costs(
    seen: Looks, lost: Looks, elapsed_s: FloatArray, *, has_length: BoolArray, settings: AnchoringSettings
) -> FloatArray:
    """Compare every seen body with every lost one.

    Parameters
    ----------
    seen, lost : s and l bodies at the same time; the lost ones as predicted.
    elapsed_s : (l,) since each lost body was last seen.
    has_length : (s,) False where the length is not seen in full.
    settings : windows.

    Returns
    -------
    (s, l): 0 for a perfect fit, at most 5; inf where one of the windows is missed.
    """
    along_m, across_m = _offsets(seen, lost)
    along_window = settings.along_m + settings.along_mps * elapsed_s + settings.along_mps2 * elapsed_s**2
    across_window = np.minimum(settings.across_m + settings.across_mps * elapsed_s, settings.across_limit_m)
    speed_window = settings.fit_speed_mps + settings.fit_acceleration_mps2 * elapsed_s
    length_window = settings.fit_length_m + settings.fit_length_share * lost.length_m
    seen_mps, lost_mps = np.hypot(*seen.velocity_mps.T), np.hypot(*lost.velocity_mps.T)
    turn_rad = np.abs(np.angle(np.exp(1j * (seen.heading_rad[:, None] - lost.heading_rad))))
    turn_rad[(seen_mps < settings.fit_slow_mps)[:, None] & (lost_mps < settings.fit_slow_mps)] = 0.0
    length_m = np.where(has_length[:, None], seen.length_m[:, None] - lost.length_m, 0.0)
    deviations = np.stack(
        [
            along_m / along_window,
            across_m / across_window,
            turn_rad / settings.fit_heading_rad,
            (seen_mps[:, None] - lost_mps) / speed_window,
            length_m / length_window,
        ]
    )
    costs: FloatArray = np.where((np.abs(deviations) <= 1.0).all(axis=0), (deviations**2).sum(axis=0), np.inf)
    return costs


def assign(costs: FloatArray, *, unmatched: float, margin: float) -> list[tuple[int, int]]:
    """Choose pairs one to one, and only those that are clearly the best.

    Parameters
    ----------
    costs : (s, l), inf where a pair is impossible.
    unmatched : cost of leaving a row without a column; no pair may cost more.
    margin : a pair is left out unless the best choice of all pairs without it costs at least this much more.

    Returns
    -------
    (row, column) pairs in order of the rows.

    Examples
    --------
    >>> assign(np.array([[0.1, 2.0], [np.inf, 0.2]]), unmatched=3.0, margin=0.5)
    [(0, 0), (1, 1)]
    >>> assign(np.array([[0.1, 0.3]]), unmatched=3.0, margin=0.5)          # either could be it
    []
    """
    total, pairs = _cheapest(costs, unmatched)
    clear = []
    for pair in pairs:
        without = costs.copy()
        without[pair] = np.inf
        if _cheapest(without, unmatched)[0] - total >= margin:
            clear.append(pair)
    return clear


def keep_order(pairs: list[tuple[int, int]], seen: Looks, lost: Looks, *, same_lane_m: float) -> list[tuple[int, int]]:
    """Leave out pairs by which two cars in one lane would have changed places.

    Parameters
    ----------
    pairs : (row of seen, row of lost).
    seen, lost : as in `fit_costs`.
    same_lane_m : two cars with less between them sideways are in one lane and keep their order.
    """
    wrong = set()
    for one, two in itertools.combinations(pairs, 2):
        seen_along, seen_across = _offsets(_row(seen, one[0]), _row(seen, two[0]))
        lost_along, lost_across = _offsets(_row(lost, one[1]), _row(lost, two[1]))
        in_one_lane = max(abs(seen_across.item()), abs(lost_across.item())) < same_lane_m
        if in_one_lane and seen_along.item() * lost_along.item() < 0:
            wrong |= {one, two}
    return [pair for pair in pairs if pair not in wrong]


def _cheapest(costs: FloatArray, unmatched: float) -> tuple[float, list[tuple[int, int]]]:
    """Solve the assignment in which every row may also stay alone."""
    rows, columns = costs.shape
    alone = np.full((rows, rows), np.inf)
    np.fill_diagonal(alone, unmatched)
    # The solver takes no matrix without a finite solution, and staying alone is always one.
    padded = np.concatenate([np.where(costs <= unmatched, costs, np.inf), alone], axis=1)
    chosen = [(int(row), int(column)) for row, column in zip(*linear_sum_assignment(padded), strict=True)]
    total = float(sum(padded[pair] for pair in chosen))
    return total, [(row, column) for row, column in chosen if column < columns]


def _offsets(seen: Looks, lost: Looks) -> tuple[FloatArray, FloatArray]:
    """Measure how far along and across each seen body is from each lost one, (s, l) each.

    Along the road where both are on it, else along the heading of the lost one.
    """
    apart_m = seen.centre_m[:, None, :] - lost.centre_m
    cos, sin = np.cos(lost.heading_rad), np.sin(lost.heading_rad)
    along_m = apart_m[..., 0] * cos + apart_m[..., 1] * sin
    across_m = apart_m[..., 1] * cos - apart_m[..., 0] * sin
    on_one_road = (seen.road[:, None] == lost.road) & (lost.road >= 0)
    sign = np.where(np.cos(lost.heading_rad - lost.tangent_rad) < 0, -1.0, 1.0)
    road_along_m = (seen.along_m[:, None] - lost.along_m) * sign
    road_across_m = (seen.across_m[:, None] - lost.across_m) * sign
    return np.where(on_one_road, road_along_m, along_m), np.where(on_one_road, road_across_m, across_m)


def _row(looks: Looks, row: int) -> Looks:
    arrays = {field.name: getattr(looks, field.name)[row : row + 1] for field in fields(looks)}
    return Looks(**arrays)
