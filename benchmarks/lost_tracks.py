"""What do tracks look like when cars get lost? Cases: gaps of some seconds, and places in which nobody is seen.

*gap N*: three gaps a minute of each vehicle, N seconds long. *hidden N*: nobody is seen inside a strip across the road,
or a disc around the middle of a junction, of N metres, as under a bridge. *plain*: neither. After each the tracker
gives another name. Every track is noisy, and measures its vehicle too large or too small all the time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from data_gen.outputs.trajectories import NoisyTracks, TrackFaults, TrueRows, disturb
from service.runs.inputs.trajectories import Trajectories

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STEP_US = 100_000
GAPS_PER_MINUTE = 3.0
NOISE = TrackFaults(position_sigma_m=0.3, heading_sigma_rad=0.03, speed_sigma_mps=0.3)
LENGTH_BIAS_M, WIDTH_BIAS_M = 0.3, 0.1
"""Standard deviations of what a track adds to the size of its vehicle, for as long as it lives."""
LEAST_SIZE_M = 0.3
_BIAS_SEED = 0xB1A5
"""Tells the sizes' source of randomness from that of the faults."""


@dataclass(frozen=True, slots=True)
class Case:
    """Say how cars get lost.

    Attributes
    ----------
    gap_s : length of gaps; 0 for none. hidden_m : size of the place where nobody is seen; 0 for none.
    """

    gap_s: float = 0.0
    hidden_m: float = 0.0

    @property
    def name(self) -> str:
        """Return the text that `read_case` reads."""
        if self.gap_s:
            return f"gap {self.gap_s:g}"
        return f"hidden {self.hidden_m:g}" if self.hidden_m else "plain"


@dataclass(frozen=True, slots=True)
class Place:
    """Say where something covers the road: a strip across it, or a disc."""

    x_m: float
    y_m: float
    is_disc: bool

    def covers(self, centre_m: FloatArray, size_m: float) -> BoolArray:
        """Tell which centres, (n, 2), lie in the place; a strip runs north and is ``size_m`` wide."""
        offset_m = centre_m - (self.x_m, self.y_m)
        away_m = np.hypot(*offset_m.T) if self.is_disc else np.abs(offset_m[:, 0])
        return np.asarray(away_m < size_m / 2)


def read_case(text: str) -> Case:
    """Read the name of a case.

    Parameters
    ----------
    text : "plain", "gap SECONDS" or "hidden METRES".

    Raises
    ------
    ValueError
        If it is none of these.
    """
    if text == "plain":
        return Case()
    found = re.fullmatch(r"(gap|hidden) (\d+(?:\.\d+)?)", text)
    if not found or float(found[2]) == 0:
        raise ValueError(f"case: expected 'plain', 'gap SECONDS' or 'hidden METRES', got {text!r}")
    return Case(gap_s=float(found[2])) if found[1] == "gap" else Case(hidden_m=float(found[2]))


def lose_tracks(truth: TrueRows, case: Case, place: Place, *, seed: int, swap_share: float = 0.0) -> NoisyTracks:
    """Make tracks of the truth, and lose them.

    Parameters
    ----------
    truth : what a perfect tracker would see, a row a vehicle and `STEP_US`.
    case : how they are lost. place : where, if cars are hidden.
    seed : the same seed gives the same tracks. swap_share : part of the encounters at which two exchange their names.

    Returns
    -------
    The tracks, sorted by time.
    """
    faults = replace(NOISE, swap_share=swap_share)
    if case.gap_s:
        faults = replace(faults, gaps_per_minute=GAPS_PER_MINUTE, gap_us=round(case.gap_s * 1e6))
    seen = ~place.covers(truth.values[:, :2], case.hidden_m)
    tracks = disturb(_select(truth, seen), faults, seed=seed)
    ids = _new_names_after_holes(tracks.rows.t_us, tracks.ids)
    return replace(tracks, ids=ids, rows=_with_biased_sizes(tracks.rows, ids, seed=seed))


def trajectories_of(tracks: NoisyTracks, sensors: tuple[str, ...] = ()) -> Trajectories:
    """Give tracks, without the truth that they were made of, the form in which a trajectory file is read.

    Parameters
    ----------
    tracks : of `lose_tracks`. sensors : one a row, if there are several.
    """
    order = np.lexsort((np.array(tracks.ids), tracks.rows.t_us))
    ids = tuple(tracks.ids[row] for row in order.tolist())
    seen_by = tuple(sensors[row] for row in order.tolist()) if sensors else ()
    return Trajectories(tracks.rows.t_us[order], ids, tracks.rows.values[order], sensors=seen_by)


def _select(rows: TrueRows, which: BoolArray) -> TrueRows:
    kept = np.flatnonzero(which)
    return TrueRows(rows.t_us[kept], tuple(rows.vehicles[row] for row in kept.tolist()), rows.values[kept])


def _new_names_after_holes(t_us: NDArray[np.int64], ids: tuple[str, ...]) -> tuple[str, ...]:
    """Give another name to a track that comes back: `disturb` sees no hole where nobody at all is seen."""
    last_us: dict[str, int] = {}
    pieces: dict[str, int] = {}
    renamed = []
    for now_us, name in zip(t_us.tolist(), ids, strict=True):
        if now_us - last_us.get(name, now_us) > STEP_US:
            pieces[name] = pieces.get(name, 1) + 1
        last_us[name] = now_us
        renamed.append(f"{name}.{pieces[name]}" if name in pieces else name)
    return tuple(renamed)


def _with_biased_sizes(rows: TrueRows, ids: tuple[str, ...], *, seed: int) -> TrueRows:
    names, track = np.unique(np.array(ids), return_inverse=True)
    bias_m = np.random.default_rng((seed, _BIAS_SEED)).normal(size=(len(names), 2)) * (LENGTH_BIAS_M, WIDTH_BIAS_M)
    values = rows.values.copy()
    values[:, 4:6] = np.maximum(values[:, 4:6] + bias_m[track], LEAST_SIZE_M)
    return replace(rows, values=values)
