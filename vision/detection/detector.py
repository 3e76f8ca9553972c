"""Which boxes on the road hold something now? What detectors say, and the built-in one, by motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.background.background import AT_THRESHOLD, Background
from vision.detection.blobs import Cells, find_blobs
from vision.detection.parting.lanes import LaneField
from vision.detection.settings import DetectionSettings
from vision.detection.split import assign_cells
from vision.detection.surfaces.surface import Appearances, Surface
from vision.objects import BoolArray, FloatArray, IntArray, Table
from vision.road.boxes import Boxes, distance_to_boxes
from vision.road.rectify import RoadImage
from vision.settings import VisionSettings
from vision.video.frames import ByteArray


@dataclass(frozen=True, slots=True)
class Velocities(Table):
    """How fast things were seen to move, one row each: `mean_mps` (n, 2), nan where unknown; `noise` (n, 2, 2)."""

    mean_mps: FloatArray
    noise: FloatArray


@dataclass(frozen=True, slots=True)
class Detections(Table):
    """What was found in one frame, one row each.

    Attributes
    ----------
    boxes : on the ground; without an owner the heading is that of the long axis, front or rear unknown.
    noise : (n, 2, 2) covariance of the centres of whole, undivided boxes.
    elongation : (n,) ratio of the spreads along and across; near 1 the heading means nothing. Infinite where the
        heading is that of an owner.
    owner : (n,) row of the predicted box that the cells were given to, -1 for none.
    divided : (n,) True if the blob was shared out between several predicted boxes.
    directed : (n,) True if the heading came from a track, so that the front is known.
    cut : (n,) +1 where the view edge cuts the front, -1 the rear, 0 where the box is whole.
    borders_m : (n, 4) dark borders in front, behind, left, right (`shadow.py`); nan where not measured.
    weight : (n,) how much evidence for a vehicle each is, 1 for a usual one, below 0 against it; None for 1 each.
    velocities : how fast they were seen to move; None if nobody followed them.
    """

    boxes: Boxes
    noise: FloatArray
    elongation: FloatArray
    owner: IntArray
    divided: BoolArray
    directed: BoolArray
    cut: NDArray[np.int8]
    borders_m: FloatArray
    weight: FloatArray | None = None
    velocities: Velocities | None = None

    def __len__(self) -> int:
        return len(self.owner)

    def weights(self) -> FloatArray:
        """Give the evidence of each, (n,)."""
        return np.ones(len(self)) if self.weight is None else self.weight

    @classmethod
    def none(cls) -> Detections:
        """Make the empty set of detections."""
        rows, falses = np.zeros(0, np.intp), np.zeros(0, np.bool_)
        return cls(
            boxes=Boxes.none(),
            noise=np.zeros((0, 2, 2)),
            elongation=np.zeros(0),
            owner=rows,
            divided=falses,
            directed=falses,
            cut=np.zeros(0, np.int8),
            borders_m=np.zeros((0, 4)),
        )


@dataclass(frozen=True, slots=True)
class Expected:
    """Where objects must be at a frame.

    Attributes
    ----------
    known : boxes of confirmed tracks with their shadows; they divide blobs.
    bodies : gives the same without shadows; asked only where several share a blob.
    is_sized : which of the known ones have a size that can be relied on.
    tentative : boxes of unconfirmed tracks that move; they lend their direction to the blobs that they meet.
    is_driving : which of the known ones move faster than the heading needs.
    course_rad : (k,) where the k tentative ones move to.
    """

    known: Boxes
    bodies: Callable[[], Boxes]
    is_sized: BoolArray
    tentative: Boxes
    is_driving: BoolArray
    course_rad: FloatArray

    @classmethod
    def none(cls) -> Expected:
        """Expect nobody."""
        nobody, falses = Boxes.none(), np.zeros(0, np.bool_)
        return cls(nobody, Boxes.none, falses, nobody, falses, np.zeros(0))


class MotionDetector:
    """Finds what differs from the background: threshold, close, connect, divide by prediction, box."""

    def __init__(
        self, surface: Surface, background: Background, settings: VisionSettings, lanes: LaneField | None = None
    ) -> None:
        self._lanes = lanes
        self._surface = surface
        self._raster = surface.raster
        self._background = background
        self._settings = settings.detection
        self._shadows_every_us = settings.background.period_us
        self._kernel = np.ones((self._settings.close_cells,) * 2, np.uint8)
        self._shadows_us = 0

    def detect(self, image: RoadImage, expected: Expected) -> tuple[Detections, ByteArray]:
        """Find vehicles by their difference from the background.

        Parameters
        ----------
        image : the road's cells; the background must be ready.
        expected : where objects must be.

        Returns
        -------
        Boxes of at least `min_area_m2`, and (packed_size,) cells that differ, non-zero, which no background must learn.
        """
        packed = self._background.compare(image)
        difference = self._raster.unpack(packed)
        mask = cv2.threshold(difference, AT_THRESHOLD, 1, cv2.THRESH_BINARY)[1]
        closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, self._kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0)
        blobs = self._strong(find_blobs(self._raster, closed & self._raster.road.view(np.uint8), difference))
        foreground = np.asarray(packed > AT_THRESHOLD, np.uint8)
        return self._box(blobs, expected, image), foreground

    def _strong(self, blobs: Cells) -> Cells:
        """Drop blobs that differ a little everywhere and nowhere clearly: noise and compression."""
        if blobs.count == 0:
            return blobs
        return blobs.keep(
            np.maximum.reduceat(blobs.strength, blobs.starts) >= self._settings.strong_ratio * AT_THRESHOLD
        )

    def _box(self, blobs: Cells, expected: Expected, image: RoadImage) -> Detections:
        side, known = self._raster.grid.side, len(expected.known)
        seen = self._surface.appearances(expected.known)

        def bodies() -> Boxes:
            return self._surface.appearances(expected.bodies()).boxes

        ownership = assign_cells(blobs, seen, bodies, expected.is_sized, side=side, settings=self._settings)
        # Owned cells are grouped by owner; of each blob, what is left over and what was never owned stay together.
        others = known + 2 * blobs.group + ownership.is_rest
        cells = blobs.regroup(np.where(ownership.owner >= 0, ownership.owner, others))
        cells = self._part_by_lanes(cells, ownership.is_divided | self._is_one(expected), image, seen.boxes)
        cells = cells.keep(self._surface.areas_m2(cells) >= self._least_m2(cells, known))
        owner = np.where(cells.key < known, cells.key, -1)
        is_owned = owner >= 0
        heading, elongation = np.append(expected.known.heading_rad, 0.0)[owner], np.full(len(owner), np.inf)
        if not is_owned.all():
            heading[~is_owned], elongation[~is_owned] = self._headings(cells.keep(~is_owned))
        lent, lender = _lend(cells, self._surface.appearances(expected.tentative), self._settings.lend_reach_m)
        heading[lent & ~is_owned] = expected.tentative.heading_rad[lender[lent & ~is_owned]]
        sharp = _without_halo(cells, self._settings)
        footprints = self._surface.footprints(sharp, heading, self._shaded(sharp, image))
        return Detections(
            boxes=footprints.boxes,
            noise=footprints.noise,
            elongation=elongation,
            owner=owner,
            divided=np.append(ownership.is_divided, False)[owner],
            directed=is_owned | lent,
            cut=footprints.cut,
            borders_m=footprints.borders_m,
            weight=self._weight(footprints.weight, cells, is_owned, np.where(lent, lender, -1), expected),
        )

    def _least_m2(self, cells: Cells, known: int) -> FloatArray:
        """Say how large groups must be, (n,); seen from low above the road a known vehicle may be half hidden."""
        is_half_enough = (cells.key < known) & (not self._raster.grid.is_north_up)
        share = np.where(is_half_enough, self._settings.half_hidden_share, 1.0)
        return np.asarray(share * self._settings.min_area_m2)

    def _weight(
        self, weight: FloatArray | None, cells: Cells, is_owned: BoolArray, lender: IntArray, expected: Expected
    ) -> FloatArray | None:
        """Take the evidence from whoever walks; `lender` is the tentative track of each group, -1 for none."""
        if self._lanes is None:
            return weight
        course_rad = np.append(expected.course_rad, 0.0)[lender]
        is_walker = self._lanes.walkers(cells, course_rad, lender >= 0) & ~is_owned
        return np.where(is_walker, 0.0, 1.0 if weight is None else weight) if is_walker.any() else weight

    def _is_one(self, expected: Expected) -> BoolArray:
        """Tell which known objects are one vehicle: two that drive were seen apart, two that stand are too wide."""
        return expected.is_driving | (expected.is_sized & (expected.known.width_m < self._settings.two_vehicles_m))

    def _part_by_lanes(self, cells: Cells, is_whole: BoolArray, image: RoadImage, seen: Boxes) -> Cells:
        """Part groups that fill several lanes; the owner of such a group, if there is one, keeps a part.

        Parameters
        ----------
        cells : grouped by owner; keys from `len(is_whole)` on mean none.
        is_whole : (n,) owners whose groups are not parted: they share a blob already, or are one vehicle.
        seen : n boxes on the plane, where the owners must be; the part nearest to its box is kept.
        """
        known = len(is_whole)
        is_group_whole = np.append(is_whole, False)[np.minimum(cells.key, known)]
        if self._lanes is None or is_group_whole.all():
            return cells
        part = self._lanes.parts(cells, lambda points: self._background.shaded(image, points), is_group_whole)
        if not part.any():
            return cells
        parts = int(part.max()) + 1
        key = cells.key[cells.group]
        loose = int(cells.key.max()) + 1 + cells.group * parts + part
        is_kept = (part == 0) | ((key < known) & (part == _nearest_part(cells, part, seen)[cells.group]))
        return cells.regroup(np.where(part < 0, -1, np.where(is_kept, key, loose)))

    def _headings(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Guess directions of groups without a track: along the lane, or else along the group."""
        heading, elongation = self._surface.headings(cells)
        if self._lanes is None:
            return heading, elongation
        along, is_known = self._lanes.headings(cells)
        clear = np.where(is_known, np.maximum(elongation, self._settings.lane_elongation), elongation)
        return np.where(is_known, along, heading), clear

    def _shaded(self, cells: Cells, image: RoadImage) -> BoolArray | None:
        """Find cells like road in shadow; only now and then, since shadows change slowly."""
        if image.t_us - self._shadows_us < self._shadows_every_us:
            return None
        self._shadows_us = image.t_us
        return self._background.shaded(image, cells.points) > 0


def _nearest_part(cells: Cells, part: IntArray, seen: Boxes) -> IntArray:
    """Find the part of each owned group whose middle lies nearest to where its owner must be; 0 without an owner."""
    nearest = np.zeros(cells.count, np.intp)
    for group in np.flatnonzero(cells.key < len(seen)):
        rows = slice(cells.starts[group], cells.starts[group] + cells.sizes[group])
        numbers = np.unique(part[rows][part[rows] >= 0])
        middles = np.array([cells.points[rows][part[rows] == number].mean(axis=0) for number in numbers])
        nearest[group] = numbers[np.argmin(np.hypot(*(middles - seen.centre_m[cells.key[group]]).T))]
    return nearest


def _without_halo(cells: Cells, settings: DetectionSettings) -> Cells:
    """Drop cells much fainter than their group: blur and compression put a halo around strong contrasts."""
    if cells.count == 0:
        return cells
    strength = cells.strength.astype(np.float64)
    mean = np.add.reduceat(strength, cells.starts) / cells.sizes
    least = np.clip(settings.halo_share * mean, AT_THRESHOLD, settings.halo_most * AT_THRESHOLD)
    least = np.minimum(least, np.maximum.reduceat(strength, cells.starts))
    return cells.regroup(np.where(strength >= least[cells.group], cells.group, -1))


def _lend(cells: Cells, tentative: Appearances, reach_m: float) -> tuple[BoolArray, IntArray]:
    """Find a tentative track for each group whose middle lies in its box: whether there is one, and its row."""
    if len(tentative.boxes) == 0 or cells.count == 0:
        return np.zeros(cells.count, np.bool_), np.zeros(cells.count, np.intp)
    middle = np.add.reduceat(cells.points, cells.starts, axis=0) / cells.sizes[:, None]
    distance_m = distance_to_boxes(middle, tentative.boxes) * tentative.metres_per_unit
    return distance_m.min(axis=1) <= reach_m, np.argmin(distance_m, axis=1)
