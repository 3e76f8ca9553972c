"""What does a thermal camera beside the colour camera see? Warm vehicles on cooler ground, coarse and without shadows.

It has fewer pixels, a slightly wider view and never quite the same direction; so it has a homography of its own.
"""

import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.cameras import CameraPath
from data_gen.drawing.ground.paint import fill, lay_over
from data_gen.drawing.overlay import Overlay
from data_gen.drawing.render import GroundPicture, World
from data_gen.drawing.traffic.vehicle_models import height_m
from data_gen.drawing.view import CameraView, Rectangle, camera_over, corners_m, silhouette_px, views_of, widened
from data_gen.scenario import View
from data_gen.simulation.states import Picture, VehicleStates
from gis.cameras.camera_pose import CameraPose, CameraTrack

_WIDER = 1.06
_BORESIGHT_RAD = (0.004, -0.003)
"""How far the thermal camera looks beside the colour camera: yaw and pitch."""
_OFFSET = (0.008, -0.005)
"""The same for cameras straight above, in widths of the view."""
_ASPHALT, _LEAVES_COOLER = 84.0, 0.5
_BODY, _BODY_SPREAD, _ENGINE_HOTTER = 160.0, 45.0, 28.0
_ENGINE_PART = 0.32
_OCCLUDER = 78.0
_BLUR_PX = 0.9
_NOISE_SIGMA = 2.5


def thermal_path(path: CameraPath, view: View, size_px: tuple[int, int]) -> CameraPath:
    """Mount a thermal camera beside a colour camera.

    Parameters
    ----------
    path : of the colour camera.
    view : of the scenario.
    size_px : width and height of the thermal image, both even.

    Returns
    -------
    Its path, which moves as the other one does.
    """
    pixel_ratio = path.views[0].size_px[0] / size_px[0] * _WIDER
    if path.track is None:
        east_m, north_m = (middle + share * view.width_m for middle, share in zip(view.centre_m, _OFFSET, strict=True))
        seen = camera_over(View((east_m, north_m), view.width_m * _WIDER), size_px)
        views: tuple[CameraView, ...] = (seen,) * len(path.views)
        track = None
    else:
        poses = tuple(_beside(pose, pixel_ratio) for pose in path.track.poses)
        views = views_of(poses, size_px)
        track = CameraTrack(path.track.t_us, poses)
    return CameraPath(
        kind=path.kind,
        views=views,
        track=track,
        blur_px=path.blur_px / pixel_ratio,
        reach_m=widened(path.reach_m, 0.06 * (path.reach_m[2] - path.reach_m[0])),
        finest_pixel_m=path.finest_pixel_m * pixel_ratio,
    )


def _beside(pose: CameraPose, pixel_ratio: float) -> CameraPose:
    yaw_rad, pitch_rad = _BORESIGHT_RAD
    return replace(
        pose,
        yaw_rad=pose.yaw_rad + yaw_rad,
        pitch_rad=max(-math.pi / 2, pose.pitch_rad + pitch_rad),
        focal_px=pose.focal_px / pixel_ratio,
    )


class ThermalRenderer:
    """Draws a scene as a thermal camera sees it, frame by frame.

    Parameters
    ----------
    world : to film.
    path : of the thermal camera.
    rng : source of textures and noise; consumed further by each frame.
    """

    def __init__(self, world: World, path: CameraPath, rng: np.random.Generator) -> None:
        self._path = path
        # Shadows are cooler by too little to show.
        shadowless = replace(world, sun=replace(world.sun, is_hidden=True))
        self._ground = GroundPicture(shadowless, path, rng)
        self._overlay = Overlay(world.occluders, pixel_m=path.finest_pixel_m, sun=world.sun, rng=rng)
        self._empty: tuple[CameraView, Picture] | None = None
        self._rng = rng

    def frame(self, states: VehicleStates, number: int = 0) -> NDArray[np.uint8]:
        """Draw one frame; parameters and result are those of `SceneRenderer.frame`, with colourless chroma planes."""
        view = self._path.views[number]
        width_px, height_px = view.size_px
        warmth = self._ground_warmth(view).copy()
        for row in np.flatnonzero(view.touches(states)):
            _draw_warm(warmth, states, int(row), view)
        whole = Rectangle(0, 0, width_px, height_px)
        if not self._overlay.is_empty:
            hidden = self._overlay.opacity(whole, view).astype(np.float32)
            lay_over(warmth[:, :, None], hidden, (_OCCLUDER,))
        seen = cv2.GaussianBlur(warmth, (0, 0), _BLUR_PX)
        noise = np.float32(_NOISE_SIGMA) * self._rng.standard_normal(seen.shape, dtype=np.float32)
        picture = np.full((height_px * 3 // 2, width_px), 128, dtype=np.uint8)
        picture[:height_px] = np.clip(np.round(seen + noise), 16, 235).astype(np.uint8)
        return picture

    def _ground_warmth(self, view: CameraView) -> Picture:
        if self._empty is None or self._empty[0] is not view:
            self._empty = view, _warmth_of(self._ground.seen(view))
        return self._empty[1]


def _warmth_of(colours: NDArray[np.uint8]) -> Picture:
    """Guess warmth from colour: leaves are cool, asphalt and roofs are not."""
    blue, green, red = (colours[:, :, channel].astype(np.float32) for channel in range(3))
    leaves = np.clip(green - (red + blue) / 2, 0, 60)
    luma = (blue + 6 * green + 3 * red) / 10
    return np.asarray(_ASPHALT + 0.1 * (luma - 106) - np.float32(_LEAVES_COOLER) * leaves, dtype=np.float32)


def _draw_warm(warmth: Picture, states: VehicleStates, row: int, view: CameraView) -> None:
    """Draw the silhouette of one vehicle, its engine at the front a little warmer."""
    rng = np.random.default_rng(states.appearance[row])
    body = _BODY + _BODY_SPREAD * float(rng.random())
    whole = corners_m(states)[row]
    rear, front = [0, 3], [1, 2]
    engine = whole.copy()
    engine[rear] += (1 - _ENGINE_PART) * (whole[front] - whole[rear])
    for outline_m, value in ((whole, body), (engine, body + _ENGINE_HOTTER)):
        fill(warmth[:, :, None], silhouette_px(outline_m, height_m(states.classes[row]), view), (value,))
