"""Scores of tracks: cases small enough to be done by hand, and none at all."""

import numpy as np
import pytest

from service.questions.scoring.pairs import Pairs, assign, box_pairs, ground_pairs
from service.questions.scoring.tracks import TrackRows, TrackScore, score_tracks
from tests.cases import for_each


def on_a_line(*tracks_by_frame: dict[int, float]) -> tuple[TrackRows, np.ndarray]:
    """Put tracks at places on a line, frame by frame: {track: x_m}."""
    table = [(frame, track, x_m) for frame, one in enumerate(tracks_by_frame) for track, x_m in one.items()]
    frame, track, x_m = np.array(table, np.float64).reshape(-1, 3).T
    return TrackRows(frame.astype(np.int64), track.astype(np.int64)), np.column_stack((x_m, np.zeros(len(x_m))))


def score(true: list[dict[int, float]], found: list[dict[int, float]]) -> TrackScore:
    (true_rows, true_m), (found_rows, found_m) = on_a_line(*true), on_a_line(*found)
    pairs = ground_pairs(true_rows.frame, true_m, found_rows.frame, found_m, reach_m=4.0)
    return score_tracks(true_rows, found_rows, pairs)


STILL = [{0: 0.0, 1: 50.0}] * 4


def test_perfect_tracks_have_no_fault() -> None:
    result = score(STILL, STILL)
    assert (result.hota, result.idf1, result.mota, result.id_switches, result.fragmentations) == (1, 1, 1, 0, 0)


def test_swapped_names_switch_twice_and_halve_the_identity() -> None:
    result = score(STILL, [{0: 0.0, 1: 50.0}] * 2 + [{1: 0.0, 0: 50.0}] * 2)
    assert (result.id_switches, result.idf1, result.det_a) == (2, 0.5, 1.0)
    assert result.ass_a == pytest.approx(2 / 6)  # 2 frames together out of 4 + 4 - 2


def test_gap_is_a_fragmentation_and_a_new_name_after_it_a_switch() -> None:
    kept = score([{0: 0.0, 1: 50.0}] * 3, [{0: 0.0, 1: 50.0}, {1: 50.0}, {0: 0.0, 1: 50.0}])
    renamed = score([{0: 0.0, 1: 50.0}] * 3, [{0: 0.0, 1: 50.0}, {1: 50.0}, {2: 0.0, 1: 50.0}])
    assert (kept.fragmentations, kept.id_switches) == (1, 0)
    assert (renamed.fragmentations, renamed.id_switches) == (1, 1)


def test_match_is_kept_although_another_object_is_nearer() -> None:
    result = score([{0: 0.0}] * 2, [{0: 0.1, 1: 1.0}, {0: 0.9, 1: 0.0}])
    assert result.id_switches == 0


def test_localisation_is_the_similarity_of_matches() -> None:
    assert score([{0: 0.0}] * 4, [{0: 0.4}] * 4).loc_a == pytest.approx((18 * 0.9 + 1) / 19)  # no match at .95: 1


@pytest.mark.parametrize(("true", "found"), [(STILL, []), ([], STILL), ([], [])])
def test_an_empty_side_scores_nothing(true: list[dict[int, float]], found: list[dict[int, float]]) -> None:
    result = score(true, found)
    assert (result.hota, result.idf1, result.id_switches) == (0, 0, 0)
    assert result.mota == (-8 if found else 0)


@for_each("seed", range(10))
def test_ground_pairs_are_all_those_within_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames, others = np.sort(rng.integers(0, 5, 40)), np.sort(rng.integers(0, 5, 30))
    here_m, there_m = rng.uniform(-100, 100, (40, 2)), rng.uniform(-100, 100, (30, 2))
    pairs = ground_pairs(frames, here_m, others, there_m, reach_m=30.0)
    distance_m = np.linalg.norm(here_m[:, None] - there_m[None], axis=-1)
    row, column = np.nonzero((frames[:, None] == others[None]) & (distance_m < 30.0))
    assert (pairs.true_row.tolist(), pairs.found_row.tolist()) == (row.tolist(), column.tolist())
    np.testing.assert_allclose(pairs.similarity, 1 - distance_m[row, column] / 30.0)


def test_boxes_that_only_touch_are_no_pair() -> None:
    frame, box_px = np.array([0]), np.array([[0.0, 0.0, 10.0, 10.0]])
    assert len(box_pairs(frame, box_px, frame, box_px + np.array([10.0, 0.0, 0.0, 0.0]))) == 0


def test_nothing_to_assign_is_no_error() -> None:
    nothing = np.zeros(0, np.int64)
    assert len(assign(Pairs(nothing, nothing, np.zeros(0)), nothing, np.zeros(0))) == 0
