"""How well does a car keep its symbol while nobody sees it? Follow lost tracks with anchoring, and count.

An *absence* is a time in which a vehicle that had a car is not seen, between two *stretches* in which it is; there are
no others in these tracks than gaps, hidden places and the edge of the view. It is *right* if the symbol at the end of
the stretch after it is the one at the end of the stretch before it, *wrong* if it is one that another vehicle has had,
else *new*. A stretch after an absence that is shorter than `SHORTEST_US` and has no car says nothing.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anchoring.adapter import Anchored, AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.settings import AnchoringSettings
from benchmarks.lost_tracks import STEP_US, trajectories_of
from data_gen.trajectories import NoisyTracks
from dyknow.sample import Sample
from gis.road_network import RoadNetwork
from service.scoring.pairs import Pairs
from service.scoring.tracks import TrackRows, score_tracks

IntArray = NDArray[np.int64]

SHORTEST_US = 1_000_000
NO_CAR = ""


@dataclass(frozen=True, slots=True)
class WrongLink:
    """Say that the track of one vehicle was taken for the car of another.

    Attributes
    ----------
    t_us : when. vision_id : the track. is_validated : whether the hypothesis ended as validated.
    """

    t_us: int
    vision_id: str
    is_validated: bool


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Hold what was said of tracks.

    Attributes
    ----------
    t_us : (n,) of the rows, ascending. vehicles : n true vehicles. ids : n names of tracks.
    symbols : n car symbols as given at the time, `NO_CAR` where there was none.
    links : how often a lost car was found again. wrong_links : those to another vehicle's track.
    frame_ms : (f,) processor time of each frame.
    """

    t_us: IntArray
    vehicles: tuple[str, ...]
    ids: tuple[str, ...]
    symbols: tuple[str, ...]
    links: int = 0
    wrong_links: tuple[WrongLink, ...] = ()
    frame_ms: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Returns:
    """Count absences by what became of the symbol."""

    right: int = 0
    wrong: int = 0
    new: int = 0

    def __add__(self, other: Returns) -> Returns:
        return Returns(self.right + other.right, self.wrong + other.wrong, self.new + other.new)

    @property
    def count(self) -> int:
        """Return how many there were."""
        return self.right + self.wrong + self.new


def follow(tracks: NoisyTracks, network: RoadNetwork | None, settings: AnchoringSettings | None = None) -> Followed:
    """Let anchoring follow tracks; it sees nothing of the truth.

    Parameters
    ----------
    tracks : of `lose_tracks`. network : the roads. settings : as shipped if left out.
    """
    unit = AnchoringUnit(Anchorer(network, settings))
    said: list[Anchored] = []
    frame_ms: list[float] = []
    for objects in trajectories_of(tracks):
        start_s = time.process_time()
        said += [one.value for one in unit.update(Sample(objects.t_us, objects.t_us, objects))]
        frame_ms.append((time.process_time() - start_s) * 1000)
    symbol_of = {
        (one.cars.t_us, vision_id): car
        for one in said
        for car, vision_id, is_seen in zip(one.cars.ids, one.cars.vision_ids, one.cars.linked.tolist(), strict=True)
        if is_seen
    }
    rows = list(zip(tracks.rows.t_us.tolist(), tracks.ids, strict=True))
    vehicle_of = dict(zip(rows, tracks.rows.vehicles, strict=True))
    links, wrong = _judge_links(said, vehicle_of)
    return Followed(
        t_us=tracks.rows.t_us,
        vehicles=tracks.rows.vehicles,
        ids=tracks.ids,
        symbols=tuple(symbol_of.get(row, NO_CAR) for row in rows),
        links=links,
        wrong_links=wrong,
        frame_ms=tuple(frame_ms),
    )


def _judge_links(said: Sequence[Anchored], vehicle_of: dict[tuple[int, str], str]) -> tuple[int, tuple[WrongLink, ...]]:
    """Count the links that found a lost car again, and list the wrong ones with what became of them."""
    of_world: dict[str, str] = {}  # whose car a world object has been last
    links = 0
    wrong: dict[str, tuple[int, str]] = {}  # by the label's beginning, which names the two that are linked
    validated: set[str] = set()
    for one in said:
        for change in (change for change in one.link_changes if change.level == "world"):
            vehicle = vehicle_of.get((change.t_us, change.lower))
            if change.kind == "reestablished":
                links += 1
                if of_world[change.upper] != vehicle:
                    wrong[f"{change.lower}->{change.upper}"] = change.t_us, change.lower
            if change.kind in ("established", "reestablished") and vehicle is not None:
                of_world[change.upper] = vehicle
        validated.update(label.partition("#")[0] for label in one.validated)
    return links, tuple(WrongLink(*link, is_validated=pair in validated) for pair, link in wrong.items())


def count_returns(followed: Followed) -> Returns:
    """Count what became of the symbols of vehicles that were not seen for a while."""
    bearers = _first_bearers(followed)
    returns = Returns()
    for vehicle, rows in _rows_of(followed.vehicles).items():
        stretches = np.split(rows, np.flatnonzero(np.diff(followed.t_us[rows]) > STEP_US) + 1)
        symbols = [_last_symbol(followed, one) for one in stretches]
        for before, after, stretch in zip(symbols, symbols[1:], stretches[1:], strict=False):
            start_us, end_us = followed.t_us[stretch[[0, -1]]].tolist()
            if before != NO_CAR and (after != NO_CAR or end_us - start_us >= SHORTEST_US):
                others = (since_us for other, since_us in bearers.get(after, {}).items() if other != vehicle)
                returns += _judge(before, after, is_anothers=any(since_us < start_us for since_us in others))
    return returns


def _judge(before: str, after: str, *, is_anothers: bool) -> Returns:
    if after == before:
        return Returns(right=1)
    return Returns(wrong=1) if is_anothers else Returns(new=1)


def _last_symbol(followed: Followed, rows: IntArray) -> str:
    return next((followed.symbols[row] for row in rows[::-1].tolist() if followed.symbols[row]), NO_CAR)


def _first_bearers(followed: Followed) -> dict[str, dict[str, int]]:
    """Tell of each symbol which vehicles have had it, and since when."""
    bearers: dict[str, dict[str, int]] = {}
    for t_us, vehicle, symbol in zip(followed.t_us.tolist(), followed.vehicles, followed.symbols, strict=True):
        if symbol != NO_CAR:
            bearers.setdefault(symbol, {}).setdefault(vehicle, t_us)
    return bearers


def _rows_of(names: Sequence[str]) -> dict[str, IntArray]:
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
    return {name: np.array(places, np.int64) for name, places in rows.items()}


def revise(followed: Followed) -> tuple[str, ...]:
    """Give every row the symbol that its track has at its end: names dated back, and revised.

    With exchanged names a track is of two vehicles, and this gives one of them the symbol of the other.
    """
    symbols = np.array(followed.symbols, dtype=object)
    for rows in _rows_of(followed.ids).values():
        symbols[rows] = _last_symbol(followed, rows)
    return tuple(symbols.tolist())


def idf1(scenes: Sequence[tuple[Followed, Sequence[str]]]) -> float:
    """Score the symbols of the rows of several scenes as if they were one long one.

    Parameters
    ----------
    scenes : what was followed, and the symbol of each of its rows.
    """
    true_names = [f"{place}/{name}" for place, (followed, _) in enumerate(scenes) for name in followed.vehicles]
    found_names = [f"{place}/{name}" if name else "" for place, (_, names) in enumerate(scenes) for name in names]
    # All times apart, so that scenes do not lie over each other.
    t_us = np.concatenate([followed.t_us + place * 10**12 for place, (followed, _) in enumerate(scenes)])
    frame = np.unique(t_us, return_inverse=True)[1].astype(np.int64)
    named = np.flatnonzero([bool(name) for name in found_names])
    true = TrackRows(frame, _numbered(true_names))
    found = TrackRows(frame[named], _numbered([found_names[row] for row in named.tolist()]))
    return score_tracks(true, found, Pairs(named, np.arange(len(named)), np.ones(len(named)))).idf1


def _numbered(names: Sequence[str]) -> IntArray:
    return np.unique(np.array(names, dtype=np.str_), return_inverse=True)[1].astype(np.int64)
