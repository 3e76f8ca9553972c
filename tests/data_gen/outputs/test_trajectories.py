"""What do the faults do to the truth? Exact statistics on plain traffic."""

import math
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from data_gen.errors import DataGenError
from data_gen.outputs.track_scene import make_track_scene, write_folder_tracks, write_scenario_tracks
from data_gen.outputs.trajectories import SWAP_REACH_M, TrackFaults, TrueRows, disturb, read_truth_rows
from service.runs.inputs.trajectories import load_trajectories

STEP_US = 100_000


def ring(vehicles: int = 20, steps: int = 600, *, apart_m: float = 30.0) -> TrueRows:
    """Vehicles far apart that drive one behind the other."""
    step, number = np.meshgrid(np.arange(steps), np.arange(vehicles), indexing="ij")
    x_m = number * apart_m + step * 1.5
    rest = np.tile([0.0, math.pi, 15.0, 4.5, 1.8], (x_m.size, 1))
    return TrueRows(
        (step * STEP_US).ravel(), tuple(f"v{name}" for name in number.ravel()), np.column_stack((x_m.ravel(), rest))
    )


def meeting(pairs: int = 200) -> TrueRows:
    """Pairs that drive past each other 3.5 m apart, all at step 25, and pairs of pairs far apart."""
    step, number = np.meshgrid(np.arange(50), np.arange(2 * pairs), indexing="ij")
    way = np.where(number % 2, -1.0, 1.0)
    x_m = (number // 2) * 500.0 + way * (step - 25)
    values = np.stack((x_m, 1.75 * way, np.where(way > 0, 0.0, math.pi)), axis=-1).reshape(-1, 3)
    rest = np.tile([10.0, 4.5, 1.8], (len(values), 1))
    return TrueRows(
        (step * STEP_US).ravel(), tuple(f"v{name}" for name in number.ravel()), np.column_stack((values, rest))
    )


def tracks_by_vehicle(truth: TrueRows, faults: TrackFaults, seed: int = 1) -> dict[str, list[tuple[int, str]]]:
    tracks = disturb(truth, faults, seed=seed)
    found: dict[str, list[tuple[int, str]]] = {}
    for t_us, vehicle, track in zip(tracks.rows.t_us.tolist(), tracks.rows.vehicles, tracks.ids, strict=True):
        found.setdefault(vehicle, []).append((t_us, track))
    return found


def test_without_faults_the_tracks_are_the_truth() -> None:
    truth = ring()
    tracks = disturb(truth, TrackFaults(), seed=3)
    assert (tracks.rows.values == truth.values).all()
    assert tracks.rows.vehicles == truth.vehicles
    assert len(set(zip(tracks.rows.vehicles, tracks.ids, strict=True))) == len(set(tracks.ids)) == 20


def test_noise_has_the_sigma_that_was_asked_for_and_nothing_else_changes() -> None:
    truth = ring(50)
    faults = TrackFaults(position_sigma_m=0.3, heading_sigma_rad=0.05, speed_sigma_mps=0.5)
    error = disturb(truth, faults, seed=1).rows.values - truth.values
    error[:, 2] = np.angle(np.exp(1j * error[:, 2]))
    # 30,000 rows: the estimate of sigma is off by 0.4 % (one sigma), that of the mean by 0.6 % of sigma.
    assert error.std(axis=0)[:4] == pytest.approx([0.3, 0.3, 0.05, 0.5], rel=0.02)
    assert (np.abs(error.mean(axis=0)[:4]) < 0.03 * np.array([0.3, 0.3, 0.05, 0.5])).all()
    assert (error[:, 4:] == 0).all()


def test_noisy_headings_stay_within_half_a_turn() -> None:
    heading_rad = disturb(ring(), TrackFaults(heading_sigma_rad=0.2), seed=1).rows.values[:, 2]
    assert (heading_rad > -math.pi).all()
    assert (heading_rad <= math.pi).all()
    assert (heading_rad < 0).any()


def test_misses_take_the_share_that_was_asked_for() -> None:
    truth = ring(50)
    tracks = disturb(truth, TrackFaults(miss_share=0.05), seed=1)
    assert 1 - len(tracks.ids) / len(truth.vehicles) == pytest.approx(0.05, abs=0.005)
    assert len(set(tracks.ids)) == 50


def test_gaps_come_as_often_as_was_asked_for_and_last_as_long() -> None:
    truth = ring(200)
    tracks = disturb(truth, TrackFaults(gaps_per_minute=2.0, gap_us=2_000_000), seed=1)
    minutes = 200 * 1.0 - len(tracks.gaps) * 2 / 60
    assert len(tracks.gaps) / minutes == pytest.approx(2.0, rel=0.15)
    assert all(end_us - start_us == 2_000_000 for _, start_us, end_us in tracks.gaps)
    kept = set(zip(tracks.rows.vehicles, tracks.rows.t_us.tolist(), strict=True))
    first_us = {gap: -(-gap[1] // STEP_US) * STEP_US for gap in tracks.gaps}
    hidden = {(gap[0], t_us) for gap in tracks.gaps for t_us in range(first_us[gap], min(gap[2], 60_000_000), STEP_US)}
    assert not kept & hidden
    assert len(kept) + len(hidden) == len(truth.vehicles)


@pytest.mark.parametrize("keeps_ids", [False, True])
def test_after_a_gap_there_is_a_new_id_or_the_old_one(keeps_ids: bool) -> None:
    faults = TrackFaults(gaps_per_minute=2.0, gap_us=1_000_000, keeps_ids=keeps_ids)
    for rows in tracks_by_vehicle(ring(), faults).values():
        for (before_us, before), (after_us, after) in pairwise(rows):
            assert (before == after) == (keeps_ids or after_us - before_us == STEP_US)


def test_swaps_happen_only_between_close_vehicles_where_they_are_nearest() -> None:
    truth = meeting()
    tracks = disturb(truth, TrackFaults(swap_share=1.0), seed=1)
    assert len(tracks.swaps) == 200
    assert {swap.t_us for swap in tracks.swaps} == {25 * STEP_US}
    assert all(swap.apart_m == pytest.approx(3.5) for swap in tracks.swaps)
    assert all(abs(int(a[1:]) - int(b[1:])) == 1 for a, b in (swap.vehicles for swap in tracks.swaps))
    for rows in tracks_by_vehicle(truth, TrackFaults(swap_share=1.0)).values():
        changed = [t_us for (_, before), (t_us, after) in pairwise(rows) if before != after]
        assert changed == [25 * STEP_US]


def test_swaps_exchange_ids_and_invent_none() -> None:
    found = tracks_by_vehicle(meeting(3), TrackFaults(swap_share=1.0))
    assert [found["v0"][0][1], found["v1"][0][1]] == [found["v1"][-1][1], found["v0"][-1][1]]


def test_swaps_take_the_share_of_encounters_that_was_asked_for() -> None:
    assert len(disturb(meeting(1000), TrackFaults(swap_share=0.2), seed=1).swaps) == pytest.approx(200, abs=45)


def test_vehicles_that_never_come_near_never_swap() -> None:
    assert disturb(ring(apart_m=SWAP_REACH_M + 0.1), TrackFaults(swap_share=1.0), seed=1).swaps == ()


def test_who_leaves_and_comes_back_has_a_new_id() -> None:
    truth = ring(2, 30)
    kept = [
        row for row in range(60) if truth.vehicles[row] == "v1" or not 10 * STEP_US <= truth.t_us[row] < 12 * STEP_US
    ]
    partly = TrueRows(truth.t_us[kept], tuple(truth.vehicles[row] for row in kept), truth.values[kept])
    ids = {vehicle: {track for _, track in rows} for vehicle, rows in tracks_by_vehicle(partly, TrackFaults()).items()}
    assert {vehicle: len(names) for vehicle, names in ids.items()} == {"v0": 2, "v1": 1}


def test_one_fault_does_not_disturb_another() -> None:
    truth = ring()
    alone = disturb(truth, TrackFaults(gaps_per_minute=2, gap_us=1_000_000), seed=7)
    both = disturb(truth, TrackFaults(gaps_per_minute=2, gap_us=1_000_000, position_sigma_m=1, swap_share=0.5), seed=7)
    assert alone.gaps == both.gaps
    assert alone.ids == both.ids


def test_another_seed_gives_other_faults() -> None:
    faults = TrackFaults(gaps_per_minute=2, gap_us=1_000_000)
    assert disturb(ring(), faults, seed=1).gaps == disturb(ring(), faults, seed=1).gaps
    assert disturb(ring(), faults, seed=1).gaps != disturb(ring(), faults, seed=2).gaps


@pytest.mark.parametrize(
    ("faults", "message"),
    [
        ({"miss_share": 1.5}, "miss_share: expected 0 to 1, got 1.5"),
        ({"position_sigma_m": -1.0}, "position_sigma_m: expected a number >= 0, got -1.0"),
        ({"gaps_per_minute": 1.0}, "expected a rate and a length of gaps, or neither, got 1.0 a minute of 0 us"),
    ],
)
def test_impossible_faults_are_refused(faults: dict[str, float], message: str) -> None:
    with pytest.raises(DataGenError, match=message):
        TrackFaults(**faults)  # type: ignore[arg-type]  # mixed numbers


def test_a_scenario_becomes_a_folder_that_can_be_processed_and_evaluated(tmp_path: Path) -> None:
    scene = make_track_scene("motorway", seed=1, duration_us=3_000_000, out_dir=tmp_path / "a", rate_hz=5, in_view=True)
    write_scenario_tracks(scene, tmp_path / "a" / "t.csv", TrackFaults(position_sigma_m=0.3, swap_share=0.5))
    files = {path.name for path in (tmp_path / "a").iterdir()}
    assert files == {"t.csv", "site.toml", "network.net.xml", "truth.csv", "truth_events.jsonl"}
    read = load_trajectories(tmp_path / "a" / "t.csv")
    assert set(np.diff(read.times_us).tolist()) == {200_000}
    assert Counter(read.t_us.tolist()) == Counter(scene.rows.t_us.tolist())
    again = write_folder_tracks(tmp_path / "a", tmp_path / "b" / "t.csv", seed=1, rate_hz=5)
    assert Counter(again.rows.vehicles) == Counter(scene.rows.vehicles)
    assert (tmp_path / "b" / "truth_events.jsonl").read_bytes() == scene.folder.joinpath(
        "truth_events.jsonl"
    ).read_bytes()


@pytest.mark.long
def test_the_same_arguments_give_the_same_bytes(tmp_path: Path) -> None:
    written = []
    for name in "ab":
        scene = make_track_scene("motorway", seed=2, duration_us=1_000_000, out_dir=tmp_path / name)
        faults = TrackFaults(position_sigma_m=0.3, miss_share=0.1, gaps_per_minute=30, gap_us=300_000, swap_share=0.5)
        write_scenario_tracks(scene, tmp_path / name / "t.csv", faults)
        written.append({path.name: path.read_bytes() for path in (tmp_path / name).iterdir()})
    assert written[0] == written[1]


def test_a_rate_that_does_not_divide_a_second_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataGenError, match="rate: expected a divisor of 1000, in rows per second, got 7"):
        make_track_scene("motorway", seed=1, duration_us=1_000_000, out_dir=tmp_path, rate_hz=7)


def test_a_folder_without_truth_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataGenError, match=r"expected the folder of a scene with truth.csv, got none there"):
        write_folder_tracks(tmp_path, tmp_path / "t.csv", seed=1, rate_hz=None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t_us,id\n1,a\n", "expected the columns of a truth file, got KeyError"),
        ("t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m,visible\n", "expected at least one visible row"),
    ],
)
def test_a_bad_truth_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataGenError, match=message):
        read_truth_rows(path)
