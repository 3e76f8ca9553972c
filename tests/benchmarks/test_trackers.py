"""The comparison of trackers: its traffic is such as it says, and our tracker follows it."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks import bench_trackers
from benchmarks.bench_trackers import CHOSEN, OURS, OURS_ANCHORED, SWEEPS
from benchmarks.tracked_traffic import DIFFICULTIES, LANE_M, LANES, VIEW_M, DetectedTraffic, make_traffic


def traffic(difficulty: str = "base", seed: int = 1, seconds: int = 8) -> DetectedTraffic:
    return make_traffic(DIFFICULTIES[difficulty], seed=seed, seconds=seconds)


def test_same_seed_gives_the_same_traffic() -> None:
    one, same, other = traffic(), traffic(), traffic(seed=2)
    assert np.array_equal(one.found_m, same.found_m)
    assert not np.array_equal(one.true_m[:100], other.true_m[:100])


@pytest.mark.parametrize("name", DIFFICULTIES)
def test_traffic_is_as_bad_as_it_says(name: str) -> None:
    difficulty, made = DIFFICULTIES[name], traffic(name, seconds=20)
    assert made.frame_count == 20 * difficulty.frames_per_s
    false = difficulty.false_per_frame * made.frame_count
    found = (1 - difficulty.miss_share) * len(made.true_frame) + false
    assert len(made.found_frame) == pytest.approx(found, abs=4 * np.sqrt(found))


def test_cars_of_a_lane_keep_their_distance_and_stay_in_view() -> None:
    made = traffic(seconds=20)
    assert ((made.true_m >= 0) & (made.true_m < (VIEW_M, LANES * LANE_M))).all()
    for frame in range(0, made.frame_count, 50):
        centre_m = made.true_m[made.true_frame == frame]
        distance_m = np.linalg.norm(centre_m[:, None] - centre_m[None], axis=-1)
        assert distance_m[~np.eye(len(centre_m), dtype=bool)].min() > 2.0


def test_car_is_named_once_a_frame() -> None:
    made = traffic("hard", seconds=20)
    rows = np.column_stack((made.true_frame, made.true_car))
    assert len(np.unique(rows, axis=0)) == len(rows)


def test_our_tracker_follows_it_and_anchoring_takes_fewer_names() -> None:
    made = traffic()
    alone, _ = bench_trackers._score(bench_trackers._run_ours, [made], {})
    anchored, _ = bench_trackers._score(bench_trackers._run_anchored, [made], {})
    assert alone.idf1 > 0.8
    assert anchored.id_switches < alone.id_switches


def test_chosen_settings_are_of_the_sweep_and_each_sweep_is_as_long() -> None:
    assert {int(np.prod([len(values) for values in sweep.values()])) for sweep in SWEEPS.values()} == {12}
    for name, chosen in CHOSEN.items():
        assert chosen.keys() == SWEEPS[name].keys()
        assert all(value in SWEEPS[name][key] for key, value in chosen.items())


def test_peer_that_is_nowhere_is_left_out_and_said_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(bench_trackers._runners([])) == [OURS, OURS_ANCHORED]
    assert "norfair: in none of the environments of --peer-python, left out" in capsys.readouterr().err


def test_peer_gets_the_detections_and_its_rows_are_scored(monkeypatch: pytest.MonkeyPatch) -> None:
    """A peer that gives each detection back under one name."""

    def echo(_: Path, peer: str, detections: str, out: str, settings: str) -> subprocess.CompletedProcess[str]:
        assert (peer, json.loads(settings)) == ("norfair", {"keep_s": 1.0})
        stored = np.load(detections)
        frame = stored["found_frame"]
        np.savez(out, frame=frame, track=np.arange(len(frame)), centre_m=stored["found_m"], elapsed_s=2.0)
        return subprocess.CompletedProcess([], 0, "", "")

    monkeypatch.setattr(bench_trackers, "_peer", echo)
    made = traffic()
    runner = bench_trackers._PeerRunner(Path("python"), "norfair")
    score, frames_per_s = bench_trackers._score(runner, [made], {"keep_s": 1.0})
    assert score.found_rows == len(made.found_frame)
    assert frames_per_s == made.frame_count / 2.0
    assert score.idf1 < 0.1
    assert score.det_a > 0.7
