"""How is a road seen from above looked at? As a map: the cells of detection are squares of ground, north up."""

from collections.abc import Sequence

import cv2
import numpy as np
import shapely

from vision.detection.blobs import Cells, measure, principal_heading
from vision.detection.parting.lanes import LaneField, LaneStrip, upright
from vision.detection.shadow import measure_shadows
from vision.detection.surfaces.surface import Appearances, Footprints, edge_of
from vision.errors import VisionError
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes
from vision.road.cover import cover
from vision.road.grid import Grid
from vision.road.parallax import Parallax
from vision.road.rectify import RoadCells, RoadRaster
from vision.road.view import GroundView
from vision.settings import VisionSettings

# Positions per polygon at which the camera's scale is looked up.
BORDER_SAMPLES = 400


class MapSurface:
    """The ground as the plane of detection, whatever camera looks at it; see `surface.Surface`.

    Parameters
    ----------
    raster : cells of ground, north up.
    parallax : of the camera.
    settings : noise, blur, shadows.
    """

    def __init__(self, raster: RoadCells, parallax: Parallax, settings: VisionSettings) -> None:
        self.raster = raster
        self._parallax = parallax
        self._settings = settings
        self._noise = settings.detection.position_noise_m**2 * np.eye(2)

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view.

        Parameters
        ----------
        points_m : (n, 2).

        Returns
        -------
        (n,).
        """
        return self.raster.grid.look_up(self.raster.ground, points_m)

    def appearances(self, footprints: Boxes) -> Appearances:
        """Predict what is seen of boxes on the ground.

        Parameters
        ----------
        footprints : n boxes.

        Returns
        -------
        The same boxes, with the smear of their height if the camera looks slantwise.
        """
        return Appearances(self._parallax.appearances(footprints), np.ones(len(footprints)))

    def areas_m2(self, cells: Cells) -> FloatArray:
        """Measure groups of cells.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) square metres of ground.
        """
        return np.asarray(cells.sizes * self.raster.grid.side**2)

    def headings(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Guess directions of groups without a track: their long axes.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) direction, front or rear unknown, and (n,) elongation.
        """
        return principal_heading(cells)

    def footprints(self, cells: Cells, heading_rad: FloatArray, is_shaded: BoolArray | None) -> Footprints:
        """Box groups of cells.

        Parameters
        ----------
        cells : n groups.
        heading_rad : (n,) direction of each box's length.
        is_shaded : (p,) cells that look like road in shadow, None to leave shadows out this time.

        Returns
        -------
        Boxes on the ground.
        """
        side = self.raster.grid.side
        boxes, cut = measure(cells, heading_rad, side, self._settings.detection)
        borders_m = np.full((cells.count, 4), np.nan)
        if is_shaded is not None:
            borders_m = measure_shadows(cells, is_shaded, boxes, side, self._settings.detection)
        return Footprints(
            boxes=self._parallax.footprints(boxes),
            noise=np.broadcast_to(self._noise, (cells.count, 2, 2)),
            cut=cut,
            borders_m=borders_m,
        )


class GroundSurface(MapSurface):
    """The ground that a fixed camera sees, as the plane of detection.

    Parameters
    ----------
    view : which ground the camera sees.
    polygons_m : outlines of the road.
    image_size_px : (width, height).
    settings : cell size, margins, noise.

    Raises
    ------
    VisionError
        If no road is in view.
    """

    raster: RoadRaster

    @property
    def metres_per_cell(self) -> float:
        """Side of a cell."""
        return self.raster.grid.side

    def __init__(
        self,
        view: GroundView,
        polygons_m: Sequence[FloatArray],
        *,
        image_size_px: tuple[int, int],
        settings: VisionSettings,
    ) -> None:
        parallax = Parallax(view, settings)
        reach_m = parallax.reach_m()
        around_m = float(np.hypot(*reach_m.T).max())
        low_m, high_m = _road_in_view(view, polygons_m, margin_m=settings.road_margin_m + around_m)
        grid = Grid.between(low_m, high_m, side=cell_size(view, polygons_m, settings), is_north_up=True)
        ground = painted_road(grid, polygons_m, margin_m=settings.road_margin_m)
        road = _leant_over(ground, reach_m / grid.side)
        in_view = np.zeros(grid.shape, np.bool_)
        for area in cover(road):
            in_view[area.slices] = view.sees(grid.centres(area))
        edge = edge_of(road & in_view, road & ~in_view, settings.road.edge_cells, is_bounded=False)
        raster = RoadRaster(
            grid,
            road=road & in_view,
            view_edge=edge,
            to_pixels=view.to_pixels,
            image_size_px=image_size_px,
            ground=ground & in_view,
        )
        super().__init__(raster, parallax, settings)

    def lane_field(self, lanes: Sequence[LaneStrip]) -> LaneField:
        """Lay lanes on the map."""
        lean = upright if self._parallax.is_steep else self._parallax.lean
        return LaneField(self.raster.grid, lanes, self._settings.detection, lean)


def _leant_over(ground: BoolArray, reach_cells: FloatArray) -> BoolArray:
    """Mark the ground and what may be seen of vehicles beyond it: `reach_cells` (k, 2) east and north, about."""
    most = int(np.ceil(np.abs(reach_cells).max()))
    disc = np.zeros((2 * most + 1,) * 2, np.uint8)
    # Rows go south. A kernel of `dilate` says from where a cell is reached, which is the other way.
    tips = np.concatenate([[[0.0, 0.0]], reach_cells]) * [-1.0, 1.0] + most
    cv2.fillConvexPoly(disc, cv2.convexHull(np.rint(tips).astype(np.int32)), (1,))
    return np.asarray(cv2.dilate(ground.astype(np.uint8), disc) > 0)


def _road_in_view(
    view: GroundView, polygons_m: Sequence[FloatArray], *, margin_m: float
) -> tuple[FloatArray, FloatArray]:
    """Bound the ground to rasterise: a little more than what is seen, so that the edge of the view lies inside."""
    corners = np.concatenate(list(polygons_m))
    seen_low, seen_high = view.extent()
    low = np.maximum(seen_low - 2 * margin_m - 1.0, corners.min(axis=0) - margin_m)
    high = np.minimum(seen_high + 2 * margin_m + 1.0, corners.max(axis=0) + margin_m)
    if np.any(high <= low):
        raise VisionError(
            f"road raster: expected road within the view, {seen_low.tolist()!r} to {seen_high.tolist()!r} m, "
            f"got road at {corners.min(axis=0).tolist()!r} to {corners.max(axis=0).tolist()!r} m"
        )
    return low, high


def painted_road(grid: Grid, polygons_m: Sequence[FloatArray], *, margin_m: float) -> BoolArray:
    """Mark the cells of the road and of a margin around it.

    Parameters
    ----------
    grid : of ground.
    polygons_m : outlines of the road.
    margin_m : around them.

    Returns
    -------
    (rows, columns).
    """
    reach = 2 * round(margin_m / grid.side) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    return np.asarray(cv2.dilate(grid.paint(polygons_m), disc) > 0)


def cell_size(view: GroundView, polygons_m: Sequence[FloatArray], settings: VisionSettings) -> float:
    """Choose the coarsest cell that keeps a car wide enough, and none finer than the camera gives on the road.

    Parameters
    ----------
    view : of the camera.
    polygons_m : outlines of the road.
    settings : width of a car, in metres and in cells.

    Returns
    -------
    Metres.
    """
    wanted_m = settings.car_width_m / settings.car_width_cells
    places = np.linspace(0.0, 1.0, BORDER_SAMPLES)
    rings = [shapely.LinearRing(polygon) for polygon in polygons_m]
    along = [shapely.line_interpolate_point(ring, places, normalized=True) for ring in rings]
    borders = shapely.get_coordinates(np.concatenate(along))
    borders = borders[view.sees(borders)]
    # Road that fills the view has no border in it.
    scales = view.metres_per_pixel(borders if len(borders) > 0 else view.seen_ground())
    return float(max(wanted_m, np.percentile(scales, 10)))
