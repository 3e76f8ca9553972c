"""Which cells belong to which known object? Merged blobs are divided by predicted boxes.

Two cars side by side, or a car and its neighbour's shadow, make one blob. The tracker knows where both must be: every
cell goes to the nearest predicted box. The same step joins the fragments of one car, whose windscreen may look like
the road. A prediction counts only if it owns enough cells, so that a phantom track cannot halve a real car.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vision.detection.blobs import Cells
from vision.detection.settings import DetectionSettings
from vision.detection.surfaces.surface import Appearances
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.boxes import Boxes

# Breaks ties: among several shadows that a cell may belong to, the nearer body decides.
SHADOW_ORDER = 0.01


@dataclass(frozen=True, slots=True)
class Ownership:
    """Who owns which cells.

    Attributes
    ----------
    owner : (p,) row of the predicted box that each cell belongs to, -1 for none.
    is_rest : (p,) True for cells without an owner that lie in an owned blob: something unknown touches a known object.
    is_divided : (n,) True for predicted boxes that share a blob with something else.
    """

    owner: IntArray
    is_rest: BoolArray
    is_divided: BoolArray


def assign_cells(
    cells: Cells,
    predicted: Appearances,
    bodies: Callable[[], Boxes],
    is_sized: BoolArray,
    *,
    side: float,
    settings: DetectionSettings,
) -> Ownership:
    """Divide blobs among the predicted boxes that they cover.

    Parameters
    ----------
    cells : foreground cells, one group per blob.
    predicted : where known objects with their shadows must be seen at this frame.
    bodies : tells where they must be seen without their shadows; asked only where several share a blob.
    is_sized : (n,) which of them have a size that can be relied on.
    side : of a cell.
    settings : reaches, shares.

    Returns
    -------
    The owner of every cell.
    """
    boxes = predicted.boxes
    candidates = _candidates(cells, predicted, settings.split_reach_m)
    if candidates.shape[1] == 0:
        nobody, nothing = np.full(len(cells.group), -1, np.intp), np.zeros(len(cells.group), np.bool_)
        return Ownership(nobody, nothing, np.zeros(len(boxes), np.bool_))
    distance_m = _order(cells, predicted, bodies, candidates)
    # How much of each candidate one cell covers.
    coverage = np.where(candidates >= 0, (side**2 / (boxes.length_m * boxes.width_m))[candidates], 0.0)
    chosen = _choose(cells, candidates, distance_m, coverage=coverage, settings=settings)
    nearest_m = np.where(chosen[cells.group], distance_m, np.inf)
    slot = np.argmin(nearest_m, axis=1)
    least_m = nearest_m.min(axis=1)
    owner = np.where(np.isfinite(least_m), candidates[cells.group, slot], -1)
    owner = _drop_strangers(cells, owner, predicted, settings.join_slack_m)
    is_outside: BoolArray = least_m > settings.rest_reach_m
    is_outside[owner < 0] = False
    is_outside[owner >= 0] &= is_sized[owner[owner >= 0]]
    is_rest = _large_parts(cells, is_outside, owner, side * predicted.metres_per_unit, settings.part_area_m2)
    is_divided = np.zeros(len(boxes), np.bool_)
    is_divided[candidates[chosen & (chosen.sum(axis=1) > 1)[:, None]]] = True
    is_divided[owner[is_rest]] = True
    return Ownership(np.where(is_rest, -1, owner), is_rest, is_divided)


def _order(cells: Cells, predicted: Appearances, bodies: Callable[[], Boxes], candidates: IntArray) -> FloatArray:
    """Rank the candidates of every cell by distance in metres; infinite where there is none."""
    distance_m = _distance_to_candidates(cells, predicted.boxes, candidates, predicted.metres_per_unit)
    if candidates.shape[1] == 1:
        return distance_m
    # A body beats a shadow: a car in the shadow of a truck is nobody else's, however deep it is in there.
    to_body_m = _distance_to_candidates(cells, bodies(), candidates, predicted.metres_per_unit)
    return np.where(to_body_m < 0, to_body_m, np.maximum(distance_m, 0.0) + SHADOW_ORDER * to_body_m)


def _candidates(cells: Cells, predicted: Appearances, reach_m: float) -> IntArray:
    """List the predicted boxes whose bounds touch each blob's bounds: (blobs, most candidates), padded with -1."""
    if cells.count == 0 or len(predicted.boxes) == 0:
        return np.zeros((cells.count, 0), np.intp)
    low = np.minimum.reduceat(cells.points, cells.starts, axis=0)
    high = np.maximum.reduceat(cells.points, cells.starts, axis=0)
    corners, reach = predicted.boxes.corners(), (reach_m / predicted.metres_per_unit)[:, None]
    is_below_top = low[:, None] <= (corners.max(axis=1) + reach)[None]
    is_near = np.all(is_below_top & (high[:, None] >= (corners.min(axis=1) - reach)[None]), axis=-1)
    count = is_near.sum(axis=1)
    most = int(count.max())
    return np.where(np.arange(most) < count[:, None], np.argsort(~is_near, axis=1, kind="stable")[:, :most], -1)


def _distance_to_candidates(
    cells: Cells, boxes: Boxes, candidates: IntArray, metres_per_unit: FloatArray
) -> FloatArray:
    """Measure each cell's distance to its blob's candidates in metres; infinite where there is none."""
    cos, sin = np.cos(boxes.heading_rad), np.sin(boxes.heading_rad)
    half_length, half_width = boxes.length_m / 2, boxes.width_m / 2
    distance_m = np.full((len(cells.group), candidates.shape[1]), np.inf)
    # Most blobs have one candidate: column by column, only the cells that have one are visited.
    for slot, candidate in enumerate(candidates.T):
        rows = np.flatnonzero((candidate >= 0)[cells.group]) if slot else slice(None)
        box = candidate[cells.group[rows]]
        east, north = (cells.points[rows] - boxes.centre_m[box]).T
        along = np.abs(east * cos[box] + north * sin[box]) - half_length[box]
        across = np.abs(north * cos[box] - east * sin[box]) - half_width[box]
        distance_m[rows, slot] = np.maximum(along, across) * metres_per_unit[box]
    return np.where(candidates[cells.group] >= 0, distance_m, np.inf)


def _choose(
    cells: Cells, candidates: IntArray, distance_m: FloatArray, *, coverage: FloatArray, settings: DetectionSettings
) -> BoolArray:
    """Decide which candidates take part in dividing each blob: (blobs, candidates).

    The weakest candidate is dropped and the cells are dealt again until all that remain own enough.
    """
    chosen = candidates >= 0
    full = np.where(chosen, 1 / np.where(chosen, coverage, 1.0), 0.0)  # cells that would fill each candidate
    inside = np.add.reduceat((distance_m <= 0).astype(np.float64), cells.starts, axis=0)
    for _ in range(candidates.shape[1] + 1):
        owned = (
            _owned_cells(cells, np.where(chosen[cells.group], distance_m, np.inf), settings.split_reach_m) * coverage
        )
        is_short = chosen & (owned < settings.split_share)
        # Two boxes on one car's worth of blob: the one that covers less of it goes.
        claimed = np.where(chosen, full, 0.0).sum(axis=1)
        is_single = (chosen.sum(axis=1) > 1) & (cells.sizes < settings.fill_share * claimed)
        is_short |= chosen & is_single[:, None]
        if not is_short.any():
            break
        weakest = np.argmin(np.where(is_short, inside, np.inf), axis=1)
        blobs = np.flatnonzero(is_short.any(axis=1))
        chosen[blobs, weakest[blobs]] = False
    return chosen | _fragment_owner(cells, chosen, distance_m)


def _owned_cells(cells: Cells, distance_m: FloatArray, reach_m: float) -> FloatArray:
    """Count the cells that lie nearest to each candidate and within reach of it: (blobs, candidates)."""
    width = distance_m.shape[1]
    slot = np.argmin(distance_m, axis=1)
    is_owned = distance_m[np.arange(len(slot)), slot] <= reach_m
    counts = np.bincount((cells.group * width + slot)[is_owned], minlength=cells.count * width)
    return counts.reshape(cells.count, width).astype(np.float64)


def _fragment_owner(cells: Cells, chosen: BoolArray, distance_m: FloatArray) -> BoolArray:
    """Give blobs too small to claim a box by themselves to the box that they lie in."""
    result, inside = np.zeros_like(chosen), ~chosen.any(axis=1)
    if inside.any():
        mean = np.add.reduceat(np.minimum(distance_m, 1e3), cells.starts, axis=0) / cells.sizes[:, None]
        inside &= mean.min(axis=1) < 0
        result[inside, np.argmin(mean, axis=1)[inside]] = True
    return result


def _drop_strangers(cells: Cells, owner: IntArray, predicted: Appearances, slack_m: float) -> IntArray:
    """Where several blobs have one owner but do not fit into its box together, keep the largest of them."""
    boxes = predicted.boxes
    pair = owner * cells.count + cells.group
    sizes = np.bincount(pair[owner >= 0], minlength=len(boxes) * cells.count).reshape(len(boxes), cells.count)
    result = owner.copy()
    for one in np.flatnonzero((sizes > 0).sum(axis=1) > 1):
        mine = owner == one
        offset = cells.points[mine] - boxes.centre_m[one]
        cos, sin = np.cos(boxes.heading_rad[one]), np.sin(boxes.heading_rad[one])
        slack = slack_m / predicted.metres_per_unit[one]
        is_too_long = np.ptp(offset @ np.array([cos, sin])) > boxes.length_m[one] + slack
        if is_too_long or np.ptp(offset @ np.array([-sin, cos])) > boxes.width_m[one] + slack:
            result[mine & (cells.group != np.argmax(sizes[one]))] = -1
    return result


def _large_parts(cells: Cells, outside: BoolArray, owner: IntArray, cell_m: FloatArray, least_m2: float) -> BoolArray:
    """Keep the cells outside their owner's box where they are enough to be something else, blob by blob.

    A car that comes into view touching the shadow of a truck would otherwise be swallowed by it for good.
    """
    if not outside.any():
        return outside
    outside_m2 = np.add.reduceat(np.where(outside, cell_m[owner] ** 2, 0.0), cells.starts)
    return np.asarray(outside & (outside_m2 >= least_m2)[cells.group])
