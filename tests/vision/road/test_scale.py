"""A scale for the image plane from what moves."""

import cv2
import numpy as np
import pytest

from vision.errors import VisionError
from vision.road.scale import estimate_scale
from vision.settings import VisionSettings


def pictures_of_cars(length_px: int, count: int) -> list[np.ndarray]:
    """Draw two bright cars driving over a grey road, one a picture further right."""
    pictures = []
    for i in range(count):
        picture = np.full((80, 400), 100, np.uint8)
        for row in (20, 50):
            left = 10 + 30 * i
            picture[row : row + length_px // 2, left : left + length_px] = 200
        pictures.append(picture)
    return pictures


@pytest.mark.parametrize("length_px", [12, 30])
def test_typical_blob_is_as_long_as_a_typical_car(length_px: int) -> None:
    assert estimate_scale(pictures_of_cars(length_px, 10), VisionSettings()) == pytest.approx(4.5 / length_px, rel=0.02)


def test_slow_lorries_that_make_most_of_the_length_do_not_set_the_scale() -> None:
    pictures = [np.full((80, 400), 100, np.uint8) for _ in range(12)]
    for i, picture in enumerate(pictures):
        picture[50:60, 10 + 10 * i : 70 + 10 * i] = 180
        if i < 10:
            picture[20:28, 10 + 30 * i : 30 + 30 * i] = 200
            picture[36:44, 300 - 30 * i : 322 - 30 * i] = 40
    assert estimate_scale(pictures, VisionSettings()) == pytest.approx(4.5 / 21, rel=0.1)


def test_blur_around_things_does_not_make_them_longer() -> None:
    pictures = [cv2.GaussianBlur(picture, (0, 0), 2.0) for picture in pictures_of_cars(20, 10)]
    assert estimate_scale(pictures, VisionSettings()) == pytest.approx(4.5 / 20, rel=0.06)


def test_specks_that_outnumber_the_cars_do_not_set_the_scale() -> None:
    rng = np.random.default_rng(4)
    pictures = pictures_of_cars(40, 10)
    for picture in pictures:
        for x in rng.permutation(np.arange(6, 394, 16))[:5]:
            picture[2:9, x : x + 7] = 180
    assert estimate_scale(pictures, VisionSettings()) == pytest.approx(4.5 / 40, rel=0.02)


def test_nothing_moving_gives_no_scale() -> None:
    with pytest.raises(VisionError, match="expected at least 10 moving blobs to take it from, got 0"):
        estimate_scale([np.full((80, 400), 100, np.uint8)] * 10, VisionSettings())


def test_too_few_pictures_are_refused() -> None:
    with pytest.raises(VisionError, match="expected at least 5 pictures, got 2"):
        estimate_scale(pictures_of_cars(12, 2), VisionSettings())
