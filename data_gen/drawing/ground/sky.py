"""What stands over the horizon, and how does distance fade what lies under it? Sky, far woods, haze.

Only a camera that sees the horizon needs this; its roll is 0, so the horizon is a row of the image.
"""

import math
from dataclasses import dataclass

import numpy as np

from data_gen.drawing.ground.paint import Colour, fractal_noise
from data_gen.drawing.sun import Sun
from data_gen.simulation.states import FloatArray, Picture
from gis.cameras.camera_pose import CameraPose

_HAZE_M = (900.0, 4000.0)
"""Distance over which two thirds of a colour are lost; drawn log-evenly."""
_BLUE_ZENITH: Colour = (214.0, 168.0, 122.0)
_PALE_HORIZON: Colour = (232.0, 222.0, 208.0)
_GREY_ZENITH: Colour = (196.0, 192.0, 188.0)
_GREY_HORIZON: Colour = (218.0, 216.0, 214.0)
_WOODS: Colour = (74.0, 92.0, 78.0)
_WOODS_RAD = 0.016
"""Usual height of far woods over the horizon."""


@dataclass(frozen=True, slots=True)
class Haze:
    """The air between the camera and what is far."""

    distance_m: float
    """Over it two thirds of a colour are lost."""
    colour: Colour

    def pale(self, colours: FloatArray, distance_m: float) -> FloatArray:
        """Give colours, (n, 3), as they look from a distance."""
        lost = 1 - math.exp(-distance_m / self.distance_m)
        return np.asarray(colours + lost * (np.asarray(self.colour) - colours), dtype=np.float64)


def draw_haze(sun: Sun, rng: np.random.Generator) -> Haze:
    """Draw how clear the air is, 0.9 to 4 km."""
    horizon = _GREY_HORIZON if sun.is_hidden else _PALE_HORIZON
    return Haze(math.exp(rng.uniform(*np.log(_HAZE_M))), horizon)


def horizon_px(pose: CameraPose, size_px: tuple[int, int]) -> float:
    """Tell the row of the horizon; negative where it is over the image."""
    return (size_px[1] - 1) / 2 + pose.focal_px * math.tan(pose.pitch_rad)


def paint_distance(picture: Picture, pose: CameraPose, sun: Sun, haze: Haze, rng: np.random.Generator) -> None:
    """Paint sky and far woods over the ground, and let haze pale what is far.

    Parameters
    ----------
    picture : (h, w, 3), changed; the ground is painted.
    pose : of the camera.
    sun : a hidden one makes the sky grey.
    haze : of the air.
    rng : source of clouds and woods.
    """
    height_px, width_px = picture.shape[:2]
    row = horizon_px(pose, (width_px, height_px))
    zenith = _GREY_ZENITH if sun.is_hidden else _BLUE_ZENITH
    below = np.maximum(np.arange(height_px) - row, 0.25)
    lost = 1 - np.exp(-pose.height_m * pose.focal_px / below / haze.distance_m)
    pale = np.asarray(haze.colour, dtype=np.float32)
    picture += lost.astype(np.float32)[:, None, None] * (pale - picture)
    over = np.clip((row - np.arange(height_px)) / (0.35 * pose.focal_px), 0, 1).astype(np.float32)[:, None, None]
    sky = pale + np.sqrt(over) * (np.asarray(zenith, dtype=np.float32) - pale)
    shape = fractal_noise(rng, (width_px, height_px), largest_px=width_px / 4, octaves=5)[:, :, None]
    covered = rng.uniform(0.0, 0.8)
    clouds = np.clip(1.6 * (shape + 2.4 * (covered - 0.5)), 0, 1) * np.float32(0.3 if sun.is_hidden else 0.75)
    sky = sky + clouds * (np.float32(0.97) * (255 if not sun.is_hidden else 205) - sky)
    is_sky = np.clip(row + 0.5 - np.arange(height_px), 0, 1).astype(np.float32)[:, None, None]
    picture += is_sky * (sky - picture)
    _paint_woods(picture, row, pose.focal_px, pale, rng)


def _paint_woods(picture: Picture, row: float, focal_px: float, pale: Picture, rng: np.random.Generator) -> None:
    """Raise two ragged lines of far trees from the horizon."""
    height_px, width_px = picture.shape[:2]
    if row < -0.05 * focal_px:
        return
    for fade, share in ((0.6, 1.0), (0.3, 0.6)):
        ragged = fractal_noise(rng, (width_px, 3), largest_px=width_px / 3, octaves=8)[1]
        top_px = row - focal_px * _WOODS_RAD * share * np.clip(1.0 + 0.55 * ragged, 0.05, 2.5)
        rows = np.arange(height_px)[:, None]
        bottom_px = row + 2.0 * share
        cover = np.clip(rows - top_px[None, :] + 0.5, 0, 1) * np.clip(bottom_px - rows + 0.5, 0, 1)
        leaves = 1 + 0.1 * fractal_noise(rng, (width_px, height_px), largest_px=12, octaves=4)
        colour = np.asarray(_WOODS, dtype=np.float32) * leaves[:, :, None].astype(np.float32)
        faded = colour + np.float32(fade) * (pale - colour)
        picture += cover.astype(np.float32)[:, :, None] * (faded - picture)
