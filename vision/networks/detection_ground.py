"""Where on the ground are the vehicles whose boxes somebody drew into a picture?

A box in the picture holds the projection of a vehicle: its footprint, and above it the same footprint moved away from
the camera by its height. Near one place that projection is linear, so a box of extents `s` along its two axes is

    s = A (length, width, height),   A = how far each reaches along the axes of the box

Two equations for three unknowns: what is usual for the class fills in, weighted by how well the view can tell. From
straight above, length and width are measured; from low above the road they are the usual ones, and only the place is
measured. An upright box has no direction of its own; it is lent that of the track expected there, else the better of
across and along the picture is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from vision.detection.detector import Detections, Expected
from vision.networks.box_detector import CLASS_NAMES, GroundBoxes, ImageBoxes
from vision.networks.settings import UsualSize
from vision.objects import BoolArray, FloatArray, IntArray, Table
from vision.road.boxes import Boxes, axis, distance_to_boxes
from vision.road.kinds import heights_m
from vision.road.view import GroundView
from vision.settings import VisionSettings

# The place is found by Newton's method; it starts within a vehicle's length of it.
STEPS = 8
CLOSE_M = 0.02
LONGEST_STEP_M = 20.0
DERIVATIVE_STEP_M = 0.5


@dataclass(frozen=True, slots=True)
class _Guess(Table):
    """Vehicles that could be behind boxes; `misfit` (n,) says how badly they explain them."""

    footprint: Boxes
    noise: FloatArray
    misfit: FloatArray


def image_detections(
    boxes: ImageBoxes,
    view: GroundView,
    expected: Expected,
    *,
    image_size_px: tuple[int, int],
    settings: VisionSettings,
) -> Detections:
    """Put boxes of a picture on the ground.

    Parameters
    ----------
    boxes : in pixels.
    view : of the camera at that picture.
    expected : where objects must be; their directions are lent to boxes that have none.
    image_size_px : (width, height).
    settings : noise, the coarsest ground to look at.

    Returns
    -------
    One row for each box on ground that is seen finely enough; the owner is never known.
    """
    start_m, is_ground = _start(boxes, view)
    boxes, start_m = boxes.select(is_ground), start_m[is_ground]
    if len(boxes) == 0:
        return Detections.none()
    out = _outward(boxes, image_size_px, settings.networks.cut_px)
    is_cut = np.asarray(out.any(axis=1))
    heading, is_lent = _lent(
        lambda tracks: _seen_distance_m(boxes.centre_px, tracks, view), len(boxes), expected, settings
    )
    projection = _most_fitting(
        boxes, start_m, lent=np.where(is_lent, heading, np.nan), is_cut=is_cut, view=view, settings=settings
    )
    is_clear = is_lent.copy()
    is_free = ~is_lent
    if is_free.any():
        first, is_clear[is_free] = projection.select(is_free).undirected(start_m[is_free])
        heading[is_free], start_m[is_free] = first.footprint.heading_rad, first.footprint.centre_m
    heading = _with_own_axis(heading, boxes, start_m, view)
    guess = projection.directed(start_m, heading)
    elongation = np.where(boxes.is_oriented | is_clear, _elongation(guess.footprint), 1.0)
    ahead_px = view.to_pixels(guess.footprint.centre_m + axis(heading)) - view.to_pixels(guess.footprint.centre_m)
    cut = np.where(is_cut, np.where((ahead_px * out).sum(axis=1) >= 0, 1, -1), 0)
    detections = _detections(
        guess.footprint,
        guess.noise,
        elongation=elongation,
        is_directed=is_lent,
        cut=cut.astype(np.int8),
        weight=boxes.evidence(),
    )
    return detections.select(view.metres_per_pixel(guess.footprint.centre_m) <= settings.max_metres_per_pixel)


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


def _most_fitting(
    boxes: ImageBoxes,
    start_m: FloatArray,
    *,
    lent: FloatArray,
    is_cut: BoolArray,
    view: GroundView,
    settings: VisionSettings,
) -> _Projection:
    """Assume what is usual for the class; without one, a motorcycle or truck where that explains it clearly better.

    Trucks explain whatever is large, as a car askew is for who has no direction `lent` to it (nan).
    """

    def as_classes(assumed: IntArray) -> _Projection:
        usual, spread = np.split(_usual(settings)[assumed], 2, axis=1)
        spread[is_cut] = settings.networks.cut_spread_m
        return _Projection(boxes, usual, spread, view, settings)

    number, is_lent = boxes.class_number, np.isfinite(lent)
    is_open = number == CLASS_NAMES.index("unknown")
    if not is_open.any():
        return as_classes(number)

    def misfit(assumed: IntArray) -> FloatArray:
        projection = as_classes(assumed)
        directed = projection.directed(start_m, np.nan_to_num(lent)).misfit
        return np.where(is_lent, directed, projection.undirected(start_m)[0].misfit)

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


def _outward(boxes: ImageBoxes, image_size_px: tuple[int, int], cut_px: float) -> FloatArray:
    """Point (n, 2) out of the picture where boxes touch its edge; zero elsewhere."""
    bounds = boxes.bounds_px()
    last = np.array(image_size_px) - 0.5 - cut_px
    low, high = bounds[:, :2] <= cut_px - 0.5, bounds[:, 2:] >= last
    return np.asarray(high.astype(np.float64) - low)


@dataclass(frozen=True, slots=True)
class _Projection:
    """Boxes of a picture, and what is needed to find the vehicles behind them.

    Attributes
    ----------
    usual, spread : (n, 3) length, width and height as usual, and their standard deviations.
    settings : noise.
    """

    boxes: ImageBoxes
    usual: FloatArray
    spread: FloatArray
    view: GroundView
    settings: VisionSettings

    def select(self, which: BoolArray) -> _Projection:
        """Take some of the boxes."""
        return replace(self, boxes=self.boxes.select(which), usual=self.usual[which], spread=self.spread[which])

    def undirected(self, start_m: FloatArray) -> tuple[_Guess, BoolArray]:
        """Guess vehicles along boxes and across them; keep what explains each better, and tell where that is clear."""
        settings = self.settings.networks
        angles = (self.boxes.angle_rad, self.boxes.angle_rad + np.pi / 2)
        along, across = (self.directed(start_m, _on_ground(angle, start_m, self.view)) for angle in angles)
        is_across = across.misfit < along.misfit
        best = _Guess.joined([along, across]).select(np.arange(len(is_across)) + len(is_across) * is_across)
        is_better = np.abs(along.misfit - across.misfit) > settings.better_sigmas**2
        return best, (best.misfit < settings.explained_sigmas**2) & is_better

    def directed(self, start_m: FloatArray, heading: FloatArray) -> _Guess:
        """Find the vehicles of given headings: sizes by linear estimation, places by Newton's method."""
        boxes, view, settings = self.boxes, self.view, self.settings.networks
        axes = np.stack([axis(boxes.angle_rad), axis(boxes.angle_rad + np.pi / 2)], axis=1)  # (n, 2, 2) in the picture
        usual, variance = self.usual, self.spread**2
        edge_px = np.hypot(settings.edge_noise_px, settings.edge_noise_share * boxes.size_px)
        centre_m, lengths = start_m, usual
        for _ in range(STEPS):
            derivative, raised = _derivative(view, centre_m), _raised(view, centre_m)
            reach = np.stack([axis(heading), axis(heading + np.pi / 2), raised], axis=2)  # (n, 2, 3) metres
            gain = np.abs(axes @ derivative @ reach)
            seen_px, extent_px = _box_around(_corners_px(view, centre_m, heading, lengths), axes)
            # What a long vehicle covers is no linear function of its length, so the rest of it counts as measured.
            measured_px = boxes.size_px - extent_px + np.einsum("nij,nj->ni", gain, lengths)
            lengths, left, misfit = _sizes(gain, measured_px, usual, variance, edge_px)
            step_m = np.linalg.solve(derivative, (boxes.centre_px - seen_px)[:, :, None])[:, :, 0]
            length_m = np.hypot(step_m[:, 0], step_m[:, 1])
            centre_m = centre_m + step_m / np.maximum(length_m / LONGEST_STEP_M, 1.0)[:, None]
            if not (length_m > CLOSE_M).any():
                break
        spread_px = axes.transpose(0, 2, 1) * (edge_px**2 / 2)[:, None] @ axes
        to_ground = np.linalg.inv(derivative)
        noise = self.settings.detection.position_noise_m**2 * np.eye(2)
        noise = to_ground @ spread_px @ to_ground.transpose(0, 2, 1) + noise
        # By half of what the height is wrong, the middle of the box is displaced.
        noise += np.einsum("n,ni,nj->nij", left / 4, raised, raised)
        sizes = np.maximum(lengths, settings.smallest_m)
        return _Guess(Boxes(centre_m, heading, sizes[:, 0], sizes[:, 1]), noise, misfit)


def _derivative(view: GroundView, points_m: FloatArray) -> FloatArray:
    """Differentiate pixels by metres, (n, 2, 2), over a length as of a vehicle."""
    steps = DERIVATIVE_STEP_M * np.eye(2)
    columns = [view.to_pixels(points_m + step) - view.to_pixels(points_m - step) for step in steps]
    derivative = np.stack(columns, axis=2) / (2 * DERIVATIVE_STEP_M)
    # Far out, where nothing is kept, it may vanish: that must not stop the others.
    is_flat = ~(np.abs(np.linalg.det(derivative)) > 1e-12)
    derivative[is_flat] = np.eye(2)
    return derivative


def _raised(view: GroundView, points_m: FloatArray) -> FloatArray:
    """Say by how much ground (n, 2) what is one metre above the ground seems displaced."""
    sight = view.sight(points_m)
    return sight.away * sight.smear_m(1.0)[:, None]


def _sizes(
    reach: FloatArray, size_px: FloatArray, usual: FloatArray, variance: FloatArray, edge_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate (length, width, height) from extents and what is usual; with the height's variance and the misfit."""
    gain_left = variance[:, :, None] * reach.transpose(0, 2, 1)
    total = reach @ gain_left + edge_px[:, :, None] ** 2 * np.eye(2)
    surprise = size_px - np.einsum("nij,nj->ni", reach, usual)
    weighted = np.linalg.solve(total, surprise[:, :, None])
    gain = np.linalg.solve(total, gain_left.transpose(0, 2, 1))  # (n, 2, 3)
    left = variance[:, 2] - np.einsum("ni,ni->n", gain_left[:, 2], gain[:, :, 2])
    misfit = np.einsum("ni,ni->n", surprise, weighted[:, :, 0])
    return usual + (gain_left @ weighted)[:, :, 0], left, misfit


def _corners_px(view: GroundView, centre_m: FloatArray, heading: FloatArray, lengths: FloatArray) -> FloatArray:
    return view.corners_px(Boxes(centre_m, heading, lengths[:, 0], lengths[:, 1]), lengths[:, 2])


def _box_around(corners_px: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Put boxes along `axes`, (n, 2, 2), around corners (n, k, 2): their middles and extents, (n, 2) each."""
    places = np.einsum("nij,ncj->cni", axes, corners_px)
    low, high = places.min(axis=0), places.max(axis=0)
    return np.asarray(np.einsum("nij,ni->nj", axes, (low + high) / 2)), high - low


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
    to_ground = np.linalg.inv(_derivative(view, tracks.centre_m))
    offset_m = np.einsum("kij,nkj->nki", to_ground, points_px[:, None] - middle_px)
    ahead = axis(tracks.heading_rad)
    along_m = np.abs(np.einsum("nki,ki->nk", offset_m, ahead)) - tracks.length_m / 2
    across_m = np.abs(offset_m[..., 1] * ahead[:, 0] - offset_m[..., 0] * ahead[:, 1]) - tracks.width_m / 2
    return np.asarray(np.maximum(along_m, across_m))


def _with_own_axis(lent: FloatArray, boxes: ImageBoxes, points_m: FloatArray, view: GroundView) -> FloatArray:
    """Turn lent directions into the axis of oriented boxes: of its two axes, the one that is nearer."""
    if not boxes.is_oriented.any():
        return lent
    own = [_on_ground(boxes.angle_rad + turn_rad, points_m, view) for turn_rad in (0.0, np.pi / 2)]
    is_first = np.abs(np.cos(own[0] - lent)) >= np.abs(np.cos(own[1] - lent))
    return np.where(boxes.is_oriented, _front_as(lent, np.where(is_first, *own)), lent)


def _front_as(lent: FloatArray, own: FloatArray) -> FloatArray:
    """Turn axes round where their front would be the rear."""
    return np.where(np.cos(lent - own) < 0, own + np.pi, own)


def _on_ground(angle_rad: FloatArray, points_m: FloatArray, view: GroundView) -> FloatArray:
    """Project directions in the picture to headings on the ground."""
    ahead_m = view.to_ground(view.to_pixels(points_m) + axis(angle_rad))[0] - points_m
    return np.arctan2(ahead_m[:, 1], ahead_m[:, 0])


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
