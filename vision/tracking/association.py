"""Which track may take which detection, and what is the best way to deal them out? Gates, costs, assignment."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from vision.detection.detector import Detections, Velocities
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.boxes import Boxes, axis
from vision.tracking import kalman
from vision.tracking.track import TrackTable

# What it costs to leave a row alone where as many pairs as possible are wanted: far more than any pair.
NEVER_ALONE = 1e9


@dataclass(frozen=True, slots=True)
class Sightings:
    """Detections as measurements of object centres.

    Attributes
    ----------
    boxes : what was seen.
    centre_m : (m, 2), completed by the object's known length where the view edge cuts the box.
    noise : (m, 2, 2) covariance of the centre.
    room : (m, 2, 2) the same of what a box too short or too long leaves open.
    owner : (m,) row of the track that the cells were given to, -1 for none.
    divided : (m,) True if the blob was shared out.
    is_loose : (m,) True for whole boxes without an owner: they may be the part that shows of a hidden object.
    is_hidden : (n,) True for tracks of known size that were not seen in the frame before.
    velocities : how fast they were seen to move, if anybody followed them.
    """

    boxes: Boxes
    centre_m: FloatArray
    noise: FloatArray
    room: FloatArray
    owner: IntArray
    divided: BoolArray
    is_loose: BoolArray
    is_hidden: BoolArray
    velocities: Velocities | None


def sight(
    detections: Detections,
    known_rows: IntArray,
    tracks: TrackTable,
    *,
    usual_length_m: float,
    noise_factor: float = 1.0,
) -> Sightings:
    """Turn boxes into measurements of centres.

    Parameters
    ----------
    detections : of one frame; owners count confirmed tracks.
    known_rows : (k,) rows of the confirmed tracks.
    tracks : at this frame.
    usual_length_m : assumed of an object until it is seen whole.
    noise_factor : on the variance that detections claim.

    Returns
    -------
    One measurement per detection.
    """
    boxes = detections.boxes
    owner = np.append(known_rows, -1)[detections.owner]
    length_m = np.maximum(np.append(tracks.length_m, usual_length_m)[owner], usual_length_m)
    missing_m = np.maximum(length_m - boxes.length_m, 0.0)
    # A box has a known direction only if a track gave it one; else nobody can say to which side it goes on.
    shift_m = np.where(detections.directed, detections.cut * missing_m / 2, 0.0)
    centre_m = boxes.centre_m + shift_m[:, None] * axis(boxes.heading_rad)
    is_cut = detections.cut != 0
    blur_m = np.where(is_cut, tracks.settings.clipped_noise_m, 0.0)
    blur = kalman.oriented_covariance(boxes.heading_rad, blur_m, np.where(detections.directed, 0.0, blur_m))
    factor = np.where(detections.divided, tracks.settings.divided_noise**2, 1.0) * noise_factor
    is_fitted = (owner >= 0) & ~is_cut
    room = np.zeros_like(blur)
    centre_m[is_fitted], room[is_fitted] = _fit(boxes.select(is_fitted), owner[is_fitted], tracks)
    return Sightings(
        boxes=boxes,
        centre_m=centre_m,
        noise=detections.noise * factor[:, None, None] + blur,
        room=room,
        owner=owner,
        divided=detections.divided,
        is_loose=(owner < 0) & ~is_cut,
        is_hidden=tracks.is_driving() & ~tracks.is_observed,
        velocities=detections.velocities,
    )


def measured(
    tracks: TrackTable, sightings: Sightings, rows: IntArray, chosen: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Say where each of some tracks is, if a sighting is of it.

    Parameters
    ----------
    tracks : at this frame.
    sightings : of this frame.
    rows, chosen : (k,) tracks and sightings.

    Returns
    -------
    (k, 2) centres, and (k, 2, 2) covariance of what the sighting leaves open.
    """
    centre_m, room = sightings.centre_m[chosen], sightings.room[chosen]
    is_part = sightings.is_hidden[rows] & sightings.is_loose[chosen]
    if is_part.any():
        centre_m[is_part], room[is_part] = _fit(sightings.boxes.select(chosen[is_part]), rows[is_part], tracks)
    return centre_m, room


def _fit(boxes: Boxes, rows: IntArray, tracks: TrackTable) -> tuple[FloatArray, FloatArray]:
    """Place objects of known size into the boxes that were seen of them.

    A box that is too short (an end of the colour of the road, or under a bridge) or too long (a neighbour's shadow)
    leaves room for the object; of the places that fit, the one nearest to the prediction is taken. A box of the right
    size is its middle.

    Returns
    -------
    (k, 2) centres, and (k, 2, 2) covariance of what is left open.
    """
    heading_rad = tracks.heading_rad[rows]
    offset = boxes.centre_m - tracks.state[rows, :2]
    ahead, left = axis(heading_rad), axis(heading_rad + np.pi / 2)
    excess_m = _reach_m(boxes, heading_rad) - np.column_stack([tracks.length_m[rows], tracks.width_m[rows]])
    excess_m[~tracks.is_sized()[rows]] = 0.0
    tolerance_m = tracks.settings.fit_tolerance_m
    along_m = _nearest_fit(np.einsum("ni,ni->n", offset, ahead), excess_m[:, 0], tolerance_m)
    across_m = _nearest_fit(np.einsum("ni,ni->n", offset, left), excess_m[:, 1], tolerance_m)
    centre_m = tracks.state[rows, :2] + along_m[:, None] * ahead + across_m[:, None] * left
    # What hides a part of an object hides where it ends. (A box too wide may be an object that turns: all of it shows.)
    is_part = (excess_m < -tolerance_m) & tracks.is_driving()[rows, None]
    hidden_m = np.where(is_part, -excess_m / 2, 0.0)
    return centre_m, kalman.oriented_covariance(heading_rad, hidden_m[:, 0], hidden_m[:, 1])


def _reach_m(boxes: Boxes, heading_rad: FloatArray) -> FloatArray:
    """Measure how far boxes reach along and across directions that may not be theirs: (n, 2)."""
    turn_rad = boxes.heading_rad - heading_rad
    cos, sin = np.abs(np.cos(turn_rad)), np.abs(np.sin(turn_rad))
    return np.column_stack(
        [boxes.length_m * cos + boxes.width_m * sin, boxes.width_m * cos + boxes.length_m * sin],
    )


def _nearest_fit(offset_m: FloatArray, excess_m: FloatArray, tolerance_m: float) -> FloatArray:
    room_m = np.abs(excess_m) / 2
    nearest_m = np.minimum(np.maximum(offset_m - room_m, 0.0), offset_m + room_m)
    return np.where(room_m > tolerance_m / 2, nearest_m, offset_m)


def costs(tracks: TrackTable, sightings: Sightings, now_us: int) -> tuple[FloatArray, BoolArray]:
    """Compute what it costs to give each sighting to each track.

    Parameters
    ----------
    tracks : predicted to `now_us`.
    sightings : of that frame.
    now_us : the frame's time.

    Returns
    -------
    (n, m) squared Mahalanobis distances, more where the cells belong to another track, infinite where forbidden; and
    (n, m) what is forbidden for nothing but the speed that it would take.
    """
    settings = tracks.settings
    limit = settings.gate_sigmas**2
    centre_m = _centres(tracks, sightings)
    squared = kalman.squared_distance(
        tracks.state[:, None], tracks.covariance[:, None], centre_m, sightings.noise[None]
    )
    if sightings.velocities is not None:
        squared = squared + _off_speed(tracks, sightings.velocities)
    shift_m = centre_m - tracks.seen_m[:, None]
    # The heading of a new track may point backwards, its course does not.
    ahead_m = np.einsum("nmk,nk->nm", shift_m, axis(tracks.course_rad()))
    slack_m = settings.slack_sigmas * np.sqrt(sightings.noise[:, 0, 0] + sightings.noise[:, 1, 1])[None]
    is_moving = tracks.speed_mps() > settings.reverse_speed_mps
    reverses = is_moving[:, None] & (ahead_m < -slack_m)
    reach_m = settings.max_speed_mps * (now_us - tracks.seen_us) / 1_000_000
    is_far = np.hypot(shift_m[..., 0], shift_m[..., 1]) > reach_m[:, None] + slack_m
    is_owner = sightings.owner[None] == np.arange(len(tracks))[:, None]
    is_others = (sightings.owner >= 0)[None] & ~is_owner
    is_outside = squared > limit * np.where(is_owner, settings.owner_gates**2, 1.0)
    forbidden = is_outside | (is_others & sightings.divided[None]) | (reverses & ~is_owner)
    cost = np.where(forbidden | is_far, np.inf, np.minimum(squared, limit) + limit * is_others)
    return cost, is_far & ~forbidden


def _off_speed(tracks: TrackTable, velocities: Velocities) -> FloatArray:
    """Compute what it costs that sightings move otherwise than tracks, (n, m); no more than a limit.

    A part of what was followed may have been of a vehicle in front.
    """
    state, covariance = tracks.state[:, None, 2:], tracks.covariance[:, None, 2:, 2:]
    squared = kalman.squared_distance(state, covariance, velocities.mean_mps[None], velocities.noise[None])
    return np.nan_to_num(np.minimum(squared, tracks.settings.flow_sigmas**2))


def _centres(tracks: TrackTable, sightings: Sightings) -> FloatArray:
    """Say where each track is if each sighting is of it: (n, m, 2), or (1, m, 2) where that is the same for all."""
    rows, columns = np.flatnonzero(sightings.is_hidden), np.flatnonzero(sightings.is_loose)
    if len(rows) == 0 or len(columns) == 0:
        return sightings.centre_m[None]
    centre_m = np.repeat(sightings.centre_m[None], len(tracks), axis=0)
    row, column = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
    centre_m[row, column] = measured(tracks, sightings, row, column)[0]
    return centre_m


def doubt(squared: FloatArray, gate_sigmas: float) -> FloatArray:
    """Say by how much to widen the noise of sightings outside the gate, so that they pull a track and do not tear it.

    Parameters
    ----------
    squared : (n,) squared Mahalanobis distances.
    gate_sigmas : where the gate ends.

    Returns
    -------
    (n,) factors on the noise covariance, 1 inside the gate.
    """
    return np.maximum(squared / gate_sigmas**2, 1.0)


def assign(cost: FloatArray, *, alone: float = NEVER_ALONE) -> tuple[IntArray, IntArray]:
    """Deal columns to rows at the least total cost, of pairs and of rows that are left alone.

    Parameters
    ----------
    cost : (n, m), infinite where forbidden.
    alone : what it costs to leave a row without a column; by default so much that there are as many pairs as possible.

    Returns
    -------
    Row and column of each pair.

    Examples
    --------
    >>> cost = np.array([[1.0, 2.0], [9.0, np.inf]])
    >>> [pair.tolist() for pair in assign(cost)]
    [[0, 1], [1, 0]]
    >>> [pair.tolist() for pair in assign(cost, alone=5.0)]     # nobody makes room for a poor pair
    [[0], [0]]
    """
    rows, columns = linear_sum_assignment(np.minimum(cost, alone))
    is_pair = cost[rows, columns] < alone
    return rows[is_pair], columns[is_pair]
