"""What cameras do to pictures, against OpenCV, and what is painted where."""

import cv2
import numpy as np
import pytest

from tests.cases import for_each

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from training.crops import Boxes
from training.spoil import Chances, clutter_layers, cluttered, inside, jpeg, smooth, spoilt


def smooth_pictures(seed: int, side: int = 96) -> torch.Tensor:
    chances = Chances(3, torch.Generator().manual_seed(seed))
    planes = [chances.noise(side, torch.full((3, 1, 1, 1), 12.0)) for _ in range(3)]
    return (0.5 + 0.15 * torch.cat(planes, 1)).clamp(0, 1)


def as_bytes(picture: torch.Tensor) -> np.ndarray:  # type: ignore[type-arg]
    return (255 * picture.flip(0).permute(1, 2, 0)).round().byte().numpy()


@for_each("quality", [25, 60, 90])
def test_pictures_are_rounded_as_opencv_packs_them(quality: int) -> None:
    crops = smooth_pictures(quality)
    packed = jpeg(crops, torch.full((3, 1, 1, 1), float(quality)))
    for before, after in zip(crops, packed, strict=True):
        given = as_bytes(before)
        written = cv2.imencode(".jpg", given, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        expected = cv2.imdecode(written, cv2.IMREAD_COLOR).astype(float)
        off = np.abs(as_bytes(after).astype(float) - expected).mean()
        assert off < 0.35 * np.abs(given - expected).mean() + 0.5


def test_each_crop_is_blurred_by_its_own_deviation() -> None:
    crops, deviation_px = smooth_pictures(4), [0.5, 1.0, 1.6]
    blurred = smooth(crops, torch.tensor(deviation_px).reshape(3, 1, 1, 1))
    for before, after, deviation in zip(crops, blurred, deviation_px, strict=True):
        planes = before.permute(1, 2, 0).numpy()
        expected = cv2.GaussianBlur(planes, (13, 13), deviation, borderType=cv2.BORDER_REPLICATE)
        np.testing.assert_allclose(after.permute(1, 2, 0).numpy(), expected, atol=1e-5)


def test_noise_has_the_length_of_wave_that_was_asked_for() -> None:
    chances = Chances(2, torch.Generator().manual_seed(1))
    noise = chances.noise(192, torch.tensor([3.0, 24.0]).reshape(2, 1, 1, 1))
    steps = noise.diff(dim=3).std(dim=(1, 2, 3)) / noise.std(dim=(1, 2, 3))
    assert steps[0] / steps[1] == pytest.approx(8, rel=0.3)


def test_shapes_are_laid_beside_vehicles_and_not_on_them() -> None:
    rows = torch.tensor([[[48.0, 48.0, 40.0, 30.0, 0.0, 0.0, 1.0]]]).expand(8, -1, -1)
    boxes, crops = Boxes(rows, torch.ones(8, 1, dtype=torch.bool)), torch.full((8, 3, 96, 96), 0.5)
    littered = cluttered(crops, boxes, clutter_layers(20, 96), Chances(8, torch.Generator().manual_seed(3)))
    is_changed = (littered != crops).any(1, keepdim=True)
    assert is_changed.flatten(1).any(1).sum() >= 4
    assert not (is_changed & inside(rows, 96)).any()


def test_the_same_numbers_spoil_a_picture_the_same_way() -> None:
    rows = torch.tensor([[[48.0, 48.0, 40.0, 1e-3, 0.0, 0.0, 0.02]]]).expand(3, -1, -1)  # a sliver has a shine too
    boxes, layers = Boxes(rows, torch.ones(3, 1, dtype=torch.bool)), clutter_layers(5, 96)
    first, second, other = (
        spoilt(smooth_pictures(0), boxes, layers, torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)
    )
    assert torch.equal(first, second)
    assert not torch.equal(first, other)
    assert torch.isfinite(first).all()
    assert first.amin() >= 0
    assert first.amax() <= 1
