"""The background under a moving camera: what becomes known, and how much at a time."""

import numpy as np
import pytest

from tests.vision.moving_world import ROAD, SIZE, MovingWorld, drift
from tests.vision.support import FloatArray
from vision.background.settings import BackgroundSettings
from vision.camera import facing
from vision.registration import mosaic
from vision.registration.mosaic import MosaicBackground
from vision.registration.moving_raster import MovingGroundSurface
from vision.settings import VisionSettings

SETTINGS = VisionSettings(background=BackgroundSettings(startup_us=1_000_000), car_width_cells=3.0)


def start(monkeypatch: pytest.MonkeyPatch, *, cells: int, frames: int) -> tuple[list[int], FloatArray]:
    """Start up, `cells` and `frames` at a time; give how many cells were road after each frame, and a comparison."""
    monkeypatch.setattr(mosaic, "SETTLED_CELLS", cells)
    monkeypatch.setattr(mosaic, "READ_FRAMES", frames)
    surface = MovingGroundSurface(facing(drift(0)), [ROAD], image_size_px=SIZE, reach_m=40.0, settings=SETTINGS)
    background, world, known = MosaicBackground(surface.raster, SETTINGS), MovingWorld(), []
    for k in range(200):
        is_ready = background.hold(surface.raster.rectify(world.frame(drift(k), k), facing(drift(k))))
        known.append(int(surface.raster.road.sum()))
        if is_ready:
            break
    image = surface.raster.rectify(MovingWorld().frame(drift(0), 300), facing(drift(0)))
    surface.look(facing(drift(0)))
    return known, background.compare(image).astype(np.float64)


def test_startup_ends_in_slices_and_gives_what_it_gives_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    at_once, expected = start(monkeypatch, cells=10**9, frames=10**9)
    sliced, found = start(monkeypatch, cells=300, frames=5)
    assert at_once[-1] == sliced[-1] > 3_000
    assert len(sliced) - len(at_once) >= sliced[-1] // 300  # a frame for each slice
    assert np.array_equal(found, expected)
    assert expected.any()
