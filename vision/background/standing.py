"""Which part of the first background is a vehicle that stood there all the time? And what is the road under it?

What never moved while frames were held cannot be told from the road by time. But around it the road was never calm,
it is as large as a vehicle, and nobody drove over it: cells whose value was covered and came back belong to the ground,
be it a marking, a patch or a crossing.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.background.settings import BackgroundSettings
from vision.background.startup import LEVEL, FirstSight, came_back
from vision.objects import BoolArray
from vision.road.road_colour import RoadColour
from vision.video.frames import ByteArray

FloatArray = NDArray[np.float32]


class StandingVehicles:
    """Finds vehicles in a first background, and the road under them.

    Parameters
    ----------
    colour : of the road.
    settings : of this room.
    margin_cells : how far the watched cells reach beyond the road; there, other colours are usual.
    borders : (rows, columns) cells on the borders of lanes, where there are lines and kerbs; None if not known.
    """

    def __init__(
        self,
        colour: RoadColour,
        settings: BackgroundSettings,
        *,
        margin_cells: int,
        borders: BoolArray | None = None,
    ) -> None:
        self._cells = cells = colour.cells
        self._colour = colour
        self._settings = settings
        self._car_cells = colour.car_cells
        self._inner = _shrunk(cells.ground.astype(np.uint8), margin_cells)
        self._borders = np.zeros(cells.grid.shape, np.bool_) if borders is None else borders
        # Places end before the sides of the road, `beyond` from them; where the view ends is no side.
        self._beyond = round(settings.beyond_widths * self._car_cells)
        view_edge = cv2.dilate(cells.view_edge.astype(np.uint8), _square(2 * (margin_cells + self._beyond) + 3))
        self._sides = self._inner & ~_shrunk(self._inner, self._beyond + 1) & ~np.asarray(view_edge, np.uint8)

    def find(self, sight: FirstSight) -> BoolArray:
        """Find what looks like vehicles that never moved.

        Parameters
        ----------
        sight : the first background.

        Returns
        -------
        (packed_size,) True on what is strange of them and their shadows; markings beside them are left out.
        """
        settings = self._settings
        restless = self._spread(sight.unrest > LEVEL * settings.unrest_levels) * self._inner
        places = _shrunk(restless, self._beyond)
        if not places.any():
            return np.zeros(self._cells.packed_size, np.bool_)
        difference = sight.planes - self._colour.around(sight.planes)
        is_strange = np.abs(difference).max(axis=0) > settings.strange_levels
        is_dark = is_strange & (difference[0] <= settings.strange_levels)
        is_ground = is_strange & came_back(sight.samples, sight.planes, settings.same_levels)
        count, labels = cv2.connectedComponents(places, connectivity=8)
        area, strange_area, dark_area, ground_area = (
            np.bincount(labels.ravel(), cells.ravel(), count)
            for cells in (places, *(self._spread(one) for one in (is_strange, is_dark, is_ground)))
        )
        width2 = self._car_cells**2
        is_vehicle = (
            (strange_area >= settings.least_widths2 * width2)
            & (dark_area >= settings.least_dark_widths2 * width2)
            & (strange_area >= settings.strange_share * area)
            & (area <= settings.most_widths2 * width2)
            & (ground_area < settings.ground_share * strange_area)
        )
        is_vehicle[0] = False
        leaves = self._spread(is_dark & (np.abs(difference[1:]).max(axis=0) > settings.shade_chroma_levels))
        for number in np.flatnonzero(is_vehicle).tolist():
            place = (labels == number).astype(np.uint8)
            is_vehicle[number] = not (self._spans_road(place) or self._hangs_in(place, leaves))
        cells = is_vehicle.astype(np.uint8)[labels] * self._but_markings(is_strange, is_strange & ~is_dark)
        return self._cells.pack(cells) > 0

    def _spans_road(self, place: ByteArray) -> bool:
        """Tell whether something reaches from one side of a road to the other: a bridge or a gantry does."""
        reach = round(self._settings.around_widths * self._car_cells)
        left, top, width, height = cv2.boundingRect(place)
        rows = slice(max(0, top - reach), top + height + reach)
        columns = slice(max(0, left - reach), left + width + reach)
        around = self._inner[rows, columns]
        side = _square(2 * round(self._settings.side_widths * self._car_cells) + 1)
        free = around & (np.asarray(cv2.dilate(place[rows, columns], side)) == 0)
        return bool(cv2.connectedComponents(free.astype(np.uint8))[0] > cv2.connectedComponents(around)[0])

    def _hangs_in(self, place: ByteArray, leaves: ByteArray) -> bool:
        """Tell whether most of the road's side along a place is covered, not just shaded: vehicles keep clear of it."""
        beside = self._sides & np.asarray(cv2.dilate(place, _square(2 * self._beyond + 3)))
        return 2 * int((beside & leaves).sum()) > int(beside.sum())

    def _but_markings(self, is_strange: BoolArray, is_bright: BoolArray) -> ByteArray:
        """Outline what is strange, and leave out what is bright and thin or a border: (rows, columns) 1 or 0."""
        bright = self._spread(is_bright)
        wide = cv2.morphologyEx(bright, cv2.MORPH_OPEN, _square(round(self._car_cells / 2)))
        is_thin = (bright > 0) & ((np.asarray(cv2.dilate(wide, _square(3))) == 0) | self._borders)
        body = self._spread(is_strange) * ~is_thin
        return np.asarray(cv2.dilate(body, _square(3)) * ~is_thin, np.uint8)

    def _spread(self, packed: BoolArray) -> ByteArray:
        return self._cells.unpack(packed.astype(np.uint8))


def _shrunk(mask: ByteArray, cells: int) -> ByteArray:
    shrunk = cv2.erode(mask, _square(2 * cells + 1), borderType=cv2.BORDER_CONSTANT, borderValue=(0,))
    return np.asarray(shrunk, np.uint8)


def _square(side: int) -> ByteArray:
    return np.ones((side, side), np.uint8)
