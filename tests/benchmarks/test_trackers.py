"""The comparison of trackers: its traffic is such as it says, and our tracker follows it."""

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks import bench_trackers, peer_trackers, tracker_runners
from benchmarks.bench_trackers import BEST, BEST_SHORT, CHOSEN, SHORT, SWEEPS, frame_ms, score
from benchmarks.tracked_traffic import DIFFICULTIES, LANE_M, LANES, VIEW_M, DetectedTraffic, make_traffic
from benchmarks.tracker_runners import OURS, OURS_ANCHORED, Followed, Job, Settings, run_anchored, run_ours
from vision.tracking.settings import TrackingSettings


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


def followed(made: DetectedTraffic, elapsed_s: float = 1.0, *, renamed_from: int | None = None) -> Followed:
    """Give the truth back as if a tracker had found it; from some frame on under other names."""
    late = 0 if renamed_from is None else 1000 * (made.true_frame >= renamed_from)
    return Followed(made.true_frame, made.true_car + late, made.true_m, elapsed_s)


@pytest.mark.long
def test_our_tracker_follows_it_and_anchoring_takes_fewer_names() -> None:
    made = traffic()
    alone, anchored = (score([(made, run([(made, {})])[0])]) for run in (run_ours, run_anchored))
    assert alone.idf1 > 0.8
    assert anchored.id_switches < alone.id_switches


def test_each_sweep_is_as_long_and_what_was_chosen_is_of_it() -> None:
    assert {int(np.prod([len(values) for values in sweep.values()])) for sweep in SWEEPS.values()} == {16}
    assert CHOSEN.keys() == SWEEPS.keys()
    for name, titled in CHOSEN.items():
        assert titled.keys() == ({BEST, BEST_SHORT} if name in SHORT else {BEST})
        for chosen in titled.values():
            assert chosen.keys() == SWEEPS[name].keys()
            assert all(value in SWEEPS[name][key] for key, value in chosen.items())


def test_peers_that_wait_as_long_as_ours_are_in_the_sweep() -> None:
    assert TrackingSettings().coast_us == 1_000_000
    assert "coast_us" not in SWEEPS[OURS]
    for name, (key, value) in SHORT.items():
        assert value in SWEEPS[name][key]
        assert CHOSEN[name][BEST_SHORT][key] == value


def test_sweep_finds_the_setting_that_keeps_names(capsys: pytest.CaptureFixture[str]) -> None:
    """A tracker that keeps all names only with one setting, and half the time with another."""
    made = traffic(seconds=4)
    renamed_from = {8.0: None, 6.0: 50}

    def run(jobs: Sequence[Job]) -> list[Followed]:
        return [
            followed(one, renamed_from=renamed_from[settings["distance_m"]] if settings["keep_s"] == 3.0 else 2)
            for one, settings in jobs
        ]

    best = bench_trackers._sweep("norfair", run, {"base": [made]})
    assert (best[BEST]["distance_m"], best[BEST]["keep_s"]) == (8.0, 3.0)
    assert best[BEST_SHORT]["keep_s"] == 1.0
    assert capsys.readouterr().err.count("mean IDF1") == 16


def test_scenes_are_scored_as_one_and_their_names_kept_apart() -> None:
    one, other = traffic(seconds=2), traffic(seed=2, seconds=2)
    perfect = score([(one, followed(one)), (other, followed(other))])
    assert (perfect.idf1, perfect.id_switches) == (1.0, 0)
    assert perfect.true_rows == len(one.true_frame) + len(other.true_frame)
    broken = score([(one, followed(one, renamed_from=25)), (other, followed(other))])
    seen_before = np.isin(one.true_car[one.true_frame == 25], one.true_car[one.true_frame < 25])
    assert broken.id_switches >= seen_before.sum() > 0


def test_cost_is_the_median_over_scenes() -> None:
    made = traffic(seconds=2)
    turns = [(made, followed(made, elapsed_s)) for elapsed_s in (0.05, 0.1, 9.0)]
    assert frame_ms(turns) == pytest.approx(2.0)


def test_table_compares_speed_with_the_first_contestant() -> None:
    made = traffic(seconds=2)

    def run(jobs: Sequence[Job]) -> list[Followed]:
        return [followed(one, settings.get("cost_s", 0.1)) for one, settings in jobs]

    contestants: dict[str, dict[str, Settings]] = {"a": {"as shipped": {}}, "b": {"best": {"cost_s": 0.3}}}
    lines = list(bench_trackers._lines([made], contestants, {"a": run, "b": run}))
    assert [line.split(" | ") for line in lines] == [
        ["a, as shipped", "1.000", "1.000", "0", "2.00", "1.0"],
        ["b, best", "1.000", "1.000", "0", "6.00", "3.0"],
    ]


def test_peer_that_is_nowhere_is_left_out_and_said_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(tracker_runners.find_runners([])) == [OURS, OURS_ANCHORED]
    assert "norfair: in none of the environments of --peer-python, left out" in capsys.readouterr().err


def test_peer_gets_the_detections_and_its_rows_are_scored(monkeypatch: pytest.MonkeyPatch) -> None:
    """A peer that gives each detection back under one name, run by the script that runs peers."""

    def echo(stored: Mapping[str, NDArray[np.float64]], settings: Mapping[str, float]) -> list[object]:
        assert settings == {"keep_s": 1.0}
        places = range(len(stored["found_frame"]))
        return [(stored["found_frame"][place], place, *stored["found_m"][place]) for place in places]

    def call(_: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr("sys.argv", ["peer_trackers.py", *arguments])
        peer_trackers.main()
        return subprocess.CompletedProcess([], 0, "", "")

    monkeypatch.setattr(peer_trackers, "norfair_rows", echo)
    monkeypatch.setattr(peer_trackers, "import_module", lambda _: None)
    monkeypatch.setattr(tracker_runners, "call_peer", call)
    first, second = traffic(seconds=2), traffic(seed=2, seconds=2)
    jobs = [(made, {"keep_s": 1.0}) for made in (first, second, first)]
    one, other, again = tracker_runners.PeerRunner(Path("python"), "norfair")(jobs)
    assert np.array_equal(one.centre_m, first.found_m)
    assert np.array_equal(again.frame, one.frame)
    found = score([(second, other)])
    assert found.found_rows == len(second.found_frame)
    assert found.idf1 < 0.1
    assert found.det_a > 0.7


def test_peer_that_fails_is_named_with_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = subprocess.CompletedProcess([], 1, "", "no such thing")
    monkeypatch.setattr(tracker_runners, "call_peer", lambda *_: broken)
    with pytest.raises(RuntimeError, match="norfair with 1 jobs: expected tracks, got 'no such thing'"):
        tracker_runners.PeerRunner(Path("python"), "norfair")([(traffic(seconds=2), {})])
