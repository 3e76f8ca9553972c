"""What is known of each tracked object? A table with one row per track, stored by columns."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes, axis, distance_to_boxes, wrap_angle
from vision.tracking.settings import TrackingSettings

IntArray = NDArray[np.int64]

# Columns without rows.
_NUMBERS = partial(np.zeros, 0)
_PAIRS, _FOURS, _SQUARES = (partial(np.zeros, (0, *shape)) for shape in ((2,), (4,), (4, 4)))


def _counts() -> IntArray:
    return np.zeros(0, np.int64)


def _truths() -> BoolArray:
    return np.zeros(0, np.bool_)


@dataclass(slots=True)
class TrackTable:
    """All tracks, one row each.

    Attributes
    ----------
    settings : how sizes are learned, what drives and what stands; the same for all rows.
    number : part of the name; -1 until confirmed.
    state, covariance : (n, 4) x, y, vx, vy and (n, 4, 4).
    heading_rad, length_m, width_m : the box.
    sized_us, misfit_us : for how long the size was measured, and for how long measurements have contradicted it.
    odd_m : (n, 4) length, width and offset from the track, east and north, of the first of these.
    evidence : the sum of the weights of all detections so far.
    born_us, seen_us : time of the first and of the latest detection.
    born_m, seen_m : (n, 2) position at these times.
    rest_m, rest_us : (n, 2) where it stands, and since when; both move on with it.
    is_confirmed : shown to the outside.
    is_proved : known to be an object and no ghost, because it moved or has an outline of its own.
    is_observed, is_clipped : of the latest frame.
    doubled_us : how long it has stood inside an older track.
    coupled_us : how long it has ridden with an older track as one body (`couples.py`).
    twin_us : how long it has lain across an older track without both being seen in one frame.
    borders_m, borders_us : (n, 4) mean width of its dark borders (`shadow.py`), and for how long they were measured.
    """

    settings: TrackingSettings
    number: IntArray = field(default_factory=_counts)
    state: FloatArray = field(default_factory=_FOURS)
    covariance: FloatArray = field(default_factory=_SQUARES)
    heading_rad: FloatArray = field(default_factory=_NUMBERS)
    length_m: FloatArray = field(default_factory=_NUMBERS)
    width_m: FloatArray = field(default_factory=_NUMBERS)
    sized_us: IntArray = field(default_factory=_counts)
    misfit_us: IntArray = field(default_factory=_counts)
    odd_m: FloatArray = field(default_factory=_FOURS)
    evidence: FloatArray = field(default_factory=_NUMBERS)
    born_us: IntArray = field(default_factory=_counts)
    seen_us: IntArray = field(default_factory=_counts)
    born_m: FloatArray = field(default_factory=_PAIRS)
    seen_m: FloatArray = field(default_factory=_PAIRS)
    rest_m: FloatArray = field(default_factory=_PAIRS)
    rest_us: IntArray = field(default_factory=_counts)
    is_confirmed: BoolArray = field(default_factory=_truths)
    is_proved: BoolArray = field(default_factory=_truths)
    is_observed: BoolArray = field(default_factory=_truths)
    is_clipped: BoolArray = field(default_factory=_truths)
    doubled_us: IntArray = field(default_factory=_counts)
    coupled_us: IntArray = field(default_factory=_counts)
    twin_us: IntArray = field(default_factory=_counts)
    borders_m: FloatArray = field(default_factory=_FOURS)
    borders_us: IntArray = field(default_factory=_counts)

    def __len__(self) -> int:
        return len(self.number)

    def select(self, which: BoolArray) -> TrackTable:
        """Keep some rows.

        Parameters
        ----------
        which : (n,).

        Returns
        -------
        A table of those rows.
        """
        return self if which.all() else TrackTable(self.settings, *(column[which] for column in self._columns()))

    def append(self, other: TrackTable) -> TrackTable:
        """Add the rows of another table at the end.

        Parameters
        ----------
        other : the rows to add.

        Returns
        -------
        A table of both.
        """
        columns = zip(self._columns(), other._columns(), strict=True)
        return TrackTable(self.settings, *(np.concatenate(pair) for pair in columns))

    def _columns(self) -> list[NDArray[Any]]:
        return [getattr(self, column.name) for column in fields(self)[1:]]

    def boxes(self) -> Boxes:
        """Box every track at its present position.

        Returns
        -------
        One box a row.
        """
        return Boxes(self.state[:, :2], self.heading_rad, self.length_m, self.width_m)

    def speed_mps(self) -> FloatArray:
        """Measure how fast every track moves.

        Returns
        -------
        (n,).
        """
        return np.hypot(self.state[:, 2], self.state[:, 3])

    def course_rad(self) -> FloatArray:
        """Tell where every track moves to.

        Returns
        -------
        (n,) direction of the velocity.
        """
        return np.arctan2(self.state[:, 3], self.state[:, 2])

    def is_sized(self) -> BoolArray:
        """Tell which tracks have a size that can be relied on.

        Returns
        -------
        (n,).
        """
        return self.sized_us >= self.settings.sized_us

    def is_driving(self) -> BoolArray:
        """Tell which tracks are vehicles of known size that drive: of them it is known where they are while hidden.

        Returns
        -------
        (n,).
        """
        return self.is_confirmed & self.is_sized() & (self.speed_mps() >= self.settings.driving_mps)

    def turn_ahead(self, rows: NDArray[np.intp], is_shared: BoolArray, now_us: int) -> None:
        """Turn the heading of moving tracks along their velocity; standing ones keep theirs.

        Nobody turns round on the spot: who has come ahead since it was seen first keeps its front while it stands, or
        backs, and seems to go the other way. And nobody turns in less than a circle, or drives sideways: what seems to
        in a shared blob has got cells of a neighbour, or of a shadow, and its velocity is what is left of it ahead.

        Parameters
        ----------
        rows : (m,) which tracks are seen.
        is_shared : (m,) which of them share a blob.
        now_us : the frame's time; `seen_us` is still that of the time before.
        """
        settings = self.settings
        spread_mps = np.sqrt(self.covariance[:, 2, 2] + self.covariance[:, 3, 3])
        sure_mps = np.minimum(settings.sure_sigmas * spread_mps, settings.sure_mps)
        speed_mps, course_rad = self.speed_mps(), self.course_rad()
        is_moving = speed_mps >= np.maximum(settings.heading_speed_mps, sure_mps)
        ahead_m = np.einsum("ni,ni->n", self.state[:, :2] - self.born_m, axis(self.heading_rad))
        backs = (np.cos(course_rad - self.heading_rad) < 0.0) & (ahead_m > self.length_m)
        is_turning = (is_moving & (~backs | (speed_mps >= settings.sure_mps)))[rows]
        aside_rad = wrap_angle(course_rad - self.heading_rad)[rows]
        about_rad = np.pi * (np.abs(aside_rad) > np.pi / 2)  # which end is the front may not have been known
        aside_rad = wrap_angle(aside_rad - about_rad)
        driven_m = speed_mps[rows] * (now_us - self.seen_us[rows]) / 1_000_000
        most_rad = np.where(is_shared, driven_m / settings.turn_radius_m, np.inf)
        turn_rad = about_rad + np.clip(aside_rad, -most_rad, most_rad)
        self.heading_rad[rows] = wrap_angle(self.heading_rad[rows] + np.where(is_turning, turn_rad, 0.0))
        slides = rows[np.abs(aside_rad) > most_rad]
        ahead = axis(self.heading_rad[slides])
        self.state[slides, 2:] = np.einsum("ni,ni->n", self.state[slides, 2:], ahead)[:, None] * ahead

    def note_rest(self, now_us: int) -> None:
        """Keep track of how long each track has been standing where it is.

        Parameters
        ----------
        now_us : the frame's time.
        """
        shift_m = self.state[:, :2] - self.rest_m
        has_moved = np.hypot(*shift_m.T) > self.settings.rest_radius_m
        along_m = np.abs(np.einsum("ni,ni->n", shift_m, axis(self.heading_rad)))
        # Nobody starts sideways: what is seen there now may be the road that the vehicle has left.
        is_slow = self.speed_mps() < self.settings.sideways_mps
        self.is_proved[has_moved & is_slow & (along_m < self.settings.sideways_share * np.hypot(*shift_m.T))] = False
        self.rest_m = np.where(has_moved[:, None], self.state[:, :2], self.rest_m)
        self.rest_us = np.where(has_moved, now_us, self.rest_us)

    def learn_size(self, rows: NDArray[np.intp], boxes: Boxes, usual_length_m: float, seen_us: int) -> None:
        """Take measured sizes of whole, undivided boxes into account.

        Parameters
        ----------
        rows : (m,) which tracks were measured.
        boxes : m.
        usual_length_m : of a car.
        seen_us : the time that each measurement stands for.
        """
        length_m, width_m = boxes.length_m, boxes.width_m
        error_m = np.maximum(np.abs(length_m - self.length_m[rows]), np.abs(width_m - self.width_m[rows]))
        is_misfit = error_m > self.settings.size_misfit_m
        # A body keeps its size and its place on the track. What does not is the part that shows beside a bridge, or
        # through a hole in the leaves. What stands or creeps cannot be told apart like that.
        seen_m = np.column_stack([length_m, width_m, boxes.centre_m - self.state[rows, :2]])
        is_same = np.abs(seen_m - self.odd_m[rows]).max(axis=1) < self.settings.size_misfit_m
        is_same |= self.speed_mps()[rows] < self.settings.driving_mps
        misfit_us = self.misfit_us[rows] + np.where(is_same, seen_us, -self.settings.size_outlier * seen_us)
        is_first = ~is_misfit | (misfit_us <= 0)
        self.odd_m[rows] = np.where(is_first[:, None], seen_m, self.odd_m[rows])
        misfit_us = np.where(is_misfit, np.maximum(misfit_us, seen_us), 0)
        # What begins smaller than a car and grows comes out from under something: that is not its size. Larger ones are
        # left alone: two vehicles in one blob grow as well.
        growth_m = np.maximum(length_m - self.length_m[rows], width_m - self.width_m[rows])
        is_growing = ~self.is_sized()[rows] & (growth_m > self.settings.fit_tolerance_m)
        is_growing &= self.length_m[rows] < usual_length_m
        is_fresh = (misfit_us >= self.settings.size_misfit_us) | (self.sized_us[rows] == 0) | is_growing
        sized_us = np.where(is_fresh, seen_us, self.sized_us[rows] + seen_us)
        weight = seen_us / np.minimum(sized_us, self.settings.size_memory_us)
        for size, measured in ((self.length_m, length_m), (self.width_m, width_m)):
            step = np.clip(measured - size[rows], -self.settings.size_step_m, self.settings.size_step_m)
            size[rows] = np.where(is_fresh, measured, size[rows] + step * weight)
        self.sized_us[rows] = sized_us
        # What stands there is not what was known: perhaps the road that a car uncovered. It has to prove itself again.
        self.is_proved[rows[misfit_us >= self.settings.size_misfit_us]] = False
        self.misfit_us[rows] = np.where(is_fresh, 0, misfit_us)

    def grow(self, rows: NDArray[np.intp], length_m: FloatArray, width_m: FloatArray) -> None:
        """Make boxes at least as large as what is in view of them; for objects cut by the view edge.

        Parameters
        ----------
        rows : (m,) which tracks were measured.
        length_m, width_m : (m,) of the part in view.
        """
        self.length_m[rows] = np.maximum(self.length_m[rows], length_m)
        self.width_m[rows] = np.maximum(self.width_m[rows], width_m)

    def lengthen(self, row: int, part: int) -> None:
        """Let a track reach over another one that is a part of it; it learns its size anew.

        Parameters
        ----------
        row, part : of the two.
        """
        (ahead,) = axis(self.heading_rad[[row]])
        offset_m, half_m = (self.state[part, :2] - self.state[row, :2]) @ ahead, self.length_m[[row, part]] / 2
        front_m, rear_m = max(half_m[0], offset_m + half_m[1]), min(-half_m[0], offset_m - half_m[1])
        self.state[row, :2] += (front_m + rear_m) / 2 * ahead
        self.length_m[row] = front_m - rear_m
        self.sized_us[row] = 0

    def learn_borders(self, rows: NDArray[np.intp], borders_m: FloatArray, seen_us: int) -> None:
        """Take measured dark borders into account.

        Parameters
        ----------
        rows : (m,) which tracks were measured.
        borders_m : (m, 4), nan where not measured.
        seen_us : the time that each measurement stands for.
        """
        is_measured = ~np.isnan(borders_m[:, 0])
        rows, borders_m = rows[is_measured], borders_m[is_measured]
        self.borders_us[rows] += seen_us
        weight = seen_us / np.minimum(self.borders_us[rows], self.settings.size_memory_us)
        self.borders_m[rows] += (borders_m - self.borders_m[rows]) * weight[:, None]

    def is_crowded(self, gap_m: float) -> bool:
        """Tell whether the bodies of any two tracks may be within a gap of each other, for all that is known of them.

        Parameters
        ----------
        gap_m : between the bodies.
        """
        reach_m = gap_m + np.maximum(self.length_m, self.width_m).max(initial=0.0)
        reach_m += np.sqrt(2 * (self.covariance[:, 0, 0] + self.covariance[:, 1, 1]).max(initial=0.0))
        apart_m = np.abs(self.state[:, None, :2] - self.state[:, :2]).max(axis=2)
        return bool(np.count_nonzero(apart_m < reach_m) > len(self))

    def doubles(self, bodies: Boxes) -> BoolArray:
        """Find tracks that stand inside a longer-lived one: fragments of it.

        Parameters
        ----------
        bodies : of all tracks, with or without shadows.

        Returns
        -------
        (n,).
        """
        inside = distance_to_boxes(bodies.centre_m, bodies) < -self.settings.double_depth_m
        return np.asarray((inside & self.older()).any(axis=1))

    def twins(self, now_us: int) -> BoolArray:
        """Find tracks that lie across a confirmed older one, both seen of late, but in this frame one of them at most.

        Who is ahead of whom is told by no more than the noise of both, where a row of pixels is metres of road.

        Parameters
        ----------
        now_us : the frame's time.

        Returns
        -------
        (n,).
        """
        rows = np.flatnonzero(now_us - self.seen_us <= self.settings.twin_seen_us)
        east_m, north_m = self.state[rows, 0], self.state[rows, 1]
        reach_m = self.length_m[rows].max(initial=0.0)
        reach_m += np.sqrt(2 * (self.covariance[rows, 0, 0] + self.covariance[rows, 1, 1]).max(initial=0.0))
        is_seen = self.is_observed[rows]
        # Few pairs are near each other and not both seen: the others are left out before anything costs much.
        is_near = np.abs(east_m[:, None] - east_m) < reach_m
        is_near &= np.abs(north_m[:, None] - north_m) < reach_m
        is_near &= ~(is_seen[:, None] & is_seen) & self.is_confirmed[rows]
        one, other = (rows[side] for side in np.nonzero(is_near))
        is_twin = np.zeros(len(self), np.bool_)
        is_twin[one[self._overlaps(one, other) & self._is_older(other, one)]] = True
        return is_twin

    def _overlaps(self, one: NDArray[np.intp], other: NDArray[np.intp]) -> BoolArray:
        """Tell for pairs of rows whether the boxes may overlap, both taken to lie along the other's."""
        offset_m, ahead = self.state[one, :2] - self.state[other, :2], axis(self.heading_rad[other])
        along_m = np.abs(np.einsum("ni,ni->n", offset_m, ahead))
        across_m = np.abs(offset_m[:, 1] * ahead[:, 0] - offset_m[:, 0] * ahead[:, 1])
        noise = self.covariance[one, :2, :2] + self.covariance[other, :2, :2]
        noise_m = np.sqrt(np.einsum("ni,nij,nj->n", ahead, noise, ahead))
        is_along = along_m < (self.length_m[one] + self.length_m[other]) / 2 + noise_m
        return np.asarray(is_along & (across_m < (self.width_m[one] + self.width_m[other]) / 2))

    def _is_older(self, one: NDArray[np.intp], other: NDArray[np.intp]) -> BoolArray:
        """Tell for pairs of rows whether the first counts as older; of two alike, the one that comes first."""
        born_us, area_m2 = self.born_us, self.length_m * self.width_m
        is_larger = (area_m2[one] > area_m2[other]) | ((area_m2[one] == area_m2[other]) & (one < other))
        return np.asarray((born_us[one] < born_us[other]) | ((born_us[one] == born_us[other]) & is_larger))

    def older(self) -> BoolArray:
        """Tell which tracks (columns) count as older than which (rows); born at once, the larger box wins."""
        area = self.length_m * self.width_m
        is_earlier = self.born_us[None] < self.born_us[:, None]
        return np.asarray(is_earlier | ((self.born_us[None] == self.born_us[:, None]) & (area[None] > area[:, None])))
