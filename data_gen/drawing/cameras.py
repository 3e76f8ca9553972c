"""From where is a scenario filmed? A camera straight above, a slanting one on a mast, or a drone that drifts.

A camera path has one view a frame. The drone's movement is a sum of slow waves (drift, yaw, zoom) and of quick ones
(vibration); waves have no memory, so a longer clip begins with the shorter one's path.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from data_gen.drawing.mast import mast_pose
from data_gen.drawing.view import Bounds, CameraView, camera_over, views_of, widened
from data_gen.errors import DataGenError
from data_gen.scenario import View
from data_gen.simulation.states import FloatArray, IntArray
from gis.cameras.camera_pose import CameraPose, CameraTrack
from gis.roads.road_network import RoadNetwork

CameraKind = Literal["vertical", "oblique", "uav", "mast"]

_FOCAL_WIDTHS = 1.2
"""Focal length in image widths: 45 degrees from the left border to the right one."""
_OBLIQUE_WIDTH_M = 260.0
_OBLIQUE_PITCH_DEG = (38.0, 48.0)
_OBLIQUE_TURN_DEG = 15.0
_REACH_M = 500.0
_EXPOSURE_S = 1 / 60
_JITTER_HZ = (5.0, 16.0)
_JITTER_WAVES = 6
_JITTER_PX = 0.55
"""Standard deviation in each direction; peaks reach about three times as much."""
_LEAN_RAD = 0.02
"""A gimbal never hangs quite plumb."""
# How far a drone strays from its place over the view, in widths of the view, and from its direction, focal length and
# tilt.
_DRIFT_SHARE = 0.045
_YAW_RAD = math.radians(19)
_ZOOM = 0.1
_TILT_RAD = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class CameraPath:
    """What the camera sees at each frame of a clip."""

    kind: CameraKind
    views: tuple[CameraView, ...]
    """One a frame; the very same object while the camera stands still."""
    track: CameraTrack | None
    """Poses; None for the camera straight above, which stands infinitely high."""
    blur_px: FloatArray
    """(frames, 2): how far the image moves right and down during the exposure, by vibration."""
    reach_m: Bounds
    """West, south, east, north of all ground that the camera may ever see, however long it flies."""
    finest_pixel_m: float
    """Ground under the smallest pixel that may ever occur in the middle of the image."""

    @property
    def is_moving(self) -> bool:
        """Tell whether frames differ in their view."""
        return self.kind == "uav"

    @property
    def sees_sides(self) -> bool:
        """Tell whether the sides of vehicles show, and not only their roofs."""
        return self.kind in ("oblique", "mast")

    @property
    def is_low(self) -> bool:
        """Tell whether the camera looks along the ground rather than down on it."""
        return self.kind == "mast"


def camera_path(
    kind: CameraKind,
    view: View,
    size_px: tuple[int, int],
    *,
    t_us: IntArray,
    rng: np.random.Generator,
    network: RoadNetwork | None = None,
) -> CameraPath:
    """Plan where the camera is at each frame.

    Parameters
    ----------
    kind : "vertical" is straight above and fixed; "oblique" is fixed and looks 38 to 48 degrees down across the middle
        of the view, of which it covers at most 260 m; "uav" looks down from a drone that drifts, yaws, zooms and
        vibrates; "mast" is fixed, 4 to 12 m high, and looks along a road or across a junction.
    view : ground to cover.
    size_px : width and height of the image.
    t_us : (n,), times of the frames.
    rng : source of every choice.
    network : the roads; for a mast alone.

    Returns
    -------
    The path.

    Raises
    ------
    DataGenError
        If there is no such kind of camera.
    """
    if kind == "vertical":
        return _fixed(kind, camera_over(view, size_px), t_us)
    if kind == "oblique":
        return _fixed(kind, views_of([_oblique_pose(view, size_px, rng)], size_px)[0], t_us)
    if kind == "uav":
        return _flight(view, size_px, t_us, rng)
    if kind == "mast":
        assert network is not None
        return _fixed(kind, views_of([mast_pose(network, view, size_px, rng)], size_px)[0], t_us)
    raise DataGenError(f"camera: expected one of {', '.join(get_args(CameraKind))}, got {kind!r}")


def _fixed(kind: CameraKind, seen: CameraView, t_us: IntArray) -> CameraPath:
    outline_m = seen.camera.view_outline(*seen.size_px)
    if seen.pose is not None:
        away_m = outline_m - seen.pose.place_m[:2]
        # Towards the horizon the view has no end; what lies farther is a few pixels high.
        shorter = np.minimum(1.0, _REACH_M / np.hypot(*away_m.T))
        outline_m = seen.pose.place_m[:2] + shorter[:, None] * away_m
    return CameraPath(
        kind=kind,
        views=(seen,) * len(t_us),
        track=None if seen.pose is None else CameraTrack(t_us, (seen.pose,) * len(t_us)),
        blur_px=np.zeros((len(t_us), 2)),
        reach_m=_bounds([outline_m]),
        finest_pixel_m=float(seen.camera.metres_per_pixel(outline_m).min()),
    )


def _oblique_pose(view: View, size_px: tuple[int, int], rng: np.random.Generator) -> CameraPose:
    """Look at the middle of the view from the south."""
    pitch_rad = -math.radians(rng.uniform(*_OBLIQUE_PITCH_DEG))
    yaw_rad = math.pi / 2 + math.radians(rng.uniform(-_OBLIQUE_TURN_DEG, _OBLIQUE_TURN_DEG))
    sight_m = min(view.width_m, _OBLIQUE_WIDTH_M) * _FOCAL_WIDTHS
    level_m = sight_m * math.cos(pitch_rad)
    return CameraPose(
        x_m=view.centre_m[0] - level_m * math.cos(yaw_rad),
        y_m=view.centre_m[1] - level_m * math.sin(yaw_rad),
        height_m=-sight_m * math.sin(pitch_rad),
        yaw_rad=yaw_rad,
        pitch_rad=pitch_rad,
        roll_rad=0.0,
        focal_px=size_px[0] * _FOCAL_WIDTHS,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Waves:
    """A sum of sines about 0."""

    strength: FloatArray
    omega: FloatArray
    """Radians per second."""
    phase_rad: FloatArray

    def at(self, t_us: IntArray) -> FloatArray:
        angle = self.omega * (t_us / 1e6)[:, None] + self.phase_rad
        return np.asarray((self.strength * np.sin(angle)).sum(axis=1), dtype=np.float64)

    def slope(self, t_us: IntArray) -> FloatArray:
        """Change per second."""
        angle = self.omega * (t_us / 1e6)[:, None] + self.phase_rad
        return np.asarray((self.strength * self.omega * np.cos(angle)).sum(axis=1), dtype=np.float64)


def _slow(rng: np.random.Generator, largest: float) -> _Waves:
    """Draw a wander that never passes `largest`: periods of some minutes, one minute and half a minute."""
    period_s = np.array([rng.uniform(150, 260), rng.uniform(60, 100), rng.uniform(25, 40)])
    return _Waves(largest * np.array([0.66, 0.24, 0.1]), math.tau / period_s, rng.uniform(0, math.tau, 3))


def _quick(rng: np.random.Generator, deviation: float) -> _Waves:
    strength = np.full(_JITTER_WAVES, deviation * math.sqrt(2 / _JITTER_WAVES))
    omega = math.tau * rng.uniform(*_JITTER_HZ, _JITTER_WAVES)
    return _Waves(strength, omega, rng.uniform(0, math.tau, _JITTER_WAVES))


def _flight(view: View, size_px: tuple[int, int], t_us: IntArray, rng: np.random.Generator) -> CameraPath:
    drift_m = _DRIFT_SHARE * view.width_m
    focal_px = size_px[0] * _FOCAL_WIDTHS
    hover = CameraPose(
        *view.centre_m, view.width_m * _FOCAL_WIDTHS, math.pi / 2, _LEAN_RAD - math.pi / 2, 0.0, focal_px
    )
    east, north, climb = (_slow(rng, share * drift_m) for share in (1.0, 0.7, 0.4))
    yaw, zoom = _slow(rng, _YAW_RAD), _slow(rng, _ZOOM)
    tilts = _slow(rng, _TILT_RAD), _slow(rng, _TILT_RAD)
    shakes = tuple(_quick(rng, _JITTER_PX / focal_px) for _ in tilts)
    ahead_rad, aside_rad = (tilt.at(t_us) + shake.at(t_us) for tilt, shake in zip(tilts, shakes, strict=True))
    # Near the plumb line a tilt to the side is a turn of the line of sight that the roll takes back for the image.
    turn_rad = np.arctan2(aside_rad, _LEAN_RAD + ahead_rad)
    columns = (
        hover.x_m + east.at(t_us),
        hover.y_m + north.at(t_us),
        hover.height_m + climb.at(t_us),
        hover.yaw_rad + yaw.at(t_us) - turn_rad,
        np.hypot(aside_rad, _LEAN_RAD + ahead_rad) - math.pi / 2,
        -turn_rad,
        hover.focal_px * (1 + zoom.at(t_us)),
    )
    poses = tuple(CameraPose(*row) for row in np.column_stack(columns).tolist())
    moved_px = np.column_stack([shake.slope(t_us) * focal_px * _EXPOSURE_S for shake in reversed(shakes)])
    return CameraPath(
        kind="uav",
        views=views_of(poses, size_px),
        track=CameraTrack(t_us, poses),
        blur_px=moved_px,
        reach_m=_reach(hover, drift_m, size_px),
        finest_pixel_m=(hover.height_m - drift_m) / (focal_px * (1 + _ZOOM)),
    )


def _reach(hover: CameraPose, drift_m: float, size_px: tuple[int, int]) -> Bounds:
    widest_px = hover.focal_px * (1 - _ZOOM)
    height_m = hover.height_m + drift_m
    outlines_m = [
        CameraPose(hover.x_m, hover.y_m, height_m, hover.yaw_rad + turn_rad, hover.pitch_rad, 0.0, widest_px)
        .camera(*size_px)
        .view_outline(*size_px)
        for turn_rad in np.linspace(-_YAW_RAD, _YAW_RAD, 7)
    ]
    # Tilts move the far corners a little more than the middle; vibration moves all by a few pixels.
    stray_m = drift_m + 2 * height_m * _TILT_RAD + 5.0
    return widened(_bounds(outlines_m), stray_m)


def _bounds(outlines_m: Sequence[FloatArray]) -> Bounds:
    points_m = np.concatenate(outlines_m)
    west_m, south_m = points_m.min(axis=0).tolist()
    east_m, north_m = points_m.max(axis=0).tolist()
    return west_m, south_m, east_m, north_m
