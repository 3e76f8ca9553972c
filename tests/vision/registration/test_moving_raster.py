"""Cells of ground sampled from the frames of a moving camera, against the bilinear mix of their pixels."""

import numpy as np
import pytest

from tests.vision.moving_world import ROAD, SIZE, MovingWorld, drift, view
from tests.vision.road.test_rectify import bilinear
from tests.vision.support import FloatArray
from vision.camera import facing
from vision.registration.moving_raster import MovingGroundSurface
from vision.registration.plane_fit import transform
from vision.settings import VisionSettings


@pytest.mark.parametrize(
    "matrix",
    [
        pytest.param(view(), id="first view"),
        pytest.param(drift(45), id="turned"),
        pytest.param(view(east_m=-60.0), id="road begins in view"),
        pytest.param(view(north_m=38.0), id="road at the lower border"),
    ],
)
def test_cells_in_view_are_the_bilinear_mix_of_their_pixels(matrix: FloatArray) -> None:
    surface = MovingGroundSurface(
        facing(view()), [ROAD], image_size_px=SIZE, reach_m=60.0, settings=VisionSettings(car_width_cells=3.0)
    )
    raster = surface.raster
    frame = MovingWorld().frame(matrix, 0)
    image = raster.rectify(frame, facing(matrix))
    raster.look(facing(matrix))
    luma, is_seen = raster.unpack(image.planes[0]), raster.unpack(raster.is_seen.astype(np.uint8))
    rows, columns = np.nonzero(is_seen)
    assert 0 < len(rows) < raster.packed_size
    pixels = transform(matrix, raster.grid.to_plane(np.stack([columns, rows], axis=-1).astype(float)))
    # The outermost cells are where a window around the view would end too early.
    chosen = np.unique(np.concatenate([[columns.argmin(), columns.argmax(), 0, -1], np.arange(0, len(rows), 37)]))
    for i in chosen:
        # Positions are rounded to 1/32 px.
        assert luma[rows[i], columns[i]] == pytest.approx(bilinear(frame.luma, *pixels[i]), abs=4)


def test_view_without_road_gives_an_image_of_nothing() -> None:
    surface = MovingGroundSurface(
        facing(view()), [ROAD], image_size_px=SIZE, reach_m=60.0, settings=VisionSettings(car_width_cells=3.0)
    )
    elsewhere = view(east_m=2_000.0)
    image = surface.raster.rectify(MovingWorld().frame(elsewhere, 0), facing(elsewhere))
    surface.raster.look(facing(elsewhere))
    assert not image.planes.any()
    assert not surface.raster.is_seen.any()
