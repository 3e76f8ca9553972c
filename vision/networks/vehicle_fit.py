"""Which vehicle is behind a box of a picture? The one of usual size whose projection fills what is seen of the box.

Near one place the projection of a vehicle is linear, so a box of extents `s` along its two axes is

    s = A (length, width, height),   A = how far each reaches along the axes of the box

Two equations for three unknowns: what is usual for the class fills in, weighted by how well the view can tell. Where a
box ends at the edge of the picture, nobody sees how far the vehicle goes on: that extent tells nothing, and the place
is told by the end that is seen. A foot tells the place whatever the height; a roof does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vision.networks.box_detector import ImageBoxes
from vision.networks.settings import NetworkSettings
from vision.objects import BoolArray, FloatArray, Table
from vision.road.boxes import Boxes, axis
from vision.road.view import GroundView
from vision.settings import VisionSettings

# The place is found by Newton's method; it starts within a vehicle's length of it.
STEPS = 8
CLOSE_M = 0.02
LONGEST_STEP_M = 20.0
DERIVATIVE_STEP_M = 0.5
# Standard deviation of an extent that is not seen: farther than any picture reaches.
UNSEEN_PX = 1e5


@dataclass(frozen=True, slots=True)
class Ends(Table):
    """Boxes of a picture by their ends along two axes each, the own one and the one across it.

    Attributes
    ----------
    axes : (n, 2, 2) unit vectors, a row for each axis.
    at_px : (n, 2, 2) where along each axis the low and the high end lie.
    edge_px : (n, 2) standard deviation of the ends along each axis.
    is_hidden : (n, 2, 2) which ends lie at the edge of the picture: the vehicle may go on beyond them.
    """

    axes: FloatArray
    at_px: FloatArray
    edge_px: FloatArray
    is_hidden: BoolArray

    @classmethod
    def of(cls, boxes: ImageBoxes, image_size_px: tuple[int, int], settings: NetworkSettings) -> Ends:
        """Measure the ends of boxes in a picture of some width and height."""
        axes = np.stack([axis(boxes.angle_rad), axis(boxes.angle_rad + np.pi / 2)], axis=1)
        half_px = boxes.size_px[:, :, None] * (-0.5, 0.5)
        at_px = np.einsum("nai,ni->na", axes, boxes.centre_px)[:, :, None] + half_px
        places_px = boxes.centre_px[:, None, None] + half_px[..., None] * axes[:, :, None]  # (n, axis, end, 2)
        share = settings.edge_noise_share if boxes.edge_share is None else boxes.edge_share[:, None]
        edge_px = np.hypot(settings.edge_noise_px, share * boxes.size_px)
        # What ends nearer to the edge than it is known may well go on beyond it.
        reach_px = np.maximum(settings.cut_px, edge_px)[:, :, None, None]
        is_out = (places_px <= reach_px - 0.5) | (places_px >= np.array(image_size_px) - 0.5 - reach_px)
        return cls(axes, at_px, edge_px, np.asarray(is_out.any(axis=3)))

    def outward(self) -> FloatArray:
        """Point (n, 2) out of the picture where boxes go on beyond its edge; zero elsewhere."""
        return np.asarray(np.einsum("na,nai->ni", self.is_hidden @ (-1.0, 1.0), self.axes))

    def share(self) -> FloatArray:
        """Say how much each end tells of the place, (n, 2, 2): of two that are seen, each half."""
        return np.asarray(~self.is_hidden / np.maximum((~self.is_hidden).sum(axis=2, keepdims=True), 1))

    def place_px2(self) -> FloatArray:
        """Give the variance of places along each axis, (n, 2); between two hidden ends they may be anywhere."""
        size_px = self.at_px[..., 1] - self.at_px[..., 0]
        return np.where(self.is_hidden.all(axis=2), size_px**2 / 4, (self.share() ** 2).sum(axis=2) * self.edge_px**2)

    def seen_of(self, corners_px: FloatArray) -> FloatArray:
        """Say where bodies with corners (n, k, 2) would end, (n, 2, 2): that is seen up to the hidden ends only.

        What is hidden on one side may be what reaches farthest on another one.
        """
        places = np.einsum("nai,nci->nac", self.axes, corners_px)
        ends_px = np.stack([places.min(axis=2), places.max(axis=2)], axis=2)
        for nth in np.flatnonzero(self.is_hidden.any(axis=(1, 2))):
            for one, other in ((0, 1), (1, 0)):
                low_px, high_px = np.where(self.is_hidden[nth, other], self.at_px[nth, other], (-np.inf, np.inf))
                reached = _between(places[nth, other], places[nth, one], low_px, high_px)
                if len(reached) > 0:
                    ends_px[nth, one] = reached.min(), reached.max()
        return ends_px


def _between(along: FloatArray, across: FloatArray, low: float, high: float) -> FloatArray:
    """List how far across a convex body reaches between two places along: at its corners, and where it is cut."""
    found = [across[(along >= low) & (along <= high)]]
    rise, run = np.subtract.outer(across, across), np.subtract.outer(along, along)
    for limit in (low, high):
        one, other = np.nonzero((along < limit)[:, None] & (along > limit))
        found.append(across[one] + (limit - along[one]) * rise[other, one] / run[other, one])
    return np.concatenate(found)


@dataclass(frozen=True, slots=True)
class Guess(Table):
    """Vehicles that could be behind boxes; `misfit` (n,) says how badly they explain them."""

    footprint: Boxes
    noise: FloatArray
    misfit: FloatArray


@dataclass(frozen=True, slots=True)
class _Step:
    """Hold how far from the truth vehicles are, (n,), and what would be nearer: centre, (length, width, height)."""

    cost: FloatArray
    centre_m: FloatArray
    lengths: FloatArray
    noise: FloatArray
    misfit: FloatArray


@dataclass(frozen=True, slots=True)
class VehicleFit:
    """Boxes of a picture, and what is needed to find the vehicles behind them.

    Attributes
    ----------
    ends : of the boxes.
    usual, spread : (n, 3) length, width and height as usual, and their standard deviations.
    view : of the camera.
    settings : noise.
    """

    ends: Ends
    usual: FloatArray
    spread: FloatArray
    view: GroundView
    settings: VisionSettings

    def select(self, which: BoolArray) -> VehicleFit:
        """Take some of the boxes."""
        return replace(self, ends=self.ends.select(which), usual=self.usual[which], spread=self.spread[which])

    def undirected(self, start_m: FloatArray) -> tuple[Guess, BoolArray]:
        """Guess vehicles along boxes and across them; keep what explains each better, and tell where that is clear."""
        settings = self.settings.networks
        headings = (heading_on_ground(self.ends.axes[:, nth], start_m, self.view) for nth in (0, 1))
        along, across = (self.directed(start_m, heading_rad) for heading_rad in headings)
        is_across = across.misfit < along.misfit
        best = Guess.joined([along, across]).select(np.arange(len(is_across)) + len(is_across) * is_across)
        is_better = np.abs(along.misfit - across.misfit) > settings.better_sigmas**2
        return best, (best.misfit < settings.explained_sigmas**2) & is_better

    def directed(self, start_m: FloatArray, heading_rad: FloatArray) -> Guess:
        """Find the vehicles of given headings: sizes by linear estimation, places by Newton's method."""
        centre_m, lengths = kept_m, kept = start_m, self.usual
        least = np.full(len(start_m), np.inf)
        for _ in range(STEPS):
            step = self._step(centre_m, heading_rad, lengths)
            is_better = (step.cost < least)[:, None]
            least = np.fmin(step.cost, least)
            kept_m, kept = np.where(is_better, centre_m, kept_m), np.where(is_better, lengths, kept)
            # A long vehicle near the camera is anything but linear: of a step that went too far, half is tried.
            centre_m = np.where(is_better, step.centre_m, (centre_m + kept_m) / 2)
            lengths = np.where(is_better, step.lengths, (lengths + kept) / 2)
            if not (np.abs(centre_m - kept_m) > CLOSE_M).any():
                break
        step = self._step(kept_m, heading_rad, kept)
        sizes = np.maximum(step.lengths, self.settings.networks.smallest_m)
        return Guess(Boxes(step.centre_m, heading_rad, sizes[:, 0], sizes[:, 1]), step.noise, step.misfit)

    def _step(self, centre_m: FloatArray, heading_rad: FloatArray, lengths: FloatArray) -> _Step:
        ends, view, variance = self.ends, self.view, self.spread**2
        share, is_whole = ends.share(), ~ends.is_hidden.any(axis=2)
        derivative, lean = pixels_by_metres(view, centre_m), view.lean(centre_m)
        reach = np.stack([axis(heading_rad), axis(heading_rad + np.pi / 2), lean], axis=2)  # (n, 2, 3) metres
        signed = ends.axes @ derivative @ reach
        gain = np.abs(signed)  # pixels by metres, the extents of a box by those of the vehicle
        off_px = ends.at_px - ends.seen_of(_corners_px(view, centre_m, heading_rad, lengths))
        cost = ((share > 0) * (off_px / ends.edge_px[:, :, None]) ** 2).sum(axis=(1, 2))
        cost += ((lengths - self.usual) ** 2 / variance).sum(axis=1)
        # What a long vehicle covers is no linear function of its length, so the rest of it counts as measured.
        excess_px = np.where(is_whole, off_px[..., 1] - off_px[..., 0], 0.0)
        measured_px = excess_px + np.einsum("nij,nj->ni", gain, lengths)
        extent_noise_px = np.where(is_whole, ends.edge_px, UNSEEN_PX)
        sizes, left, misfit = _sizes(gain, measured_px, self.usual, variance, extent_noise_px)
        step_px = (share * off_px).sum(axis=2)
        step_m = np.linalg.solve(ends.axes @ derivative, step_px[:, :, None])[:, :, 0]
        length_m = np.hypot(step_m[:, 0], step_m[:, 1])
        centre_m = centre_m + step_m / np.maximum(length_m / LONGEST_STEP_M, 1.0)[:, None]
        # The middle of a box is displaced by half of what the height is wrong; a place told by one end, by half of what
        # the extent is wrong as well.
        shift = (share[..., 0] - share[..., 1])[:, :, None] * gain / 2
        shift[:, :, 2] -= signed[:, :, 2] / 2
        noise_px = ends.place_px2()[:, :, None] * np.eye(2) + shift @ left @ shift.transpose(0, 2, 1)
        to_ground = np.linalg.inv(ends.axes @ derivative)
        noise = to_ground @ noise_px @ to_ground.transpose(0, 2, 1)
        noise += self.settings.detection.position_noise_m**2 * np.eye(2)
        return _Step(cost, centre_m, sizes, noise, misfit)


def pixels_by_metres(view: GroundView, points_m: FloatArray) -> FloatArray:
    """Differentiate pixels by metres, (n, 2, 2), over a length as of a vehicle."""
    steps = DERIVATIVE_STEP_M * np.eye(2)
    columns = [view.to_pixels(points_m + step) - view.to_pixels(points_m - step) for step in steps]
    derivative = np.stack(columns, axis=2) / (2 * DERIVATIVE_STEP_M)
    # Far out, where nothing is kept, it may vanish: that must not stop the others.
    is_flat = ~(np.abs(np.linalg.det(derivative)) > 1e-12)
    derivative[is_flat] = np.eye(2)
    return derivative


def heading_on_ground(ahead: FloatArray, points_m: FloatArray, view: GroundView) -> FloatArray:
    """Project directions in the picture, (n, 2), to headings on the ground."""
    ahead_m = view.to_ground(view.to_pixels(points_m) + ahead)[0] - points_m
    return np.arctan2(ahead_m[:, 1], ahead_m[:, 0])


def _sizes(
    reach: FloatArray, size_px: FloatArray, usual: FloatArray, variance: FloatArray, noise_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate (length, width, height) from extents and what is usual; with their covariance and the misfit."""
    prior = variance[:, :, None] * np.eye(3)
    gain_left = prior @ reach.transpose(0, 2, 1)
    total = reach @ gain_left + noise_px[:, :, None] ** 2 * np.eye(2)
    surprise = size_px - np.einsum("nij,nj->ni", reach, usual)
    weighted = np.linalg.solve(total, surprise[:, :, None])
    left = prior - gain_left @ np.linalg.solve(total, gain_left.transpose(0, 2, 1))
    misfit = np.einsum("ni,ni->n", surprise, weighted[:, :, 0])
    return usual + (gain_left @ weighted)[:, :, 0], left, misfit


def _corners_px(view: GroundView, centre_m: FloatArray, heading_rad: FloatArray, lengths: FloatArray) -> FloatArray:
    return view.corners_px(Boxes(centre_m, heading_rad, lengths[:, 0], lengths[:, 1]), lengths[:, 2])
