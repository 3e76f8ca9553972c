"""Tracks that get lost: as often, as long and where their case says, and always under another name."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.lost_tracks import (
    LENGTH_BIAS_M,
    NOISE,
    STEP_US,
    Case,
    Place,
    lose_tracks,
    read_case,
    trajectories_of,
)
from data_gen.outputs.trajectories import NoisyTracks, TrueRows

STRIP, DISC = Place(150.0, 0.0, is_disc=False), Place(150.0, 0.0, is_disc=True)


def drive(*, cars: int = 1, seconds: int = 30, speed_mps: float = 10.0) -> TrueRows:
    """Let cars drive east side by side, 20 m apart, from x = 0."""
    steps = seconds * 1_000_000 // STEP_US
    rows = [
        (step * STEP_US, f"c{car}", (speed_mps * step * STEP_US * 1e-6, 20.0 * car, 0.0, speed_mps, 4.5, 1.8))
        for step in range(steps)
        for car in range(cars)
    ]
    t_us, vehicles, values = zip(*rows, strict=True)
    return TrueRows(np.array(t_us), vehicles, np.array(values))


def names_of(tracks: NoisyTracks, vehicle: str) -> list[str]:
    """Give the names that the tracks of a vehicle have, in order of time."""
    pairs = zip(tracks.ids, tracks.rows.vehicles, strict=True)
    return list(dict.fromkeys(name for name, of in pairs if of == vehicle))


@pytest.mark.parametrize(
    ("text", "case"), [("plain", Case()), ("gap 4", Case(gap_s=4.0)), ("hidden 62.5", Case(hidden_m=62.5))]
)
def test_case_is_read_and_says_its_name(text: str, case: Case) -> None:
    assert read_case(text) == case
    assert case.name == text


@pytest.mark.parametrize("text", ["gap", "gap 0", "hidden -3", "hide 3", ""])
def test_case_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected 'plain', 'gap SECONDS' or 'hidden METRES'"):
        read_case(text)


def test_plain_tracks_are_whole_and_noisy() -> None:
    truth = drive(cars=3)
    tracks = lose_tracks(truth, Case(), STRIP, seed=1)
    assert tracks.rows.vehicles == truth.vehicles
    assert len(set(tracks.ids)) == 3
    off = tracks.rows.values[:, :4] - truth.values[:, :4]
    expected = (NOISE.position_sigma_m, NOISE.position_sigma_m, NOISE.heading_sigma_rad, NOISE.speed_sigma_mps)
    assert off.std(axis=0) == pytest.approx(expected, rel=0.1)


def test_gaps_are_as_long_as_the_case_says_and_three_a_minute() -> None:
    tracks = lose_tracks(drive(cars=20, seconds=60), Case(gap_s=4.0), STRIP, seed=1)
    holes_us = []
    for car in range(20):
        t_us = tracks.rows.t_us[np.array(tracks.rows.vehicles) == f"c{car}"]
        holes_us += np.diff(t_us)[np.diff(t_us) > STEP_US].tolist()
        assert len(names_of(tracks, f"c{car}")) == 1 + (np.diff(t_us) > STEP_US).sum()
    # Two gaps may follow at once; a gap of 4 s hides 40 rows, of which the first may be as late as a step.
    assert min(holes_us) >= 4_000_000
    assert np.median(holes_us) <= 4_100_000
    assert len(tracks.gaps) == pytest.approx(20 * 60 / (20 + 4), rel=0.25)


def test_nobody_is_seen_in_a_strip_however_far_to_the_side() -> None:
    truth = drive(cars=3)
    tracks = lose_tracks(truth, Case(hidden_m=60.0), STRIP, seed=1)
    seen = {(t_us, vehicle) for t_us, vehicle in zip(tracks.rows.t_us.tolist(), tracks.rows.vehicles, strict=True)}
    for t_us, vehicle, x_m in zip(truth.t_us.tolist(), truth.vehicles, truth.values[:, 0].tolist(), strict=True):
        assert ((t_us, vehicle) in seen) == (not 120.0 < x_m < 180.0)
    assert [len(names_of(tracks, f"c{car}")) for car in range(3)] == [2, 2, 2]


def test_disc_hides_only_who_comes_near_its_middle() -> None:
    tracks = lose_tracks(drive(cars=3), Case(hidden_m=60.0), DISC, seed=1)
    hidden = [300 - tracks.rows.vehicles.count(f"c{car}") for car in range(3)]
    # Chords of a circle of 30 m, at 0, 20 and 40 m from the middle, in metres and so in rows.
    assert hidden[0] == pytest.approx(60, abs=2)
    assert hidden[1] == pytest.approx(2 * np.sqrt(30**2 - 20**2), abs=2)
    assert hidden[2] == 0


def test_track_measures_its_vehicle_wrong_all_its_life_and_the_next_track_otherwise() -> None:
    tracks = lose_tracks(drive(cars=40), Case(hidden_m=60.0), STRIP, seed=1)
    ids, length_m = np.array(tracks.ids), tracks.rows.values[:, 4]
    of_track = [np.unique(length_m[ids == name]) for name in np.unique(ids)]
    assert all(len(one) == 1 for one in of_track)
    assert len(of_track) == 80
    assert np.std(np.concatenate(of_track)) == pytest.approx(LENGTH_BIAS_M, rel=0.25)


def test_same_seed_gives_the_same_tracks_and_the_case_leaves_the_noise_of_others_alone() -> None:
    truth = drive(cars=4)
    one, same = (lose_tracks(truth, Case(gap_s=2.0), STRIP, seed=5) for _ in range(2))
    assert one.ids == same.ids
    assert np.array_equal(one.rows.values, same.rows.values)
    other = lose_tracks(truth, Case(gap_s=2.0), STRIP, seed=6)
    assert one.gaps != other.gaps


def test_encounters_exchange_names_only_if_asked() -> None:
    truth = drive(cars=2)
    values = truth.values.copy()
    values[:, 1] = np.array(truth.vehicles) == "c1"
    values[:, 1] *= 2.0 + np.abs(truth.t_us * 1e-6 - 15.0)  # 2 m apart half way
    for swap_share, count in ((0.0, 1), (1.0, 2)):
        tracks = lose_tracks(replace(truth, values=values), Case(), STRIP, seed=1, swap_share=swap_share)
        assert len(names_of(tracks, "c0")) == count


def test_trajectories_hold_the_same_rows_without_the_truth() -> None:
    tracks = lose_tracks(drive(cars=12, seconds=5), Case(), STRIP, seed=1)
    found = {
        (objects.t_us, name): tuple(centre)
        for objects in trajectories_of(tracks)
        for name, centre in zip(objects.ids, objects.centre_m.tolist(), strict=True)
    }
    expected = zip(tracks.rows.t_us.tolist(), tracks.ids, tracks.rows.values[:, :2].tolist(), strict=True)
    assert found == {(t_us, name): tuple(centre) for t_us, name, centre in expected}
    assert not any(vehicle in {name for _, name in found} for vehicle in tracks.rows.vehicles)
