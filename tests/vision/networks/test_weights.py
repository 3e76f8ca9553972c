"""The project's own networks: their recipes can be read, and they find what is drawn."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from data_gen.drawing.cameras import CameraKind
from data_gen.outputs.stills import draw_stills
from service.texts.toml_tables import read_toml
from tests.architecture.test_imports import ROOT
from vision.networks.onnx_detector import OnnxDetector
from vision.networks.onnx_settings import OnnxSettings
from vision.video.frame import Frame

WEIGHTS = ROOT / "vision" / "networks" / "weights"
LARGEST_BYTES = 5_000_000


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
        planes = np.asarray(cv2.cvtColor(still.picture, cv2.COLOR_BGR2YUV_I420))
        chroma = planes[720:].reshape(2, 360, 640)
        boxes = detector.detect(Frame(index=0, t_us=0, luma=planes[:720], chroma_u=chroma[0], chroma_v=chroma[1]))
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


def test_a_small_picture_is_enlarged_where_the_recipe_says_so() -> None:
    path = WEIGHTS / "low.onnx"
    settings = read_toml(path.with_suffix(".toml"), OnnxSettings, what="recipe")
    taken_px = {
        enlarge: OnnxDetector(path, replace(settings, enlarge=enlarge), (640, 352)).input_size_px
        for enlarge in (False, True)
    }
    assert taken_px == {False: (640, 352), True: (1280, 704)}
    assert not settings.enlarge
    # What is larger is made smaller, either way.
    assert OnnxDetector(path, settings, (1920, 1080)).input_size_px == (1280, 736)
