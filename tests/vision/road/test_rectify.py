"""Cells sampled from the planes of a frame, against their bilinear mix."""

import numpy as np
import pytest

from tests.vision.road.test_view import bridge_view
from tests.vision.support import FloatArray, make_frame, top_view, whole_view
from vision.detection.surfaces.ground_surface import GroundSurface
from vision.errors import VisionError
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frames import ByteArray, Frame

SIZE = (96, 64)


def ground_surface(
    matrix: FloatArray, polygons: list[FloatArray], size: tuple[int, int] = SIZE, settings: VisionSettings | None = None
) -> GroundSurface:
    settings = settings or VisionSettings()
    view = GroundView(matrix, size, settings)
    return GroundSurface(view, polygons, image_size_px=size, settings=settings)


def noisy_frame(size: tuple[int, int]) -> Frame:
    rng = np.random.default_rng(5)
    luma = rng.integers(0, 256, (size[1], size[0]), dtype=np.uint8)
    chroma = rng.integers(0, 256, (2, size[1] // 2, size[0] // 2), dtype=np.uint8)
    return Frame(0, 0, luma, chroma[0], chroma[1])


def bilinear(plane: ByteArray, x: float, y: float) -> float:
    """Slow and obvious: the four neighbours by hand, borders repeated."""
    height, width = plane.shape
    left, top = int(np.floor(x)), int(np.floor(y))
    total = 0.0
    for row, share_y in ((top, 1 - (y - top)), (top + 1, y - top)):
        for column, share_x in ((left, 1 - (x - left)), (left + 1, x - left)):
            value = float(plane[min(max(row, 0), height - 1), min(max(column, 0), width - 1)])
            total += share_x * share_y * value
    return total


@pytest.mark.parametrize("kind", ["above", "turned", "slanting"])
def test_cells_are_the_bilinear_mix_of_their_pixels(kind: str) -> None:
    size = (640, 360) if kind == "slanting" else SIZE
    matrix = bridge_view(pitch_rad=0.9, height_m=60.0) if kind == "slanting" else top_view(SIZE)
    polygon = np.array([[-30.0, 10], [30, 10], [30, 80], [-30, 80]]) if kind == "slanting" else whole_view(SIZE)
    if kind == "turned":
        turn = np.array([[0.8, -0.6, 3.0], [0.6, 0.8, -2.0], [0, 0, 1]])
        matrix, polygon = matrix @ turn, (polygon - [3.0, -2.0]) @ turn[:2, :2]
    raster = ground_surface(matrix, [polygon], size).raster
    frame = noisy_frame(size)
    image = raster.rectify(frame)
    cells = [raster.unpack(plane) for plane in image.planes]
    rows, columns = np.nonzero(raster.road)
    for i in np.random.default_rng(1).choice(len(rows), 150, replace=False):
        point = np.append(raster.grid.to_plane(np.array([columns[i], rows[i]], float)), 1.0)
        x, y, w = matrix @ point
        x, y = x / w, y / w
        # Chroma samples sit on even luma columns and between two luma rows.
        places = ((frame.luma, x, y), (frame.chroma_u, x / 2, (y - 0.5) / 2), (frame.chroma_v, x / 2, (y - 0.5) / 2))
        for plane, (source, px, py) in zip(cells, places, strict=True):
            # Fixed point rounds positions to 1/32 px.
            assert plane[rows[i], columns[i]] == pytest.approx(bilinear(source, px, py), abs=10)


def test_packing_keeps_the_cells_of_the_road() -> None:
    bend = np.array([[0.0, 0], [44, 0], [44, 29], [38, 29], [38, 6], [0, 6]])
    raster = ground_surface(top_view(SIZE), [bend], settings=VisionSettings(road_margin_m=0.0)).raster
    values = np.random.default_rng(0).integers(0, 256, raster.grid.shape, dtype=np.uint8)
    assert np.array_equal(raster.unpack(raster.pack(values))[raster.road], values[raster.road])


def test_every_road_cell_is_found_in_packed_arrays() -> None:
    bend = np.array([[0.0, 0], [480, 0], [480, 300], [470, 300], [470, 10], [0, 10]])
    raster = ground_surface(top_view((1000, 640)), [bend], (1000, 640)).raster
    assert len(raster.strips) > 1
    values = np.random.default_rng(0).integers(0, 256, raster.grid.shape, dtype=np.uint8)
    rows, columns = np.nonzero(raster.road)
    places = raster.places(raster.grid.to_plane(np.stack([columns, rows], axis=-1).astype(float)))
    assert np.array_equal(raster.pack(values)[places], values[rows, columns])


def test_only_the_road_is_sampled() -> None:
    diagonal = np.array([[0.0, 0], [3, 0], [480, 300], [480, 303]])
    raster = ground_surface(top_view((1000, 640)), [diagonal], (1000, 640)).raster
    assert raster.packed_size < 0.25 * raster.grid.shape[0] * raster.grid.shape[1]


def test_cell_keeps_a_car_six_cells_wide_but_is_never_finer_than_the_camera() -> None:
    fine = ground_surface(top_view((600, 300), 0.1), [whole_view((600, 300), 0.1)], (600, 300))
    coarse = ground_surface(top_view(SIZE, 0.6), [whole_view(SIZE, 0.6)])
    assert fine.raster.grid.side == pytest.approx(0.3)
    assert coarse.raster.grid.side == pytest.approx(0.6)


def test_road_out_of_view_is_left_out_and_the_border_to_it_is_known() -> None:
    surface = ground_surface(top_view(SIZE), [whole_view(SIZE)])
    inside, outside = np.array([[20.0, 15.0]]), np.array([[-2.0, 15.0]])
    assert surface.holds(np.concatenate([inside, outside])).tolist() == [True, False]
    edge = surface.raster.grid.look_up(surface.raster.view_edge, np.array([[0.3, 15.0], [20.0, 15.0]]))
    assert edge.tolist() == [True, False]


def test_road_behind_a_slanting_camera_is_left_out() -> None:
    road = np.array([[-4.0, -500.0], [4, -500], [4, 500], [-4, 500]])
    surface = ground_surface(bridge_view(pitch_rad=0.5, height_m=30.0), [road], (640, 360))
    assert surface.holds(np.array([[0.0, 60.0], [0.0, -60.0], [0.0, 480.0]])).tolist() == [True, False, False]


def test_frame_of_another_size_is_refused() -> None:
    raster = ground_surface(top_view(SIZE), [whole_view(SIZE)]).raster
    with pytest.raises(VisionError, match=r"frame 3: expected \(96, 64\) px, got \(32, 48\)"):
        raster.rectify(make_frame(np.zeros((48, 32)), index=3))


def test_road_elsewhere_is_refused_with_both_places() -> None:
    with pytest.raises(VisionError, match=r"expected road within the view.*got road at \[1000.0, 1000.0\]"):
        ground_surface(top_view(SIZE), [whole_view(SIZE) + 1005.0])
