"""How is a road seen from low above it looked at? In the image: only the foot of what moves is put on the ground.

A camera on a bridge sees the rear of a car and little of the road under it. Blobs are compact in the image, so they
are found and divided there; the lowest row of a blob is where the vehicle meets the road on the side of the camera.
Length cannot be seen this way: what is seen of width and height tells the kind, and a usual one of it is assumed.
Upright things must be upright in the image.
"""

from collections.abc import Sequence

import numpy as np
import shapely

from vision.detection.blobs import Cells, measure
from vision.detection.parting.image_lanes import ImageLanes, find_feet
from vision.detection.parting.lanes import LaneStrip
from vision.detection.surfaces.surface import Appearances, Footprints, edge_of, road_area
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import Boxes
from vision.road.cover import Rectangle
from vision.road.grid import Grid
from vision.road.kinds import TRUCK, VAN, Kind, heights_m
from vision.road.rectify import RoadRaster
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.tracking import kalman

# The scale of the road is first looked up on a grid this coarse.
COARSE_PX = 8.0
# No vehicle is higher: the law of most countries of Europe.
HIGHEST_M = 4.0


class ImageSurface:
    """The image as the plane of detection; see `surface.Surface`. Boxes on the plane are upright.

    Parameters
    ----------
    view : of the camera.
    polygons_m : outlines of the road.
    image_size_px : (width, height).
    settings : cell size, the usual car, noise.

    Attributes
    ----------
    metres_per_cell : of half of the road, or finer.

    Raises
    ------
    VisionError
        If no road is in view.
    """

    def __init__(
        self,
        view: GroundView,
        polygons_m: Sequence[FloatArray],
        *,
        image_size_px: tuple[int, int],
        settings: VisionSettings,
    ) -> None:
        self._view, self._usual, self._settings = view, settings, settings.detection
        coarse = _Watched(_grid(image_size_px, COARSE_PX), view, polygons_m, settings)
        side = max(1.0, np.floor(settings.car_width_m / self._settings.image_car_cells / coarse.typical_scale()))
        grid = _grid(image_size_px, side)
        watched = _Watched(grid, view, polygons_m, settings)
        self.metres_per_cell = side * watched.median_scale()
        self.raster = RoadRaster(
            grid,
            road=watched.road,
            view_edge=watched.view_edge(settings.road.edge_cells),
            to_pixels=lambda points: points,
            image_size_px=image_size_px,
            ground=watched.ground,
        )

    def lane_field(self, lanes: Sequence[LaneStrip]) -> ImageLanes:
        """Lay lanes into the image.

        Parameters
        ----------
        lanes : on the ground.

        Returns
        -------
        The lanes on this surface's raster.
        """
        return ImageLanes(self.raster.grid, lanes, self._view, self._usual)

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view.

        Parameters
        ----------
        points_m : (n, 2).

        Returns
        -------
        (n,).
        """
        return self.raster.grid.look_up(self.raster.ground, self._view.to_pixels(points_m))

    def appearances(self, footprints: Boxes) -> Appearances:
        """Predict what is seen of boxes on the ground: upright image boxes around vehicles as high as such are.

        Parameters
        ----------
        footprints : n boxes.

        Returns
        -------
        Boxes in pixels.
        """
        corners = self._view.corners_px(footprints, heights_m(footprints.length_m))
        first, last = corners.min(axis=1), corners.max(axis=1)
        width, height = (last - first).T
        scale = self._view.sight(footprints.centre_m).across_m
        return Appearances(Boxes((first + last) / 2, np.zeros(len(footprints)), width, height), scale)

    def areas_m2(self, cells: Cells) -> FloatArray:
        """Measure groups of cells.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) square metres of vehicle side.
        """
        scale = self._view.sight(self._view.to_ground(self._lowest(cells))[0]).across_m
        return np.asarray(cells.sizes * (self.raster.grid.side * scale) ** 2)

    def headings(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Guess directions of groups without a track: nothing in the image tells.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) away from the camera, and (n,) ones.
        """
        away = self._view.sight(self._view.to_ground(self._lowest(cells))[0]).away
        return np.arctan2(away[:, 1], away[:, 0]), np.ones(cells.count)

    def footprints(self, cells: Cells, heading_rad: FloatArray, is_shaded: BoolArray | None) -> Footprints:
        """Put usual vehicles on the ground behind the feet of groups of cells.

        Parameters
        ----------
        cells : n groups.
        heading_rad : (n,) direction of the vehicles.
        is_shaded : not used: the shadow at the foot is as good as the foot.

        Returns
        -------
        Boxes on the ground.
        """
        del is_shaded
        feet_m, is_touching, is_covered = self._feet(cells)
        sight = self._view.sight(feet_m)
        bearing = np.arctan2(sight.away[:, 1], sight.away[:, 0])
        boxes = self._usual_bodies(cells, feet_m, sight.away, heading_rad)
        length_m, width_m = boxes.length_m, boxes.width_m
        blur, least_m = self._settings.foot_noise_cells * self.raster.grid.side, self._settings.position_noise_m
        # Where the border hides the foot, the lowest row is another part of the vehicle in every frame: as it comes
        # into view the row wanders towards the camera, and a track that believed in it would shoot ahead.
        along_m = np.maximum(
            blur * sight.along_m, np.where(is_touching, self._settings.hidden_foot_lengths * length_m, least_m)
        )
        along_m = np.where(is_covered, self._settings.covered_foot_lengths * length_m, along_m)
        is_touching |= is_covered
        across_m = np.maximum(blur * sight.across_m, np.where(is_touching, width_m, least_m))
        noise = kalman.oriented_covariance(bearing, along_m, across_m)
        return Footprints(
            boxes=boxes,
            noise=noise,
            cut=is_touching.astype(np.int8),
            borders_m=np.full((cells.count, 4), np.nan),
            # Nobody is shown before its foot was seen; a track may begin all the same.
            weight=np.where(is_touching, 0.0, 1.0),
        )

    def _usual_bodies(self, cells: Cells, feet_m: FloatArray, away: FloatArray, heading_rad: FloatArray) -> Boxes:
        """Put on each foot the largest of car, van and truck that what is seen has room for.

        What is too small for a kind is none; what is larger than it may be two vehicles.
        """
        seen = self._boxes(cells)
        top_px = seen.centre_m[:, 1] - seen.width_m / 2
        seen_px = np.column_stack([seen.length_m, self._view.to_pixels(feet_m)[:, 1] - top_px])
        least = 1 - self._settings.kind_slack
        usual = self._usual
        car = Kind(usual.usual_length_m, 0.0, usual.usual_width_m, usual.usual_height_m)
        bodies = _behind(feet_m, away, heading_rad, car)
        for kind in (VAN, TRUCK):
            larger = _behind(feet_m, away, heading_rad, kind)
            extent_px = np.ptp(self._view.corners_px(larger, np.full(cells.count, kind.height_m)), axis=1)
            has_room = (least * extent_px <= seen_px).all(axis=1)
            bodies = Boxes.joined([bodies, larger]).select(np.arange(cells.count) + cells.count * has_room)
        return bodies

    def _feet(self, cells: Cells) -> tuple[FloatArray, BoolArray, BoolArray]:
        """Find where groups meet the ground, of which the view edge may hide the foot, and of which others hide it."""
        lowest = self._lowest(cells)
        seen = find_feet(cells, self.raster.grid, self._settings.below_cells)
        seen = seen.select(~seen.is_hidden)
        scale = self._view.sight(self._view.to_ground(lowest)[0]).across_m
        count = np.bincount(seen.group, minlength=cells.count)
        # From the lowest foot upwards, but no farther than to the middle one.
        skipped = np.rint(self._settings.foot_width_m / scale / self.raster.grid.side).astype(np.intp) - 1
        order = np.lexsort((-seen.points[:, 1], seen.group))
        chosen = np.cumsum(count) - count + np.clip(skipped, 0, np.maximum(count - 1, 0) // 2)
        is_seen = count > 0
        lowest[is_seen, 1] = seen.points[order[chosen[is_seen]], 1] + self.raster.grid.side / 2
        # A roof cut off above leaves the foot where it is.
        is_low = cells.points[:, 1] >= self._boxes(cells).centre_m[cells.group, 1]
        is_touching = np.zeros(cells.count, np.bool_)
        is_touching[cells.group[cells.at_edge & is_low]] = True
        return self._view.to_ground(lowest)[0], is_touching, ~is_seen

    def _lowest(self, cells: Cells) -> FloatArray:
        """Find the middle of the lower border of each group: (n, 2) pixels."""
        boxes = self._boxes(cells)
        return boxes.centre_m + np.stack([np.zeros(cells.count), boxes.width_m / 2], axis=-1)

    def _boxes(self, cells: Cells) -> Boxes:
        return measure(cells, np.zeros(cells.count), self.raster.grid.side, self._settings)[0]


def road_part(
    view: GroundView,
    polygons_m: Sequence[FloatArray],
    image_size_px: tuple[int, int],
    settings: VisionSettings,
    *,
    narrower_px: float = np.inf,
) -> tuple[int, int, int, int] | None:
    """Bound the part of the picture in which vehicles on a road are seen, those too far to tell their feet apart too.

    Parameters
    ----------
    view, polygons_m, image_size_px, settings : as of `ImageSurface`.
    narrower_px : only where a usual car is so narrow.

    Returns
    -------
    Left, top, width and height in pixels; None if no such road is in view.
    """
    finest_m = settings.car_width_m / narrower_px
    coarse = _Watched(_grid(image_size_px, COARSE_PX), view, polygons_m, settings, by_feet=False, finest_m=finest_m)
    rows, columns = np.flatnonzero(coarse.road.any(axis=1)), np.flatnonzero(coarse.road.any(axis=0))
    if len(rows) == 0:
        return None
    left, top = (int(COARSE_PX) * int(cells[0]) for cells in (columns, rows))
    right, bottom = (
        min(int(COARSE_PX) * (int(cells[-1]) + 1), size)
        for cells, size in zip((columns, rows), image_size_px, strict=True)
    )
    return left, top, right - left, bottom - top


def _behind(feet_m: FloatArray, away: FloatArray, heading_rad: FloatArray, kind: Kind) -> Boxes:
    """Stand bodies of one kind behind feet, (n, 2); `away` (n, 2) from the camera."""
    turn = heading_rad - np.arctan2(away[:, 1], away[:, 0])
    depth_m = np.abs(kind.length_m * np.cos(turn)) + np.abs(kind.width_m * np.sin(turn))
    sizes_m = (np.full(len(turn), size_m) for size_m in (kind.length_m, kind.width_m))
    return Boxes(feet_m + away * depth_m[:, None] / 2, heading_rad, *sizes_m)


def _grid(image_size_px: tuple[int, int], side: float) -> Grid:
    return Grid.between(np.full(2, -0.5), np.array(image_size_px) - 0.5, side=side, is_north_up=False)


class _Watched:
    """Which cells of an image grid show road, or vehicles on it; if not `by_feet`, high and far ones as well.

    Road that is seen finer than `finest_m`, in metres a pixel, is left out.
    """

    def __init__(
        self,
        grid: Grid,
        view: GroundView,
        polygons_m: Sequence[FloatArray],
        settings: VisionSettings,
        *,
        by_feet: bool = True,
        finest_m: float = 0.0,
    ) -> None:
        pixels = grid.centres(Rectangle(0, grid.shape[0], 0, grid.shape[1]))
        ground_m, is_below = view.to_ground(pixels)
        area = road_area(polygons_m)
        shapely.prepare(area)
        on_road = is_below & shapely.contains_xy(area, ground_m[..., 0], ground_m[..., 1])
        self._scale, along_m = np.full((2, *grid.shape), np.inf)
        sight = view.sight(ground_m[on_road])
        self._scale[on_road], along_m[on_road] = sight.across_m, sight.along_m
        is_fine = (self._scale >= finest_m) & (self._scale <= settings.car_width_m / settings.detection.least_car_px)
        if by_feet:
            # Farther away one says less of a place than the length of a car: nobody could tell who is ahead of whom.
            is_fine &= settings.detection.foot_noise_cells * along_m <= settings.usual_length_m
        self.ground = on_road & is_fine
        self._too_far = on_road & ~is_fine
        self.road = self.ground.copy()
        height_m = settings.detection.watched_height_m if by_feet else HIGHEST_M
        rows = np.where(self.ground, height_m / self._scale / grid.side, 0.0)
        for up in range(1, min(int(rows.max(initial=0.0)) + 1, grid.shape[0])):
            self.road[:-up] |= rows[up:] >= up

    def typical_scale(self) -> float:
        """Metres per pixel that nine tenths of the road are seen with, or finer."""
        return float(np.percentile(self._scale[self.ground], 90)) if self.ground.any() else np.inf

    def median_scale(self) -> float:
        """Metres per pixel that half of the road is seen with, or finer."""
        return float(np.median(self._scale[self.ground])) if self.ground.any() else np.inf

    def view_edge(self, width_cells: int) -> BoolArray:
        """Cells next to the border of the image, or to road too far away."""
        return edge_of(self.road, self._too_far & ~self.road, width_cells, is_bounded=True)
