"""What would a tracker make of the truth, on a bad day? Noisy, gappy, id-swapping tracks without a single pixel.

Each fault has a source of randomness of its own, so changing one of them leaves the others as they are.

* *noise*: white, on position, heading and speed.
* *misses*: single rows that are left out.
* *gaps*: a track is lost for a fixed time, at random moments; after it the vehicle has a new identifier, or the old
  one.
* *swaps*: two vehicles within 6 m exchange identifiers when they are nearest to each other.

Whoever leaves the view and comes back has a new identifier, whatever the faults.
"""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from data_gen.errors import DataGenError
from data_gen.simulation.states import BoolArray, FloatArray, IntArray, VehicleStates, written

COLUMNS = ("t_us", "id", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m")
SWAP_REACH_M = 6.0
"""Centres nearer than this can be taken for each other."""


@dataclass(frozen=True, slots=True)
class TrackFaults:
    """How bad the tracks are; all zero is the truth."""

    position_sigma_m: float = 0.0
    """Standard deviation of x and of y."""
    heading_sigma_rad: float = 0.0
    speed_sigma_mps: float = 0.0
    miss_share: float = 0.0
    """Part of the rows that is missing, 0 to 1."""
    gaps_per_minute: float = 0.0
    """Mean number of gaps in a minute of a vehicle that is seen; the gaps themselves do not count as seen."""
    gap_us: int = 0
    swap_share: float = 0.0
    """Part of the encounters at which two vehicles exchange identifiers, 0 to 1."""
    keeps_ids: bool = False
    """After a gap the old identifier comes back."""

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        for field in fields(self):
            value = getattr(self, field.name)
            largest = 1.0 if field.name.endswith("_share") else math.inf
            if not (math.isfinite(value) and 0 <= value <= largest):
                expected = "0 to 1" if largest == 1.0 else "a number >= 0"
                raise DataGenError(f"track faults: {field.name}: expected {expected}, got {value!r}")
        if (self.gaps_per_minute > 0) != (self.gap_us > 0):
            raise DataGenError(
                "track faults: expected a rate and a length of gaps, or neither, "
                f"got {self.gaps_per_minute!r} a minute of {self.gap_us!r} us"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TrueRows:
    """Where vehicles were, one row a vehicle and time, sorted by time."""

    t_us: IntArray
    """(n,)."""
    vehicles: tuple[str, ...]
    values: FloatArray
    """(n, 6): x_m, y_m, heading_rad, speed_mps, length_m, width_m."""


@dataclass(frozen=True, slots=True)
class Swap:
    """Two vehicles that exchanged identifiers."""

    t_us: int
    vehicles: tuple[str, str]
    apart_m: float
    """Between the centres."""


@dataclass(frozen=True, slots=True, eq=False)
class NoisyTracks:
    """Tracks, and what was done to the truth to get them."""

    rows: TrueRows
    """The disturbed rows; `vehicles` still names the true ones."""
    ids: tuple[str, ...]
    """Of the tracks, one a row."""
    gaps: tuple[tuple[str, int, int], ...]
    """Vehicle, start and end of each gap, half-open."""
    swaps: tuple[Swap, ...]


def rows_of_states(states: Sequence[VehicleStates], seen: Sequence[BoolArray], *, every: int = 1) -> TrueRows:
    """Take the rows of a simulation that are seen.

    Parameters
    ----------
    states : in order of time.
    seen : for each step (n,), which of its vehicles are seen.
    every : take each so manieth step.

    Returns
    -------
    The rows.
    """
    kept = [(step, np.flatnonzero(mask)) for step, mask in list(zip(states, seen, strict=True))[::every]]
    values = [step.poses()[rows] for step, rows in kept]
    return TrueRows(
        t_us=np.concatenate([np.full(len(rows), step.t_us, dtype=np.int64) for step, rows in kept]),
        vehicles=tuple(step.ids[row] for step, rows in kept for row in rows.tolist()),
        values=np.concatenate(values),
    )


def read_truth_rows(path: Path, *, rate_hz: int | None = None) -> TrueRows:
    """Read the visible rows of a `truth.csv`.

    Parameters
    ----------
    path : the file.
    rate_hz : keep the first time of each period; all times if it is left out.

    Returns
    -------
    The rows.

    Raises
    ------
    DataGenError
        If the file cannot be read, lacks a column or has no visible row.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            lines = [row for row in csv.DictReader(file) if row["visible"] == "1"]
        t_us = np.array([int(row["t_us"]) for row in lines], dtype=np.int64)
        values = np.array([[float(row[name]) for name in COLUMNS[2:]] for row in lines], dtype=np.float64)
    except OSError as error:
        raise DataGenError(f"{path}: expected a readable truth file, got {error.strerror or error}") from error
    except (KeyError, ValueError, TypeError) as error:
        raise DataGenError(f"{path}: expected the columns of a truth file, got {error!r}") from error
    if not len(t_us):
        raise DataGenError(f"{path}: expected at least one visible row, got none")
    kept = np.ones(len(t_us), dtype=np.bool_) if rate_hz is None else _first_of_period(t_us, rate_hz)
    places = np.flatnonzero(kept)
    places = places[np.argsort(t_us[places], kind="stable")]
    return TrueRows(t_us[places], tuple(lines[place]["id"] for place in places.tolist()), values[places])


def _first_of_period(t_us: IntArray, rate_hz: int) -> BoolArray:
    times_us = np.unique(t_us)
    _, first = np.unique(times_us * rate_hz // 1_000_000, return_index=True)
    return np.isin(t_us, times_us[first])


def disturb(truth: TrueRows, faults: TrackFaults, *, seed: int) -> NoisyTracks:
    """Make tracks of the truth.

    Parameters
    ----------
    truth : what a perfect tracker would see.
    faults : what goes wrong.
    seed : the same seed gives the same tracks.

    Returns
    -------
    The tracks, sorted by time.

    Examples
    --------
    >>> truth = TrueRows(np.array([0, 100_000]), ("a", "a"), np.array([[0.0, 0, 0, 10, 4, 2], [1.0, 0, 0, 10, 4, 2]]))
    >>> disturb(truth, TrackFaults(), seed=1).ids
    ('t1', 't1')
    """
    noise_rng, miss_rng, gap_rng, swap_rng = np.random.default_rng(np.random.SeedSequence(seed)).spawn(4)
    lost, gaps = _gaps(truth, faults, gap_rng)
    swaps = _swaps(truth, lost, faults, swap_rng)
    ids = _name_tracks(truth, lost, swaps, keeps_ids=faults.keeps_ids)
    missed = miss_rng.random(len(truth.t_us)) < faults.miss_share
    values = _with_noise(truth.values, faults, noise_rng)
    kept = np.flatnonzero(~lost & ~missed)
    rows = TrueRows(truth.t_us[kept], tuple(truth.vehicles[row] for row in kept.tolist()), values[kept])
    return NoisyTracks(rows, tuple(ids[row] for row in kept.tolist()), gaps, swaps)


def write_tracks(path: Path, tracks: NoisyTracks) -> None:
    """Write a trajectory file, sorted by time and track.

    Parameters
    ----------
    path : the file; columns as in `COLUMNS`.
    tracks : to write.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for t_us, track, values in zip(tracks.rows.t_us.tolist(), tracks.ids, tracks.rows.values.tolist(), strict=True):
            writer.writerow((t_us, track, *written(values)))


def _with_noise(values: FloatArray, faults: TrackFaults, rng: np.random.Generator) -> FloatArray:
    sigma = (faults.position_sigma_m, faults.position_sigma_m, faults.heading_sigma_rad, faults.speed_sigma_mps)
    noisy = values.copy()
    noisy[:, :4] += rng.normal(size=(len(values), 4)) * sigma
    # Into (-pi, pi]; the truth already is.
    over = np.abs(noisy[:, 2]) > math.pi
    noisy[over, 2] = -(np.mod(math.pi - noisy[over, 2], math.tau) - math.pi)
    return noisy


def _gaps(
    truth: TrueRows, faults: TrackFaults, rng: np.random.Generator
) -> tuple[BoolArray, tuple[tuple[str, int, int], ...]]:
    """Mark the rows in gaps, and list the gaps that hide at least one row."""
    lost = np.zeros(len(truth.t_us), dtype=np.bool_)
    if faults.gaps_per_minute == 0:
        return lost, ()
    gaps: list[tuple[str, int, int]] = []
    mean_us = 60_000_000 / faults.gaps_per_minute
    for vehicle, rows in _rows_by_vehicle(truth).items():
        times_us = truth.t_us[rows]
        start_us = int(times_us[0]) + int(rng.exponential(mean_us))
        while start_us <= times_us[-1]:
            inside = (times_us >= start_us) & (times_us < start_us + faults.gap_us)
            if inside.any():
                lost[rows[inside]] = True
                gaps.append((vehicle, start_us, start_us + faults.gap_us))
            start_us += faults.gap_us + int(rng.exponential(mean_us))
    return lost, tuple(sorted(gaps, key=lambda gap: (gap[1], gap[0])))


def _rows_by_vehicle(truth: TrueRows) -> dict[str, IntArray]:
    rows: dict[str, list[int]] = {}
    for row, vehicle in enumerate(truth.vehicles):
        rows.setdefault(vehicle, []).append(row)
    return {vehicle: np.array(places, dtype=np.int64) for vehicle, places in rows.items()}


def _swaps(truth: TrueRows, lost: BoolArray, faults: TrackFaults, rng: np.random.Generator) -> tuple[Swap, ...]:
    """Draw at which encounters two vehicles exchange identifiers: once a stretch within reach, where it is nearest."""
    if faults.swap_share == 0:
        return ()
    nearest: dict[tuple[str, str], Swap] = {}
    done: list[Swap] = []
    for _, rows in _steps(truth):
        seen = rows[~lost[rows]]
        near: dict[tuple[str, str], float] = {}
        for a, b in cKDTree(truth.values[seen, :2]).query_pairs(SWAP_REACH_M, output_type="ndarray").tolist():
            first, second = sorted((truth.vehicles[seen[a]], truth.vehicles[seen[b]]))
            near[first, second] = float(np.hypot(*(truth.values[seen[a], :2] - truth.values[seen[b], :2])))
        done += [nearest.pop(pair) for pair in list(nearest) if pair not in near]
        for pair, apart_m in near.items():
            if pair not in nearest or apart_m < nearest[pair].apart_m:
                nearest[pair] = Swap(int(truth.t_us[rows[0]]), pair, apart_m)
    encounters = sorted([*done, *nearest.values()], key=lambda swap: (swap.t_us, swap.vehicles))
    drawn = rng.random(len(encounters)) < faults.swap_share
    return tuple(swap for swap, is_drawn in zip(encounters, drawn.tolist(), strict=True) if is_drawn)


def _steps(truth: TrueRows) -> list[tuple[int, IntArray]]:
    times_us, starts = np.unique(truth.t_us, return_index=True)
    parts = np.split(np.arange(len(truth.t_us), dtype=np.int64), starts[1:])
    return list(zip(times_us.tolist(), parts, strict=True))


def _name_tracks(truth: TrueRows, lost: BoolArray, swaps: Sequence[Swap], *, keeps_ids: bool) -> list[str]:
    """Give each row its track: a new one for whoever comes, or comes back."""
    track: dict[str, str] = {}
    was_lost: set[str] = set()
    there: set[str] = set()
    due = {swap.t_us: [one for one in swaps if one.t_us == swap.t_us] for swap in swaps}
    ids = [""] * len(truth.t_us)
    count = 0
    for t_us, rows in _steps(truth):
        here = {truth.vehicles[row] for row in rows.tolist()}
        for row in rows.tolist():
            vehicle = truth.vehicles[row]
            if lost[row]:
                was_lost.add(vehicle)
            elif vehicle not in track or vehicle not in there or (vehicle in was_lost and not keeps_ids):
                count += 1
                track[vehicle] = f"t{count}"
            if not lost[row]:
                was_lost.discard(vehicle)
        for swap in due.get(t_us, ()):
            a, b = swap.vehicles
            track[a], track[b] = track[b], track[a]
        for row in rows.tolist():
            ids[row] = track.get(truth.vehicles[row], "")
        there = here
    return ids
