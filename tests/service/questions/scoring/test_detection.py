"""Detections against the truth: what is right, wrong, missed, and neither."""

import itertools
import math

import numpy as np
import pytest

from benchmarks.pooled_scores import join_scenes
from service.questions.scoring.detection import REACH_M, DetectionScore, score_detection, score_settled_tracks, settle
from service.questions.scoring.object_rows import ObjectRows
from tests.cases import for_each
from tests.service.questions.scoring.support import Row, rows


def score(true: ObjectRows, found: ObjectRows) -> DetectionScore:
    return score_detection(settle(true, found))


def counts(true: ObjectRows, found: ObjectRows) -> tuple[int, int, int, int]:
    result = score(true, found)
    return result.right, result.wrong, result.missed, result.border


def test_found_within_two_metres_is_right() -> None:
    assert counts(rows([(0, "a", 0, 0)]), rows([(0, "v1", 1.9, 0)])) == (1, 0, 0, 0)


def test_farther_off_is_wrong_and_missed() -> None:
    assert counts(rows([(0, "a", 0, 0)]), rows([(0, "v1", 2.1, 0)])) == (0, 1, 1, 0)


def test_another_frame_does_not_count() -> None:
    assert counts(rows([(0, "a", 0, 0)]), rows([(1, "v1", 0, 0)])) == (0, 1, 1, 0)


def test_second_object_on_one_vehicle_is_wrong() -> None:
    assert counts(rows([(0, "a", 0, 0)]), rows([(0, "v1", 0.5, 0), (0, "v2", -1.0, 0)])) == (1, 1, 0, 0)


def test_more_pairs_are_better_than_nearer_ones() -> None:
    true, found = rows([(0, "a", 0, 0), (0, "b", 1.9, 0)]), rows([(0, "v1", 0.1, 0), (0, "v2", -1.8, 0)])
    assert counts(true, found) == (2, 0, 0, 0)


def test_border_vehicle_is_neither_missed_nor_right() -> None:
    true = rows([(0, "a", 0, 0)], border=[0])
    assert counts(true, rows([])) == (0, 0, 0, 0)
    assert counts(true, rows([(0, "v1", 0, 0)])) == (0, 0, 0, 1)


def test_border_excuses_what_is_found_on_its_whole_footprint_and_no_more() -> None:
    """The part of a truck that is in view has its centre far from the truck's."""
    true = rows([(0, "a", 0, 0)], border=[0], length_m=16.0)
    assert counts(true, rows([(0, "v1", 9.9, 0)])) == (0, 0, 0, 1)
    assert counts(true, rows([(0, "v1", 10.1, 0)])) == (0, 1, 0, 0)


def test_object_cut_by_the_view_may_be_right_but_is_never_wrong() -> None:
    true, cut = rows([(0, "a", 0, 0)]), rows([(0, "v1", 1, 0), (0, "v2", 50, 0)], border=[0, 1])
    assert counts(true, cut) == (1, 0, 0, 1)


def test_border_vehicle_takes_no_object_from_one_that_counts() -> None:
    true = rows([(0, "a", 0, 0), (0, "b", 1.0, 0)], border=[0])
    assert counts(true, rows([(0, "v1", 0.1, 0)])) == (1, 0, 0, 0)


def test_standing_vehicles_have_a_recall_of_their_own() -> None:
    true = rows([(0, "a", 0, 0), (1, "a", 0, 0), (0, "b", 30, 0)], standing=[0, 1])
    result = score(true, rows([(0, "v1", 0, 0), (0, "v2", 30, 0)]))
    assert (result.standing_right, result.standing_missed) == (1, 1)
    assert result.standing_recall == 0.5
    assert result.recall == pytest.approx(2 / 3)


def test_errors_are_those_of_right_rows_only() -> None:
    true = rows([(k, "a", 0, 0) for k in range(20)])
    found = rows([(k, "v1", 0.1 * k, 0) for k in range(20)] + [(0, "v2", 500, 0)])
    result = score(true, found)
    assert result.mean_error_m == pytest.approx(0.95)
    assert result.most_error_m == pytest.approx(np.percentile(np.arange(20) * 0.1, 95))


def test_nothing_at_all_has_no_shares() -> None:
    result = score(rows([]), rows([]))
    assert (result.precision, result.recall, result.standing_recall) == (None, None, None)
    assert math.isnan(result.mean_error_m)
    assert result.as_record()["mean_error_m"] is None


def best_by_trying(true: list[Row], found: list[Row]) -> tuple[int, float]:
    """Return the most matches of one frame, and the least sum of distances among those, by trying all."""
    best = (0, 0.0)
    for size in range(min(len(true), len(found)), 0, -1):
        for some in itertools.combinations(true, size):
            for others in itertools.permutations(found, size):
                distances = [math.dist(one[2:], other[2:]) for one, other in zip(some, others, strict=True)]
                if max(distances) < REACH_M and (best[0] < size or sum(distances) < best[1]):
                    best = (size, sum(distances))
        if best[0]:
            return best
    return best


@for_each("seed", range(20))
def test_matching_is_the_best_there_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true, found = (
        [
            (frame, f"{side}{k}", *rng.uniform(0, 5, 2).tolist())
            for frame in range(4)
            for k in range(int(rng.integers(0, 5)))
        ]
        for side in "tv"
    )
    settled = settle(rows(true), rows(found))
    for frame in range(4):
        of_frame = settled.true.frame[settled.true_row] == frame
        expected = best_by_trying([one for one in true if one[0] == frame], [one for one in found if one[0] == frame])
        assert of_frame.sum() == expected[0]
        assert settled.distance_m[of_frame].sum() == pytest.approx(expected[1])


def test_tracks_are_scored_without_the_border() -> None:
    true = rows([(0, "a", 0, 0), (1, "a", 1, 0), (0, "b", 50, 0)], border=[2])
    found = rows([(0, "v1", 0, 0), (1, "v1", 1, 0), (0, "v2", 50, 0)])
    tracks = score_settled_tracks(settle(true, found))
    assert (tracks.idf1, tracks.hota, tracks.true_rows, tracks.found_rows) == (1.0, 1.0, 2, 2)


def test_two_metres_are_the_limit_of_idf1_too() -> None:
    true = rows([(0, "a", 0, 0)])
    assert score_settled_tracks(settle(true, rows([(0, "v1", 1.99, 0)]))).idf1 == 1.0
    assert score_settled_tracks(settle(true, rows([(0, "v1", 2.01, 0)]))).idf1 == 0.0


def test_joined_scenes_keep_frames_and_names_apart() -> None:
    scene = rows([(0, "a", 0, 0), (1, "a", 1, 0)]), rows([(0, "v1", 0, 0), (1, "v1", 1, 0)])
    other = rows([(0, "a", 9, 0)]), rows([])
    settled = settle(*join_scenes([scene, scene, other]))
    tracks, detection = score_settled_tracks(settled), score_detection(settled)
    assert (tracks.true_tracks, tracks.found_tracks, tracks.id_switches) == (3, 2, 0)
    assert (detection.right, detection.wrong, detection.missed) == (4, 0, 1)
