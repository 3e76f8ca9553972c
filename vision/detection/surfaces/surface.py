"""On which plane are vehicles looked for? What detection needs to know of a road seen by one camera.

Seen from above, the ground itself is the plane: vehicles are as long there as they are. Seen along the road from low
above it, a car's height would smear it over many car lengths of ground; then the image is the better plane, and only
the foot of what moves is put on the ground. Both answer the same questions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from vision.detection.blobs import Cells
from vision.detection.parting.lanes import LaneField, LaneStrip
from vision.errors import VisionError
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes
from vision.road.rectify import RoadCells, RoadRaster


@dataclass(frozen=True, slots=True)
class Appearances:
    """What is seen of boxes on the ground, on the plane of a raster.

    Attributes
    ----------
    boxes : on the plane.
    metres_per_unit : (n,) what the plane's unit is worth at each of them.
    """

    boxes: Boxes
    metres_per_unit: FloatArray


@dataclass(frozen=True, slots=True)
class Footprints:
    """What groups of cells are on the ground.

    Attributes
    ----------
    boxes : on the ground.
    noise : (n, 2, 2) covariance of the centres.
    cut : (n,) +1 where the view edge cuts the front, -1 the rear, 0 where the box is whole.
    borders_m : (n, 4) dark borders in front, behind, left, right (`shadow.py`); nan where not measured.
    weight : (n,) how much evidence for a vehicle at this place each is, 0 to 1; None for 1 each.
    """

    boxes: Boxes
    noise: FloatArray
    cut: NDArray[np.int8]
    borders_m: FloatArray
    weight: FloatArray | None = None


class Surface(Protocol):
    """A plane on which blobs are found, with its relation to the ground."""

    @property
    def raster(self) -> RoadCells:
        """The cells on which blobs are found."""
        ...

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions, (n, 2), are road in view."""
        ...

    def appearances(self, footprints: Boxes) -> Appearances:
        """Predict what is seen of boxes on the ground."""
        ...

    def areas_m2(self, cells: Cells) -> FloatArray:
        """Measure the groups of cells, (n,), in square metres of ground or of vehicle side."""
        ...

    def headings(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Guess directions of groups without a track: (n,) on the ground, and (n,) elongation (1: no idea)."""
        ...

    def footprints(self, cells: Cells, heading_rad: FloatArray, is_shaded: BoolArray | None) -> Footprints:
        """Box groups of cells on the ground, in given directions; `is_shaded` (p,) marks cells like road in shadow."""
        ...


class FixedSurface(Surface, Protocol):
    """A surface whose cells stay where they are in the image."""

    @property
    def raster(self) -> RoadRaster:
        """The cells, with their places in the image."""
        ...

    @property
    def metres_per_cell(self) -> float:
        """What the side of a cell is on the ground, about."""
        ...

    def lane_field(self, lanes: Sequence[LaneStrip]) -> LaneField:
        """Lay lanes on the plane."""
        ...


def road_area(polygons_m: Sequence[FloatArray]) -> BaseGeometry:
    """Join road outlines, (k, 2) each, which may cross themselves, into one area."""
    return shapely.union_all([shapely.make_valid(shapely.Polygon(ring)) for ring in polygons_m])


def edge_of(road: BoolArray, unseen: BoolArray, width_cells: int, *, is_bounded: bool) -> BoolArray:
    """Find the road cells at the edge of the view.

    Parameters
    ----------
    road : (rows, columns) in view.
    unseen : (rows, columns) road out of view.
    width_cells : of the band that counts as the edge.
    is_bounded : whether nothing is seen beyond the grid either.

    Returns
    -------
    (rows, columns).
    """
    band = np.ones((2 * width_cells + 1,) * 2, np.uint8)
    beyond = (int(is_bounded),)
    near = cv2.dilate(unseen.view(np.uint8), band, borderType=cv2.BORDER_CONSTANT, borderValue=beyond)
    return np.asarray(road & (near > 0))


def checked_polygons(polygons_m: Sequence[FloatArray]) -> list[FloatArray]:
    """Check road outlines.

    Parameters
    ----------
    polygons_m : (k, 2) each.

    Returns
    -------
    The same as float arrays.

    Raises
    ------
    VisionError
        If there is none, or one is no polygon.
    """
    if len(polygons_m) == 0:
        raise VisionError("road: expected at least one polygon, got none")
    checked = [np.asarray(polygon, np.float64) for polygon in polygons_m]
    for polygon in checked:
        if polygon.ndim != 2 or polygon.shape[1] != 2 or len(polygon) < 3 or not np.all(np.isfinite(polygon)):
            raise VisionError(f"road polygon: expected (k >= 3, 2) finite metres, got {polygon!r}")
    return checked
