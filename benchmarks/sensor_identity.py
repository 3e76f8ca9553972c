"""Two sensors on one view: is what both see of a car one car, and does it outlive the gaps of each?

Each sensor has tracks of its own with noise and sizes of their own, and loses every car three times a minute for 4 s,
at times of its own. Found is what the cars say that are seen; true is every vehicle that either sensor sees, or every
one in view.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.kept_identity import NamedRows, follow
from benchmarks.lost_tracks import Case, Place, lose_tracks
from data_gen.outputs.track_scene import TrackScene
from data_gen.outputs.trajectories import NoisyTracks, TrueRows
from service.questions.scoring.pairs import Pairs
from service.questions.scoring.tracks import TrackRows, score_tracks
from service.runs.inputs.sites.site import load_site

SENSORS = ("colour", "thermal")
_CASE = Case(gap_s=4.0)
SENSOR_TITLES = (
    *("scene", "IDF1 seen", "of the better sensor alone", "IDF1 in view", "of the better sensor alone"),
    *("joins", "wrong joins", "links", "wrong links"),
)

Row = tuple[int, int, str]
"""A row of a vehicle or car: scene, time, name."""


@dataclass(frozen=True, slots=True)
class SensorRow:
    """Hold the figures of one kind of scene.

    Attributes
    ----------
    seen_idf1, view_idf1 : against what either sensor sees, and against all in view. alone_* : of the better sensor.
    joins, wrong_joins, links, wrong_links : as of `NamedRows`, with both sensors.
    """

    scene: str
    seen_idf1: float
    alone_seen_idf1: float
    view_idf1: float
    alone_view_idf1: float
    joins: int
    wrong_joins: int
    links: int
    wrong_links: int

    def cells(self) -> list[str]:
        """Write the cells of a table."""
        shares = (self.seen_idf1, self.alone_seen_idf1, self.view_idf1, self.alone_view_idf1)
        counts = (self.joins, self.wrong_joins, self.links, self.wrong_links)
        return [self.scene, *(f"{share:.4f}" for share in shares), *(str(count) for count in counts)]


def score_sensors(name: str, scenes: Sequence[TrackScene], place: Place) -> SensorRow:
    """Let anchoring follow the tracks of two sensors together and one at a time, all scenes of a kind in one score."""
    both: list[NamedRows] = []
    alone: list[list[NamedRows]] = [[], []]
    for scene in scenes:
        site = load_site(scene.folder / "site.toml")
        each = two_sensors(scene, place)
        for found, tracks in zip(alone, each, strict=True):
            found.append(follow(tracks, site.network, site.anchoring))
        together, sensors = taken_together(each)
        both.append(follow(together, site.network, site.anchoring, sensors=sensors))
    in_view = [(k, t_us, one) for k, scene in enumerate(scenes) for t_us, one in _keys(scene.rows)]
    seen = [
        (k, t_us, one)
        for k, named in enumerate(both)
        for t_us, one in zip(named.t_us.tolist(), named.vehicles, strict=True)
    ]
    return SensorRow(
        name,
        pooled_idf1(seen, both),
        max(pooled_idf1(seen, one) for one in alone),
        pooled_idf1(in_view, both),
        max(pooled_idf1(in_view, one) for one in alone),
        sum(one.joins for one in both),
        sum(one.wrong_joins for one in both),
        sum(one.links for one in both),
        sum(len(one.wrong_links) for one in both),
    )


def two_sensors(scene: TrackScene, place: Place) -> list[NoisyTracks]:
    """Make the tracks of both; no name is of both."""
    tracks = [lose_tracks(scene.rows, _CASE, place, seed=scene.seed + 1000 * k) for k in range(len(SENSORS))]
    named = zip(SENSORS, tracks, strict=True)
    return [replace(one, ids=tuple(f"{sensor}/{track}" for track in one.ids)) for sensor, one in named]


def taken_together(each: Sequence[NoisyTracks]) -> tuple[NoisyTracks, tuple[str, ...]]:
    """Lay the rows of all sensors together in the order of time, and tell the sensor of each."""
    t_us = np.concatenate([one.rows.t_us for one in each])
    order = np.argsort(t_us, kind="stable")
    vehicles = [vehicle for one in each for vehicle in one.rows.vehicles]
    ids = [track for one in each for track in one.ids]
    values = np.concatenate([one.rows.values for one in each])
    rows = TrueRows(t_us[order], tuple(vehicles[row] for row in order.tolist()), values[order])
    names = tuple(ids[row] for row in order.tolist())
    return NoisyTracks(rows, names, (), ()), tuple(name.partition("/")[0] for name in names)


def pooled_idf1(true: Sequence[Row], found: Sequence[NamedRows]) -> float:
    """Score cars, one set of rows a scene, against vehicles; a car is where the track is that it is linked to."""
    row_of = {row: place for place, row in enumerate(dict.fromkeys(true))}
    cars = {
        ((k, t_us, symbol), (k, t_us, vehicle))
        for k, named in enumerate(found)
        for t_us, vehicle, symbol in zip(named.t_us.tolist(), named.vehicles, named.symbols, strict=True)
        if symbol
    }
    listed = sorted(cars)
    pairs = sorted((row_of[vehicle], place) for place, (_, vehicle) in enumerate(listed))
    true_row, found_row = np.array(pairs, np.int64).reshape(-1, 2).T
    sides = _rows([*row_of]), _rows([car for car, _ in listed])
    frames = np.unique([frame for side in sides for frame in side[0]], return_inverse=True)[1]
    true_frames, found_frames = np.split(frames.astype(np.int64), [len(row_of)])
    score = score_tracks(
        TrackRows(true_frames, sides[0][1]),
        TrackRows(found_frames, sides[1][1]),
        Pairs(true_row, found_row, np.ones(len(pairs))),
    )
    return score.idf1


def _keys(rows: TrueRows) -> list[tuple[int, str]]:
    return list(zip(rows.t_us.tolist(), rows.vehicles, strict=True))


def _rows(rows: Sequence[Row]) -> tuple[list[int], np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Number the frames so that scenes lie apart, and the names."""
    names = np.unique([f"{k}/{name}" for k, _, name in rows], return_inverse=True)[1].astype(np.int64)
    return [k * 10**12 + t_us for k, t_us, _ in rows], names
