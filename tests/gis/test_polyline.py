"""Lines, rings, parallels and what is neither."""

from __future__ import annotations

import numpy as np
import pytest

from gis.errors import GisError
from gis.polyline import across, as_polyline, as_ring, counter_clockwise, mitres, offset


def test_a_line_becomes_read_only_and_keeps_no_repeated_vertices() -> None:
    line_m = as_polyline([[0, 0], [1, 0], [1, 0], [2, 0]], where="lane 'a'")
    assert line_m.tolist() == [[0, 0], [1, 0], [2, 0]]
    with pytest.raises(ValueError, match="read-only"):
        line_m[0] = 5.0


def test_a_ring_is_opened() -> None:
    assert len(as_ring([[0, 0], [1, 0], [1, 1], [0, 0]], where="junction 'c'")) == 3


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("here", "expected points as [[x, y], ...] in metres, got 'here'"),
        ([[1, 2], [3]], "expected points as [[x, y], ...] in metres, got [[1, 2], [3]]"),
        ([1, 2], "expected points of shape (n, 2), got shape (2,)"),
        ([[0, 0], [1, np.nan]], "expected finite coordinates, got [[1.0, nan]]"),
        ([[1, 1], [1, 1]], "expected a line of at least 2 different points, got [[1.0, 1.0]]"),
    ],
    ids=["text", "ragged", "flat", "nan", "one point"],
)
def test_what_is_no_line_is_an_error(points: object, message: str) -> None:
    with pytest.raises(GisError) as caught:
        as_polyline(points, where="lane 'a'")  # type: ignore[arg-type]  # the wrong input is the point of the test
    assert str(caught.value) == f"lane 'a': {message}"


def test_an_outline_of_two_points_is_an_error() -> None:
    with pytest.raises(GisError, match=r"junction 'c': expected an outline of at least 3 different points, got"):
        as_ring([[0, 0], [1, 0], [0, 0]], where="junction 'c'")


def test_offset_there_and_back_is_the_same_line() -> None:
    line_m = np.array([[0.0, 0.0], [10.0, 1.0], [20.0, 8.0], [22.0, 20.0]])
    np.testing.assert_allclose(offset(offset(line_m, 3.0), -3.0), line_m, atol=1e-12)


def test_the_mitre_of_a_hairpin_stays_short() -> None:
    hairpin_m = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 0.001]])
    assert np.hypot(*mitres(hairpin_m).T).max() <= 5.0


def test_across_has_a_sign_and_goes_on_past_both_ends() -> None:
    line_m = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    points_m = np.array([[-5.0, 2.0], [12.0, 30.0], [5.0, -1.0], [13.0, -4.0]])
    assert across(line_m, points_m).tolist() == [2.0, -2.0, -1.0, -5.0]


def test_a_clockwise_ring_is_turned_round() -> None:
    ring_m = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert counter_clockwise(ring_m) is ring_m
    assert counter_clockwise(ring_m[::-1]).tolist() == ring_m.tolist()
