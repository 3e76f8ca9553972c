"""Where on the ground are the vehicles whose boxes somebody drew into a picture?

A box in the picture holds the projection of a vehicle: its footprint, and above it the same footprint moved away from
the camera by its height. What is usual for the class fills in what a box does not tell (`vehicle_fit.py`): from
straight above, length and width are measured; from low above the road they are the usual ones, and only the place is
measured. An upright box has no direction of its own; it is lent that of the track expected there, else the better of
across and along the picture is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from vision.detection.detector import Detections, Expected, Velocities
from vision.detection.parting.lanes import LaneStrip, lane_headings
from vision.networks.box_detector import CLASS_NAMES, GroundBoxes, ImageBoxes, Shifts
from vision.networks.settings import UsualSize
from vision.networks.vehicle_fit import LONGEST_STEP_M, Ends, Guess, VehicleFit, heading_on_ground, pixels_by_metres
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.boxes import Boxes, axis, distance_to_boxes
from vision.road.kinds import CAR, TRUCK, heights_m
from vision.road.view import GroundView
from vision.settings import VisionSettings


def image_detections(
    boxes: ImageBoxes,
    view: GroundView,
    expected: Expected,
    *,
    image_size_px: tuple[int, int],
    settings: VisionSettings,
    lanes: Sequence[LaneStrip] = (),
) -> Detections:
    """Put boxes of a picture on the ground.

    Parameters
    ----------
    boxes : in pixels.
    view : of the camera at that picture.
    expected : where objects must be; their directions are lent to boxes that have none.
    image_size_px : (width, height).
    settings : noise, the coarsest ground to look at.
    lanes : of the road; what no track lends a direction lies along its lane, whichever end is its front.

    Returns
    -------
    One row for each box on ground that is seen finely enough; the owner is never known.
    """
    start_m, is_ground = _start(boxes, view)
    boxes, start_m = boxes.select(is_ground), start_m[is_ground]
    if len(boxes) == 0:
        return Detections.none()
    heading, is_lent = _lent(
        lambda tracks: _seen_distance_m(boxes.centre_px, tracks, view), len(boxes), expected, settings
    )
    ends = Ends.of(boxes, image_size_px, settings.networks)
    lent = np.where(is_lent, heading, np.nan)
    fit = _most_fitting(ends, start_m, lent=lent, number=boxes.class_number, view=view, settings=settings)
    is_clear = is_lent.copy()
    is_free = ~is_lent
    if is_free.any():
        first, is_clear[is_free] = _without_track(fit.select(is_free), start_m[is_free], lanes)
        heading[is_free], start_m[is_free] = first.footprint.heading_rad, first.footprint.centre_m
    heading = _with_own_axis(heading, boxes, start_m, view)
    guess = fit.directed(start_m, heading)
    elongation = np.where(boxes.is_oriented | is_clear, _elongation(guess.footprint), 1.0)
    ahead_px = view.to_pixels(guess.footprint.centre_m + axis(heading)) - view.to_pixels(guess.footprint.centre_m)
    out = ends.outward()
    cut = np.where(out.any(axis=1), np.where((ahead_px * out).sum(axis=1) >= 0, 1, -1), 0)
    detections = _detections(
        guess.footprint,
        guess.noise,
        elongation=elongation,
        is_directed=is_lent,
        cut=cut.astype(np.int8),
        weight=boxes.evidence(),
    )
    if boxes.shifts is not None:
        velocities = _velocities(boxes, boxes.shifts, view, settings)
        velocities.mean_mps[cut != 0] = np.nan  # the foot is not seen
        detections = replace(detections, velocities=velocities)
    return detections.select(view.metres_per_pixel(guess.footprint.centre_m) <= _coarsest_m(guess.footprint, settings))


def farther(settings: VisionSettings) -> VisionSettings:
    """Look as far as lorries are seen as large as cars are where these are looked at last."""
    largest = Boxes(np.zeros((1, 2)), np.zeros(1), np.array([TRUCK.length_m]), np.array([TRUCK.width_m]))
    return replace(settings, max_metres_per_pixel=float(_coarsest_m(largest, settings)[0]))


def _coarsest_m(footprints: Boxes, settings: VisionSettings) -> FloatArray:
    """Say how many metres a pixel may be, (n,), where bodies are still as large in the picture as the smallest cars."""
    area_m2 = footprints.width_m * heights_m(footprints.length_m)
    size = np.sqrt(area_m2 / (CAR.width_m * CAR.height_m))
    return np.asarray(settings.max_metres_per_pixel * np.maximum(size, 1.0))


def ground_detections(boxes: GroundBoxes, expected: Expected, settings: VisionSettings) -> Detections:
    """Fill in what a file does not say about boxes on the ground.

    Parameters
    ----------
    boxes : in metres.
    expected : where objects must be; their directions are lent to boxes that have none, or the opposite one.
    settings : noise.

    Returns
    -------
    One row for each box.
    """
    usual = _usual(settings)[boxes.class_number]
    has_heading = np.isfinite(boxes.heading_rad)
    footprint = Boxes(
        boxes.centre_m,
        np.where(has_heading, boxes.heading_rad, 0.0),
        np.where(np.isfinite(boxes.length_m), boxes.length_m, usual[:, 0]),
        np.where(np.isfinite(boxes.width_m), boxes.width_m, usual[:, 1]),
    )
    lent, is_lent = _lent(lambda tracks: distance_to_boxes(footprint.centre_m, tracks), len(boxes), expected, settings)
    heading = np.where(has_heading, _front_as(lent, footprint.heading_rad), lent)
    heading = np.where(is_lent, heading, footprint.heading_rad)
    footprint = Boxes(footprint.centre_m, heading, footprint.length_m, footprint.width_m)
    noise = np.broadcast_to(settings.detection.position_noise_m**2 * np.eye(2), (len(boxes), 2, 2)).copy()
    elongation = np.where(has_heading, _elongation(footprint), 1.0)
    return _detections(
        footprint,
        noise,
        elongation=elongation,
        is_directed=is_lent,
        cut=np.zeros(len(boxes), np.int8),
        weight=boxes.score,
    )


def _velocities(boxes: ImageBoxes, shifts: Shifts, view: GroundView, settings: VisionSettings) -> Velocities:
    """Turn shifts of feet in the picture into velocities on the ground."""
    foot_px = np.column_stack([boxes.centre_px[:, 0], boxes.bounds_px()[:, 3]])
    foot_m, is_ground = view.to_ground(foot_px)
    before_m, was_ground = view.to_ground(foot_px - shifts.shift_px)
    mean_mps = (foot_m - before_m) / shifts.over_s[:, None]
    mean_mps[~(is_ground & was_ground)] = np.nan
    to_ground = np.linalg.inv(pixels_by_metres(view, foot_m)) * (shifts.noise_px / shifts.over_s)[:, None, None]
    share_mps = settings.networks.flow_share * np.nan_to_num(mean_mps)
    noise = to_ground @ to_ground.transpose(0, 2, 1) + share_mps[:, :, None] * share_mps[:, None]
    return Velocities(mean_mps, noise + settings.detection.position_noise_m**2 * np.eye(2))


def _without_track(fit: VehicleFit, start_m: FloatArray, lanes: Sequence[LaneStrip]) -> tuple[Guess, BoolArray]:
    """Guess vehicles along their lanes where that explains their boxes, else along the picture or across it."""
    guess, is_clear = fit.undirected(start_m)
    place = guess.footprint
    way_rad = lane_headings(place.centre_m, lanes)
    along = fit.directed(place.centre_m, np.where(np.isnan(way_rad), place.heading_rad, way_rad))
    is_along = ~np.isnan(way_rad) & (along.misfit < fit.settings.networks.explained_sigmas**2)
    chosen = np.arange(len(is_along)) + len(is_along) * is_along
    return Guess.joined([guess, along]).select(chosen), is_clear | is_along


def _most_fitting(
    ends: Ends, start_m: FloatArray, *, lent: FloatArray, number: IntArray, view: GroundView, settings: VisionSettings
) -> VehicleFit:
    """Assume what is usual for the class; without one, a motorcycle or truck where that explains it clearly better.

    Trucks explain whatever is large, as a car askew is for who has no direction `lent` to it (nan).
    """

    def as_classes(assumed: IntArray) -> VehicleFit:
        usual, spread = np.split(_usual(settings)[assumed], 2, axis=1)
        return VehicleFit(ends, usual, spread, view, settings)

    is_lent = np.isfinite(lent)
    is_open = number == CLASS_NAMES.index("unknown")
    if not is_open.any():
        return as_classes(number)

    def misfit(assumed: IntArray) -> FloatArray:
        fit = as_classes(assumed)
        directed = fit.directed(start_m, np.nan_to_num(lent)).misfit
        return np.where(is_lent, directed, fit.undirected(start_m)[0].misfit)

    least, chosen = misfit(number) - settings.networks.better_sigmas**2, number
    for name, is_possible in (("motorcycle", is_open), ("truck", is_open & is_lent)):
        other = np.where(is_possible, CLASS_NAMES.index(name), number)
        found = misfit(other)
        is_better = is_possible & (found < least)
        least, chosen = np.where(is_better, found, least), np.where(is_better, other, chosen)
    return as_classes(chosen)


def _usual(settings: VisionSettings) -> FloatArray:
    """Tabulate usual sizes, a row for each class: length, width, height and their spreads."""
    sizes = settings.networks.usual_sizes
    return np.array([attrgetter(*UsualSize.__slots__)(getattr(sizes, name)) for name in CLASS_NAMES])


def _start(boxes: ImageBoxes, view: GroundView) -> tuple[FloatArray, BoolArray]:
    """Start from the ground in the middle of each box, or at its foot where the middle is above the horizon."""
    bounds = boxes.bounds_px()
    foot_px = np.column_stack([boxes.centre_px[:, 0], bounds[:, 3]])
    middle_m, is_below = view.to_ground(boxes.centre_px)
    foot_m, has_foot = view.to_ground(foot_px)
    # In a slanted view the middle of a box lies far behind the vehicle; in a steep one the foot does as well.
    is_far = np.hypot(*(middle_m - foot_m).T) > LONGEST_STEP_M
    return np.where((is_below & ~is_far)[:, None], middle_m, foot_m), is_below | has_foot


def _lent(
    distance_m: Callable[[Boxes], FloatArray], count: int, expected: Expected, settings: VisionSettings
) -> tuple[FloatArray, BoolArray]:
    """Give `count` boxes the direction of the track that they lie on, where there is one: (n,) and whether there is.

    `distance_m` says how far from each of k tracks they lie, (n, k).
    """
    heading, is_lent = np.zeros(count), np.zeros(count, np.bool_)
    for tracks in (expected.tentative, expected.known):
        if len(tracks) == 0:
            continue
        away_m = distance_m(tracks)
        nearest = np.argmin(away_m, axis=1)
        is_near = away_m[np.arange(count), nearest] <= settings.detection.lend_reach_m
        heading[is_near] = tracks.heading_rad[nearest[is_near]]
        is_lent |= is_near
    return heading, is_lent


def _seen_distance_m(points_px: FloatArray, tracks: Boxes, view: GroundView) -> FloatArray:
    """Measure how far from the middles of tracks, seen as bodies with a height, pixels (n, 2) lie on the ground."""
    middle_px = view.corners_px(tracks, heights_m(tracks.length_m)).mean(axis=1)
    to_ground = np.linalg.inv(pixels_by_metres(view, tracks.centre_m))
    offset_m = np.einsum("kij,nkj->nki", to_ground, points_px[:, None] - middle_px)
    ahead = axis(tracks.heading_rad)
    along_m = np.abs(np.einsum("nki,ki->nk", offset_m, ahead)) - tracks.length_m / 2
    across_m = np.abs(offset_m[..., 1] * ahead[:, 0] - offset_m[..., 0] * ahead[:, 1]) - tracks.width_m / 2
    return np.asarray(np.maximum(along_m, across_m))


def _with_own_axis(lent: FloatArray, boxes: ImageBoxes, points_m: FloatArray, view: GroundView) -> FloatArray:
    """Turn lent directions into the axis of oriented boxes: of its two axes, the one that is nearer."""
    if not boxes.is_oriented.any():
        return lent
    own = [heading_on_ground(axis(boxes.angle_rad + turn_rad), points_m, view) for turn_rad in (0.0, np.pi / 2)]
    is_first = np.abs(np.cos(own[0] - lent)) >= np.abs(np.cos(own[1] - lent))
    return np.where(boxes.is_oriented, _front_as(lent, np.where(is_first, *own)), lent)


def _front_as(lent: FloatArray, own: FloatArray) -> FloatArray:
    """Turn axes round where their front would be the rear."""
    return np.where(np.cos(lent - own) < 0, own + np.pi, own)


def _elongation(boxes: Boxes) -> FloatArray:
    return np.asarray(boxes.length_m / boxes.width_m)


def _detections(
    footprint: Boxes,
    noise: FloatArray,
    *,
    elongation: FloatArray,
    is_directed: BoolArray,
    cut: NDArray[np.int8],
    weight: FloatArray,
) -> Detections:
    count = len(footprint)
    return Detections(
        boxes=footprint,
        noise=noise,
        elongation=elongation,
        owner=np.full(count, -1, np.intp),
        divided=np.zeros(count, np.bool_),
        directed=is_directed,
        cut=cut,
        borders_m=np.full((count, 4), np.nan),
        weight=weight,
    )
