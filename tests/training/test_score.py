"""Scores of weights: how far off the edges of what is found are."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed")

from training.score import SPARED, WRONG, edge_errors, edge_noise, judged, outlines
from vision.networks.box_detector import ImageBoxes


def boxes(rows: list[tuple[float, float, float, float]], scores: list[float]) -> ImageBoxes:
    told, count = np.array(rows), len(rows)
    angle, number = np.zeros(count), np.zeros(count, np.intp)
    return ImageBoxes(told[:, :2], told[:, 2:], angle, np.zeros(count, np.bool_), np.array(scores), number)


def test_what_is_found_is_right_wrong_or_beside_the_question() -> None:
    truth = np.array([(50.0, 50, 40, 20, 0), (200, 50, 40, 20, 0)])
    found = boxes([(52, 50, 40, 20), (50, 51, 40, 20), (201, 50, 40, 20), (120, 50, 40, 20)], [0.9, 0.8, 0.7, 0.6])
    assert judged(found, outlines(truth), np.array([True, False])).tolist() == [0, WRONG, SPARED, WRONG]


def test_edges_are_compared_along_the_axes_of_the_vehicle() -> None:
    truth = np.array([(50.0, 50, 40, 20, 0), (50, 50, 40, 20, np.pi / 2)])
    found = boxes([(52, 50, 40, 20), (50, 52, 44, 20)], [0.9, 0.9])
    assert edge_errors(found, truth) == pytest.approx(np.array([(0.05, 0, 0.05, 0), (0.1, 0, 0, 0)]), abs=1e-9)


def test_the_noise_of_edges_is_found_again_in_what_was_drawn_with_it() -> None:
    rng = np.random.default_rng(1)
    scores = rng.uniform(0.3, 1, 4000)
    errors = np.interp(scores, (0, 1), (0.3, 0.05))[:, None] * rng.standard_t(4, (4000, 4))
    assert edge_noise(scores, errors) == pytest.approx([0.3, 0.05], abs=0.01)
