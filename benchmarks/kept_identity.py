"""How well does a car keep its symbol while nobody sees it? Give lost tracks to anchoring, and count.

An *absence* is a time in which a vehicle that had a car is not seen, between two *stretches* in which it is; there are
no others in these tracks than gaps, hidden places and the edge of the view. It is *right* if the symbol at the end of
the stretch after it is the one at the end of the stretch before it, *wrong* if it is one that another vehicle has had,
else *new*. A stretch after an absence that is shorter than `SHORTEST_US` and has no car says nothing.
"""

from __future__ import annotations

import gc
import time
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anchoring.adapter import Anchored, AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.settings import AnchoringSettings
from benchmarks.lost_tracks import STEP_US, trajectories_of
from data_gen.outputs.trajectories import NoisyTracks
from dyknow.sample import Sample
from gis.roads.road_network import RoadNetwork
from service.questions.scoring.pairs import Pairs
from service.questions.scoring.tracks import TrackRows, score_tracks

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
class NamedRows:
    """Hold the names that were given to rows of tracks.

    Attributes
    ----------
    t_us : (n,) of the rows, ascending. vehicles : n true vehicles. ids : n names of tracks.
    symbols : n car symbols as in the log, `NO_CAR` where there is none.
    links : how often a lost car was found again. wrong_links : those to another vehicle's track.
    right_undecided : how many of the others ended undecided.
    frame_ms : (f,) processor time of each frame.
    joins, wrong_joins : how often a track of another sensor was joined to a car; to that of another vehicle.
    """

    t_us: IntArray
    vehicles: tuple[str, ...]
    ids: tuple[str, ...]
    symbols: tuple[str, ...]
    links: int = 0
    wrong_links: tuple[WrongLink, ...] = ()
    right_undecided: int = 0
    frame_ms: tuple[float, ...] = ()
    joins: int = 0
    wrong_joins: int = 0


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


def follow(
    tracks: NoisyTracks,
    network: RoadNetwork | None,
    settings: AnchoringSettings | None = None,
    *,
    sensors: tuple[str, ...] = (),
) -> NamedRows:
    """Let anchoring follow tracks; it sees nothing of the truth.

    Parameters
    ----------
    tracks : of `lose_tracks`. network : the roads. settings : as shipped if left out. sensors : one a row, if there
        are several.
    """
    unit = AnchoringUnit(Anchorer(network, settings))
    said: list[Anchored] = []
    frame_ms: list[float] = []
    gc.freeze()  # no frame pays for a walk of the garbage collector over the modules and the scenes
    for objects in trajectories_of(tracks, sensors):
        start_s = time.process_time()
        said += [one.value for one in unit.update(Sample(objects.t_us, objects.t_us, objects))]
        frame_ms.append((time.process_time() - start_s) * 1000)
    gc.unfreeze()
    symbol_of = {
        (cars.t_us, vision_id): car
        for one in said
        for cars in (*one.former, one.cars)  # as in the log, which has the rows from before a car had its name
        for car, vision_id, is_seen in zip(cars.ids, cars.vision_ids, cars.linked.tolist(), strict=True)
        if is_seen
    }
    rows = list(zip(tracks.rows.t_us.tolist(), tracks.ids, strict=True))
    vehicle_of = dict(zip(rows, tracks.rows.vehicles, strict=True))
    links, wrong, right_undecided = _judge_links(said, vehicle_of)
    joins = _judge_joins(said, vehicle_of)
    return NamedRows(
        t_us=tracks.rows.t_us,
        vehicles=tracks.rows.vehicles,
        ids=tracks.ids,
        symbols=tuple(symbol_of.get(row, NO_CAR) for row in rows),
        links=links,
        wrong_links=wrong,
        right_undecided=right_undecided,
        frame_ms=tuple(frame_ms),
        joins=len(joins),
        wrong_joins=joins.count(False),
    )


def _judge_links(
    said: Sequence[Anchored], vehicle_of: Mapping[tuple[int, str], str]
) -> tuple[int, tuple[WrongLink, ...], int]:
    """Count the links that found a lost car again; list the wrong ones; count the others that ended undecided."""
    before: dict[str, str] = {}  # and whose before it was found again
    last_of: dict[str, str] = {}  # whose car a world object has been last
    found: set[str] = set()  # labels
    wrong: dict[str, tuple[int, str]] = {}  # by the label
    validated: set[str] = set()
    undecided: set[str] = set()
    rows = _VehiclesByTrack(vehicle_of)
    for one in said:
        for change in (change for change in one.link_changes if change.level == "world"):
            vehicle = rows.vehicle_at(change.lower, change.t_us)
            if change.kind == "reestablished":
                found.add(change.label)
                before[change.upper] = last_of[change.upper]
                if last_of[change.upper] != vehicle:
                    wrong[change.label] = change.t_us, change.lower
            # A link that is taken over leaves the car as it was lost; only faults of motion are of fluents.
            if change.kind == "refuted" and not change.failed:
                last_of[change.upper] = before.get(change.upper, last_of[change.upper])
            # What is refuted goes back to the vehicle that it was linked to, whatever its track did since.
            if change.kind in ("established", "reestablished", "lost"):
                last_of[change.upper] = vehicle
        validated |= set(one.hypotheses.validated)
        undecided |= set(one.hypotheses.undecided)
    links = tuple(WrongLink(*link, is_validated=label in validated) for label, link in wrong.items())
    return len(found), links, len((found & undecided) - wrong.keys())


def _judge_joins(said: Sequence[Anchored], vehicle_of: Mapping[tuple[int, str], str]) -> list[bool]:
    """Tell of every track that was joined to a car whether it is of the vehicle whose track that car had then."""
    lead: dict[str, str] = {}
    joins: list[bool] = []
    rows = _VehiclesByTrack(vehicle_of)
    for change in (change for one in said for change in one.link_changes if change.level == "world"):
        if change.kind in ("established", "reestablished"):
            lead[change.upper] = change.lower
        elif change.kind == "joined":
            names = change.lower, lead[change.upper]
            joins.append(len({rows.vehicle_at(name, change.t_us) for name in names}) == 1)
    return joins


class _VehiclesByTrack:
    """Know which vehicle a track was on; after exchanged names it is on another one."""

    def __init__(self, vehicle_of: Mapping[tuple[int, str], str]) -> None:
        self._rows: dict[str, list[tuple[int, str]]] = {}
        for (t_us, track), vehicle in sorted(vehicle_of.items()):
            self._rows.setdefault(track, []).append((t_us, vehicle))

    def vehicle_at(self, track: str, t_us: int) -> str:
        """Return the vehicle of the track's last row until then; "" for no track."""
        rows = self._rows.get(track, [])
        place = bisect_right(rows, t_us, key=lambda row: row[0])
        return rows[place - 1][1] if place else ""


def count_returns(named: NamedRows, *, step_us: int = STEP_US) -> Returns:
    """Count what became of the symbols of vehicles that were not seen for longer than from row to row."""
    bearers = _first_bearers(named)
    returns = Returns()
    for vehicle, rows in _rows_of(named.vehicles).items():
        stretches = np.split(rows, np.flatnonzero(np.diff(named.t_us[rows]) > step_us) + 1)
        symbols = [_last_symbol(named, one) for one in stretches]
        for before, after, stretch in zip(symbols, symbols[1:], stretches[1:], strict=False):
            start_us, end_us = named.t_us[stretch[[0, -1]]].tolist()
            if before != NO_CAR and (after != NO_CAR or end_us - start_us >= SHORTEST_US):
                others = (since_us for other, since_us in bearers.get(after, {}).items() if other != vehicle)
                returns += _judge(before, after, is_anothers=any(since_us < start_us for since_us in others))
    return returns


def _judge(before: str, after: str, *, is_anothers: bool) -> Returns:
    if after == before:
        return Returns(right=1)
    return Returns(wrong=1) if is_anothers else Returns(new=1)


def _last_symbol(named: NamedRows, rows: IntArray) -> str:
    return next((named.symbols[row] for row in rows[::-1].tolist() if named.symbols[row]), NO_CAR)


def _first_bearers(named: NamedRows) -> dict[str, dict[str, int]]:
    """Tell of each symbol which vehicles have had it, and since when."""
    bearers: dict[str, dict[str, int]] = {}
    for t_us, vehicle, symbol in zip(named.t_us.tolist(), named.vehicles, named.symbols, strict=True):
        if symbol != NO_CAR:
            bearers.setdefault(symbol, {}).setdefault(vehicle, t_us)
    return bearers


def _rows_of(names: Sequence[str]) -> dict[str, IntArray]:
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
    return {name: np.array(places, np.int64) for name, places in rows.items()}


def revise(named: NamedRows) -> tuple[str, ...]:
    """Give every row the symbol that its track has at its end: names dated back, and revised.

    With exchanged names a track is of two vehicles, and this gives one of them the symbol of the other.
    """
    symbols = np.array(named.symbols, dtype=object)
    for rows in _rows_of(named.ids).values():
        symbols[rows] = _last_symbol(named, rows)
    return tuple(symbols.tolist())


def idf1(scenes: Sequence[tuple[NamedRows, Sequence[str]]]) -> float:
    """Score the symbols of the rows of several scenes as if they were one long one.

    Parameters
    ----------
    scenes : their rows, and the symbol of each of them.
    """
    true_names = [f"{place}/{name}" for place, (named, _) in enumerate(scenes) for name in named.vehicles]
    found_names = [f"{place}/{name}" if name else "" for place, (_, names) in enumerate(scenes) for name in names]
    # All times apart, so that scenes do not lie over each other.
    t_us = np.concatenate([named.t_us + place * 10**12 for place, (named, _) in enumerate(scenes)])
    frame = np.unique(t_us, return_inverse=True)[1].astype(np.int64)
    is_named = np.flatnonzero([bool(name) for name in found_names])
    true = TrackRows(frame, _numbered(true_names))
    found = TrackRows(frame[is_named], _numbered([found_names[row] for row in is_named.tolist()]))
    return score_tracks(true, found, Pairs(is_named, np.arange(len(is_named)), np.ones(len(is_named)))).idf1


def _numbered(names: Sequence[str]) -> IntArray:
    return np.unique(np.array(names, dtype=np.str_), return_inverse=True)[1].astype(np.int64)
