"""The project's own networks: their recipes can be read, and they find what is drawn."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from data_gen.drawing.cameras import CameraKind
from data_gen.outputs.stills import draw_stills
from service.texts.toml_tables import read_toml
from tests.architecture.test_imports import ROOT
from vision.networks.onnx.detector import OnnxDetector
from vision.networks.onnx.settings import OnnxSettings
from vision.objects import ByteArray
from vision.video.frame import Frame

pytestmark = pytest.mark.long

WEIGHTS = ROOT / "vision" / "networks" / "weights"
LARGEST_BYTES = 5_000_000


def frame_of(picture: ByteArray) -> Frame:
    planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420))
    chroma = planes[720:].reshape(2, 360, 640)
    return Frame(index=0, t_us=0, luma=planes[:720], chroma_u=chroma[0], chroma_v=chroma[1])


@pytest.mark.parametrize(
    ("name", "camera", "least_share"), [("low", "mast", 0.5), ("above", "oblique", 0.4)], ids=["low", "above"]
)
def test_own_weights_find_vehicles_that_they_were_not_trained_on(
    name: str, camera: CameraKind, least_share: float
) -> None:
    path = WEIGHTS / f"{name}.onnx"
    assert path.stat().st_size < LARGEST_BYTES
    settings = read_toml(path.with_suffix(".toml"), OnnxSettings, what="recipe")
    found, asked = 0, 0
    detector = OnnxDetector(path, settings, (1280, 720))
    for still in draw_stills("junction", seed=2, count=2, camera=camera):
        boxes = detector.detect(frame_of(still.picture))
        assert still.shown is not None
        clear = still.shown.box_px[still.shown.share > 0.7]
        middles = (clear[:, :2] + clear[:, 2:]) / 2
        apart = (
            np.linalg.norm(middles[:, None] - boxes.centre_px, axis=2)
            / (clear[:, 2:] - clear[:, :2]).max(axis=1)[:, None]
        )
        found += int((apart.min(axis=1) < 0.3).sum())
        asked += len(clear)
    assert asked > 10
    assert found / asked > least_share


def test_edges_of_far_vehicles_are_known_better_by_a_closer_look() -> None:
    path = WEIGHTS / "low.onnx"
    settings = read_toml(path.with_suffix(".toml"), OnnxSettings, what="recipe")
    plain, closer = (OnnxDetector(path, settings, (1280, 720), far_px=far) for far in (None, (0, 100, 1280, 200)))
    off: dict[OnnxDetector, list[float]] = {plain: [], closer: []}
    for still in draw_stills("motorway", seed=3, count=8, options={"demand": "high"}):
        assert still.shown is not None
        sides_px = (still.shown.box_px[:, 2:] - still.shown.box_px[:, :2]).max(axis=1)
        is_far = (still.shown.share > 0.5) & (sides_px > 15) & (sides_px < 30)
        for detector, worst in off.items():
            found = detector.detect(frame_of(still.picture)).bounds_px()
            for box_px, side_px in zip(still.shown.box_px[is_far], sides_px[is_far], strict=True):
                worst.append(float(np.abs(found - box_px).max(axis=1).min() / side_px))
    assert len(off[plain]) > 25
    assert np.median(off[closer]) < 0.75 * np.median(off[plain])


def test_a_small_picture_is_enlarged_as_far_as_the_recipe_says() -> None:
    path = WEIGHTS / "low.onnx"
    settings = read_toml(path.with_suffix(".toml"), OnnxSettings, what="recipe")
    taken_px = {
        enlarge: OnnxDetector(path, replace(settings, enlarge=enlarge), (640, 352)).input_size_px
        for enlarge in (1.0, 1.4, 8.0)
    }
    assert taken_px == {1.0: (640, 352), 1.4: (896, 512), 8.0: (1280, 704)}
    assert settings.enlarge == 1.4
    # What is larger is made smaller, either way.
    assert OnnxDetector(path, settings, (1920, 1080)).input_size_px == (1280, 736)
