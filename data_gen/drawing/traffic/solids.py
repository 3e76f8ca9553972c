"""Where in the image are the faces of vehicles with a height, which are seen, and who stands before whom?

A vehicle's parts are laid out once as a mesh of faces, in the vehicle's own frame; for each frame all corners are
mapped at once.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from data_gen.drawing.ground.standing import Standing
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.vehicle_models import Part
from data_gen.drawing.view import CameraView, Rectangle, corners_m
from data_gen.simulation.states import BoolArray, ByteArray, FloatArray, IndexArray, IntArray, VehicleStates
from gis.cameras.camera import clip_ring

NEAREST_M = 0.5
"""Nothing closer before the camera is drawn."""
_HIGHEST_M = 4.0
"""No vehicle is higher."""
_SMALLEST_PX = 1.0
"""Faces smaller than this are left out, but for lamps."""
_FAR_PIXEL_M = 0.08
"""Where pixels are larger, one distance does for a whole vehicle."""
_TOUCHING_M = 0.3
"""What stands closer before a body does not hide it: distances are those of middles."""


class Mesh:
    """The faces of a vehicle, part by part: sides, top, panels.

    Parameters
    ----------
    parts : of the vehicle.
    is_round : light and sight follow the slope of each face; else tops always show, and light follows the direction of
        the foot alone, as from high above.
    """

    def __init__(self, parts: Sequence[Part], *, is_round: bool) -> None:
        self.parts = tuple(parts)
        self.is_round = is_round
        faces = [(number, *face) for number, part in enumerate(parts) for face in _faces_of(part)]
        outlines_m = [outline_m for _, outline_m, *_ in faces]
        self.corners_m = np.concatenate(outlines_m)
        """(c, 3), face by face."""
        self.ends = np.cumsum([0, *(len(outline_m) for outline_m in outlines_m)])
        self.colours = np.array([colour for _, _, colour, _ in faces], dtype=np.float64)
        self.is_panel = np.array([kind in ("panel", "lamp") for *_, kind in faces])
        self.is_lamp = np.array([kind == "lamp" for *_, kind in faces])
        self.is_top = np.array([kind == "top" for *_, kind in faces])
        self.extents_m = np.array([np.ptp(outline_m, axis=0).max() for outline_m in outlines_m])
        self.normals = (_normals if is_round else _foot_normals)(self.corners_m, self.ends)
        self.offsets = (self.normals * self.corners_m[self.ends[:-1]]).sum(axis=1)
        of_part = np.array([number for number, *_ in faces])
        self.faces_of_part = [np.flatnonzero(of_part == number) for number in range(len(parts))]
        low_m, high_m = self.corners_m[:, :2].min(axis=0), self.corners_m[:, :2].max(axis=0)
        self.under_m = np.array([low_m, (high_m[0], low_m[1]), high_m, (low_m[0], high_m[1])])
        """Ground under the vehicle, (4, 2)."""


def _faces_of(part: Part) -> Iterator[tuple[FloatArray, tuple[float, float, float], str]]:
    base_m, top_m = (
        np.column_stack((outline_m, np.full(len(outline_m), up_m)))
        for outline_m, up_m in ((part.base_m, part.base_height_m), (part.top_m, part.top_height_m))
    )
    if part.top_height_m > part.base_height_m:
        for corner in range(len(base_m)):
            after = (corner + 1) % len(base_m)
            yield np.array([base_m[corner], base_m[after], top_m[after], top_m[corner]]), part.side, "body"
    yield top_m, part.top, "top"
    for panel in part.panels:
        yield panel.outline_m, panel.colour, "lamp" if panel.is_lamp else "panel"


def _normals(corners_m: FloatArray, ends: IntArray) -> FloatArray:
    """Give the unit vectors out of convex faces of four corners and more: across their diagonals."""
    start, count = ends[:-1], np.diff(ends)
    first, second, third, fourth = (corners_m[start + place * count // 4] for place in range(4))
    total = np.cross(third - first, fourth - second)
    return np.asarray(total / np.maximum(1e-12, np.linalg.norm(total, axis=1))[:, None], dtype=np.float64)


def _foot_normals(corners_m: FloatArray, ends: IntArray) -> FloatArray:
    """Give vectors out of the sides of blocks by their feet alone: sides may be warped a little."""
    foot_m, after_m, head_m = (corners_m[ends[:-1] + place] for place in (0, 1, 3))
    along_m = after_m - foot_m
    outward = np.column_stack((along_m[:, 1], -along_m[:, 0]))
    lean = (foot_m - head_m)[:, :2] / np.maximum(1e-9, head_m[:, 2:] - foot_m[:, 2:])
    return np.column_stack((outward, (outward * lean).sum(axis=1)))


@dataclass(eq=False)
class Solid:
    """A vehicle in space, as the camera sees it."""

    row: int
    """Of the states."""
    mesh: Mesh
    heading_rad: float
    pixel_m: float
    """Size of a pixel across the line of sight, at the vehicle."""
    distance_m: float
    """From the camera's foot."""
    eye_m: FloatArray
    """(3,), the camera's place in the vehicle's frame."""
    to_image: FloatArray
    """(3, 4), homogeneous pixels from the vehicle's frame."""

    @cached_property
    def mapped(self) -> FloatArray:
        """Homogeneous pixels of all corners, (c, 3)."""
        return np.asarray(self.mesh.corners_m @ self.to_image[:, :3].T + self.to_image[:, 3], dtype=np.float64)

    @cached_property
    def is_ahead(self) -> bool:
        """Whether all of it lies before the camera."""
        return bool(self.mapped[:, 2].min() > NEAREST_M)

    @cached_property
    def corners_px(self) -> FloatArray:
        """Pixels of all corners, (c, 2); of use if all of them lie ahead."""
        return np.asarray(self.mapped[:, :2] / self.mapped[:, 2:], dtype=np.float64)

    def seen_faces(self, *, panels: bool = True) -> list[int]:
        """Give the faces that look at the camera, in the order of drawing."""
        mesh = self.mesh
        seen = mesh.normals @ self.eye_m > mesh.offsets
        if not mesh.is_round:
            seen |= mesh.is_top
        if mesh.is_round:
            seen &= mesh.is_lamp | (mesh.extents_m > _SMALLEST_PX * self.pixel_m)
        if not panels:
            seen &= ~mesh.is_panel
        order = sorted(range(len(mesh.parts)), key=self._order)
        return [int(face) for part in order for face in mesh.faces_of_part[part] if seen[face]]

    def _order(self, number: int) -> tuple[float, float]:
        """Lower levels first; of two blocks that stand side by side the one farther from the camera."""
        part = self.mesh.parts[number]
        return part.level, -math.hypot(part.block_x_m - self.eye_m[0], part.block_y_m - self.eye_m[1])

    def around_px(self) -> FloatArray:
        """Give points whose bounds are those of the body in the image, (n, 2), without what lies behind the camera."""
        if self.is_ahead:
            return self.corners_px
        faces = range(len(self.mesh.ends) - 1)
        return np.concatenate([clipped_px(self.mapped[self._corners(face)]) for face in faces])

    def fill(
        self, canvas: ByteArray, part: Rectangle, fineness: int, painted: Iterable[tuple[int, Sequence[float]]]
    ) -> None:
        """Draw faces over one another into a picture of a part of the image that is so many times finer.

        Parameters
        ----------
        canvas : (h, w) or (h, w, k), changed.
        part : of the image.
        fineness : pixels of the canvas a pixel of the image, each way.
        painted : faces in order, and the value of each.
        """
        if self.is_ahead:
            whole = finely_placed(self.corners_px, part, fineness)
            for face, value in painted:
                cv2.fillConvexPoly(canvas, whole[self._corners(face)], value, shift=4)
            return
        for face, value in painted:
            cut_px = clipped_px(self.mapped[self._corners(face)])
            cv2.fillConvexPoly(canvas, finely_placed(cut_px, part, fineness), value, shift=4)

    def _corners(self, face: int) -> slice:
        return slice(self.mesh.ends[face], self.mesh.ends[face + 1])

    def level_px(self, outline_m: FloatArray) -> FloatArray:
        """Map an outline on the ground, (n, 2) in the vehicle's frame, to pixels, without what lies behind."""
        return clipped_px(outline_m @ self.to_image[:, :2].T + self.to_image[:, 3])

    def colours(self, sun: Sun) -> FloatArray:
        """Give the colour of each face in the light, (f, 3)."""
        mesh = self.mesh
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        level = np.maximum(1e-9, np.hypot(mesh.normals[:, 0], mesh.normals[:, 1]))
        outward = mesh.normals[:, :2] / level[:, None] @ np.array([[cosine, sine], [-sine, cosine]])
        light = sun.wall_lights(outward)
        if mesh.is_round:
            up = np.clip(mesh.normals[:, 2], -0.6, 1)
            light = light + up * (1 - light)
        light[mesh.is_lamp | mesh.is_top] = 1.0
        return np.asarray(mesh.colours * light[:, None], dtype=np.float64)


def finely_placed(points_px: FloatArray, part: Rectangle, fineness: int) -> IndexArray:
    """Map pixels of the image to sixteenths of those of a finer picture of a part of it."""
    fine_px = (points_px - (part.left, part.top) + 0.5) * fineness - 0.5
    return np.round(fine_px * 16).astype(np.int32)


def clipped_px(mapped: FloatArray) -> FloatArray:
    """Cut an outline, (n, 3) homogeneous pixels, at the nearest distance, and map it: (k, 2), k may be 0."""
    ahead = mapped[:, 2] - NEAREST_M
    cut = mapped if ahead.min() >= 0 else clip_ring(mapped, ahead)
    return np.asarray(cut[:, :2] / cut[:, 2:], dtype=np.float64)


def place_solid(
    mesh: Mesh, row: int, states: VehicleStates, view: CameraView, *, pixel_m: float | None = None
) -> Solid:
    """Put a vehicle where it is.

    Parameters
    ----------
    mesh : of the vehicle.
    row : of the vehicle in the states.
    states : all vehicles.
    view : the camera; it has a pose.
    pixel_m : size of a pixel of the ground there; that across the line of sight if it is left out.
    """
    assert view.pose is not None
    heading_rad = float(states.heading_rad[row])
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    centre_m = np.array([*states.centre_m[row], 0.0])
    space = view.pose.projection(*view.size_px)
    eye_m = turn @ (view.pose.place_m - centre_m)
    to_image = np.column_stack((space[:, :3] @ turn.T, space[:, :3] @ centre_m + space[:, 3]))
    if pixel_m is None:
        pixel_m = max(NEAREST_M, float(to_image[2, 3])) / view.pose.focal_px
    distance_m = float(np.hypot(*(states.centre_m[row] - view.pose.place_m[:2])))
    return Solid(row, mesh, heading_rad, pixel_m, distance_m, eye_m, to_image)


def rows_in_image(states: VehicleStates, view: CameraView) -> IntArray:
    """Find the vehicles of which something may be in the image.

    Parameters
    ----------
    states : n vehicles.
    view : the camera; it has a pose.

    Returns
    -------
    (k,), their rows.
    """
    assert view.pose is not None
    if not states.ids:
        return np.zeros(0, dtype=np.int64)
    space = view.pose.projection(*view.size_px)
    foot_m = corners_m(states)
    flat = foot_m @ space[:, :2].T + space[:, 3]
    mapped = np.concatenate((flat, flat + _HIGHEST_M * space[:, 2]), axis=1)  # (n, 8, 3)
    ahead = mapped[:, :, 2] > NEAREST_M
    depth = np.where(ahead, mapped[:, :, 2], np.nan)
    with np.errstate(invalid="ignore"):
        points_px = mapped[:, :, :2] / depth[:, :, None]
    some = np.asarray(ahead.any(axis=1), dtype=np.bool_)
    low = np.full((len(some), 2), -np.inf)
    high = np.full((len(some), 2), np.inf)
    whole = np.asarray(ahead.all(axis=1), dtype=np.bool_)
    low[whole], high[whole] = points_px[whole].min(axis=1), points_px[whole].max(axis=1)
    size_px = np.array(view.size_px)
    return np.flatnonzero(some & (low < size_px).all(axis=1) & (high > 0).all(axis=1))


def far_first(rows: IntArray, states: VehicleStates, eye_m: FloatArray) -> list[int]:
    """Order vehicles so that each comes before those that stand between it and the camera.

    Parameters
    ----------
    rows : (k,), to order.
    states : all vehicles; no two bodies touch.
    eye_m : (2,), the camera's foot.

    Returns
    -------
    The rows. Where two lie in one direction the ray through both decides, and not the centres: a car beside the end of
    a truck may be nearer than the truck's centre and yet behind it.
    """
    if len(rows) < 2:
        return [int(row) for row in rows]
    distance_m = np.hypot(*(states.centre_m[rows] - eye_m).T)
    rows = rows[np.argsort(-distance_m, kind="stable")]
    away_m = corners_m(states)[rows] - eye_m
    middle_rad = np.arctan2(*(states.centre_m[rows] - eye_m).T[::-1])
    spread_rad = (
        np.remainder(np.arctan2(away_m[:, :, 1], away_m[:, :, 0]) - middle_rad[:, None] + np.pi, math.tau) - np.pi
    )
    apart_rad = np.remainder(middle_rad[None] - middle_rad[:, None] + np.pi, math.tau) - np.pi
    low, high = spread_rad.min(axis=1), spread_rad.max(axis=1)
    first = np.maximum(low[:, None], low[None] + apart_rad)
    last = np.minimum(high[:, None], high[None] + apart_rad)
    pairs = np.argwhere(np.triu(last > first, 1))
    ray_rad = middle_rad[pairs[:, 0]] + ((first + last) / 2)[pairs[:, 0], pairs[:, 1]]
    far, near = (entry_m(rows[pairs[:, side]], states, eye_m, ray_rad) for side in (0, 1))
    swapped = far < near
    behind = np.where(swapped, pairs[:, 1], pairs[:, 0]), np.where(swapped, pairs[:, 0], pairs[:, 1])
    return [int(rows[place]) for place in _sorted_by(len(rows), behind)]


def _sorted_by(count: int, behind: tuple[IntArray, IntArray]) -> list[int]:
    """Sort places topologically, keeping their order where nothing is said; a circle is cut at its first place."""
    blocked_by: list[set[int]] = [set() for _ in range(count)]
    for first, second in zip(*(side.tolist() for side in behind), strict=True):
        blocked_by[second].add(first)
    left, order = list(range(count)), []
    done: set[int] = set()
    while left:
        following = next((place for place in left if blocked_by[place] <= done), left[0])
        left.remove(following)
        done.add(following)
        order.append(following)
    return order


def entry_m(rows: IntArray, states: VehicleStates, eye_m: FloatArray, ray_rad: FloatArray) -> FloatArray:
    """Measure how far away rays enter the footprints of vehicles.

    Parameters
    ----------
    rows : (k,), vehicles.
    states : all vehicles.
    eye_m : (2,), where the rays start.
    ray_rad : (k,), their directions.

    Returns
    -------
    (k,); where a ray misses, the distance at which it passes the centre.
    """
    heading_rad = states.heading_rad[rows]
    away_m = states.centre_m[rows] - eye_m
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    centre_m = np.stack((away_m[:, 0] * cosine + away_m[:, 1] * sine, away_m[:, 1] * cosine - away_m[:, 0] * sine))
    ray = np.stack((np.cos(ray_rad - heading_rad), np.sin(ray_rad - heading_rad)))
    ray = np.where(np.abs(ray) < 1e-9, 1e-9, ray)
    half_m = np.stack((states.length_m[rows], states.width_m[rows])) / 2
    crossings = np.stack(((centre_m - half_m) / ray, (centre_m + half_m) / ray))
    enters, leaves = crossings.min(axis=0).max(axis=0), crossings.max(axis=0).min(axis=0)
    return np.asarray(np.where(enters <= leaves, enters, (centre_m * ray).sum(axis=0)), dtype=np.float64)


def hidden_by(standing: Standing, solid: Solid, part: Rectangle, states: VehicleStates, view: CameraView) -> BoolArray:
    """Tell at which pixels of a part of the image something stands before a vehicle, (h, w)."""
    away_m = standing.away_m[part.window]
    if away_m.min() > solid.distance_m:
        return np.zeros(away_m.shape, dtype=np.bool_)
    if solid.pixel_m > _FAR_PIXEL_M:
        return np.asarray(away_m < solid.distance_m - _TOUCHING_M, dtype=np.bool_)
    assert view.pose is not None
    columns = np.arange(part.left, part.right, dtype=np.float64)
    # The lowest row looks at the ground under the vehicle; the azimuth of a column hardly changes upwards.
    foot_m = view.camera.to_ground(np.column_stack((columns, np.full(len(columns), float(part.bottom)))))
    rays_rad = np.arctan2(*(foot_m - view.pose.place_m[:2]).T[::-1])
    entries_m = entry_m(np.full(len(columns), solid.row), states, view.pose.place_m[:2], np.nan_to_num(rays_rad))
    return np.asarray(away_m < entries_m - _TOUCHING_M, dtype=np.bool_)
