"""What vision looks at: roads, view and mask."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import shapely

from gis.cameras.camera import GroundCamera
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork
from service.errors import SiteError
from service.runs.inputs.sensors.moving_camera import watched_area

SIZE_PX = (100, 60)
CAMERA = GroundCamera.from_homography([[1.0, 0.0, 0.0], [0.0, -1.0, 59.0], [0.0, 0.0, 1.0]])
ROAD = RoadNetwork([Lane("l", "e", 0, "r", 1, np.array([[0.0, 30.0], [99.0, 30.0]]), 10.0, 20.0)])


def written_mask(folder: Path, mask: np.ndarray) -> Path:
    path = folder / "mask.png"
    assert cv2.imwrite(str(path), mask)
    return path


def area_of(rings: tuple[np.ndarray, ...]) -> float:
    return sum(shapely.Polygon(ring).area for ring in rings)


def test_without_a_mask_it_is_the_road() -> None:
    assert area_of(watched_area(CAMERA, ROAD, None, SIZE_PX)) == pytest.approx(990, rel=0.02)


def test_without_a_network_it_is_the_whole_view() -> None:
    assert area_of(watched_area(CAMERA, None, None, SIZE_PX)) == pytest.approx(6000)


def test_mask_takes_away_road_and_islands(tmp_path: Path) -> None:
    mask = np.zeros((60, 100), np.uint8)
    mask[:, 50:] = 255
    mask[20:40, 70:80] = 0
    rings = watched_area(CAMERA, ROAD, written_mask(tmp_path, mask), SIZE_PX)
    assert area_of(rings) == pytest.approx(49 * 10 - 10 * 10, rel=0.08)


def test_mask_that_leaves_nothing_is_refused(tmp_path: Path) -> None:
    path = written_mask(tmp_path, np.zeros((60, 100), np.uint8))
    with pytest.raises(SiteError, match=r"expected a mask that is bright on some road in view, got none"):
        watched_area(CAMERA, ROAD, path, SIZE_PX)


def test_mask_of_another_size_is_refused(tmp_path: Path) -> None:
    path = written_mask(tmp_path, np.zeros((30, 50), np.uint8))
    with pytest.raises(SiteError, match=r"expected a mask of the frame's size 100 x 60, got 50 x 30"):
        watched_area(CAMERA, ROAD, path, SIZE_PX)


def test_mask_that_is_no_image_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mask.png"
    path.write_text("no image")
    with pytest.raises(SiteError, match="expected an image that OpenCV can read"):
        watched_area(CAMERA, ROAD, path, SIZE_PX)
