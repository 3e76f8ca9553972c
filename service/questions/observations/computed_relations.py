"""Which relation changes would a run have told that watched more? Computed from the cars that its log has.

The same observer looks at the same cars on the same roads as in the run, frame after frame. Each car is there while it
has its name, with its rows of before, up to its last row. One that nobody saw for a while stands where it was, unseen,
until it has rows again; then it is told where it was meanwhile.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from operator import itemgetter

import numpy as np

from anchoring.observations import nowhere
from gis.roads.road_network import RoadNetwork
from qsr.changes.line_up import Seen
from qsr.measuring.footprints import BODY, BoolArray, FloatArray, Footprints, LongArray, Rows, bodies, joined, on_roads
from service.questions.observations.identity import IdentityLink, chain_of, links_below
from service.records.runs import RunRecord
from service.records.seen import RelationRecord
from service.runs.graph.relations import relation_observer
from service.runs.graph.rows import relation_record
from service.runs.inputs.sites.site import Site
from service.store.log import EventLog

# So much is shown at once: a frame has too few cars to be worth a call of its own.
_AT_ONCE_US = 20_000_000

_AS_THEY_ARE = ("heading_rad", "speed_mps", "length_m", "width_m", "has_moved", "sigma_m", "confidence")
_STORED = ("t_us", "linked", "x_m", "y_m", *_AS_THEY_ARE)
_ROW = np.dtype([("t_us", np.int64), ("body", BODY)])
_ALWAYS = ((-math.inf, math.inf),)


def computed_relations(
    log: EventLog,
    run: RunRecord,
    names: Collection[str],
    ground: Site,
    window_us: tuple[int | None, int | None] = (None, None),
) -> Iterator[RelationRecord]:
    """Compute the changes of some relations among the cars of a run, in the order in which they would be decided.

    Parameters
    ----------
    names : of the relations.
    ground : that of the run.
    window_us : of the frames that are looked at, [from, to); of who was there before, what is true then is told.
    """
    observer = relation_observer(ground.network, ground.relations, names)
    tolerance_m = ground.anchoring.road_tolerance_m
    for frames in seen_frames(log, run, ground.network, tolerance_m=tolerance_m, window_us=window_us):
        for changes in observer.observe_all(frames):
            yield from map(relation_record, changes)


def seen_frames(
    log: EventLog,
    run: RunRecord,
    network: RoadNetwork | None,
    *,
    tolerance_m: float,
    window_us: tuple[int | None, int | None] = (None, None),
) -> Iterator[list[Seen]]:
    """Show the frames of a run in the order of time, those of some seconds at once.

    Parameters
    ----------
    network : on which the cars are; None for open ground.
    tolerance_m : how far beside a road a car is on it.
    window_us : only frames from the first time on, and before the second one; None is open.
    """
    cars = _Cars(log, run, network, tolerance_m)
    from_us, to_us = window_us
    spans_of = log.state_columns(run.id, _STORED, from_us=from_us, to_us=to_us)
    windows = groupby(spans_of, lambda span: span[0] // _AT_ONCE_US)
    window, rows = next(windows, (None, iter(())))
    frames_of = log.frames(run.id, from_us=from_us, to_us=to_us)
    for number, frames in groupby(frames_of, lambda frame: frame[1] // _AT_ONCE_US):
        while window is not None and window < number:  # its frames are lost
            window, rows = next(windows, (None, iter(())))
        spans = list(rows) if window == number else []
        names = [name for _, some, _ in spans for name in some]
        table = np.hstack([np.zeros((len(_STORED), 0)), *(columns for _, _, columns in spans)])
        yield cars.seen(np.array([t_us for _, t_us in frames]), names, table)


class _Cars:
    """Finds the cars of one window of frames after the other; see `seen_frames`."""

    def __init__(self, log: EventLog, run: RunRecord, network: RoadNetwork | None, tolerance_m: float) -> None:
        self._network, self._tolerance_m = network, tolerance_m
        self._taken_for_others = _taken_for_others(log, run)
        self._named = _named(log, run)
        self._last_us = {one.car: one.last_us for one in log.cars(run.id)}
        self._there: list[str] = []  # who was in the last frame, and their latest rows
        self._latest: Rows = np.zeros(0, _ROW)
        # Rows of cars that have no name yet, or that nobody sees: they count once it is seen with its name.
        self._before: dict[str, list[Rows]] = {}

    def seen(self, frames_us: LongArray, names: Sequence[str], columns: FloatArray) -> list[Seen]:
        """Show frames.

        Parameters
        ----------
        frames_us : (frames,) rising.
        names : of the cars of the rows of these times, by time.
        columns : (`_STORED`, rows) of them.
        """
        rows = self._rows(names, columns)
        frame_of = frames_us.searchsorted(rows["t_us"]).clip(max=len(frames_us) - 1)
        has_name = {name: self._has_name(name, frames_us) for name in {*names, *self._there}}
        counts = frames_us[frame_of] == rows["t_us"]
        counts &= np.array([has_name[name][k] for name, k in zip(names, frame_of.tolist(), strict=True)], np.bool_)
        filled = self._filled(names, rows, counts)
        named = counts.nonzero()[0]
        column = {name: k for k, name in enumerate(self._there)}
        columns_of = [column.setdefault(names[k], len(column)) for k in named.tolist()]
        # (frames, cars) the row by which each car is there: its own one, or else the one before.
        held, cars = len(self._there), list(column)
        latest = np.full((len(frames_us), len(cars)), -1)
        latest[0, :held] = np.arange(held)
        latest[frame_of[named], columns_of] = named + held
        np.maximum.accumulate(latest, axis=0, out=latest)
        is_there = (latest >= 0) & (frames_us[:, None] <= [self._last_us[name] for name in cars])
        for k, name in enumerate(cars):
            is_there[:, k] &= has_name[name]
        rows = np.concatenate([self._latest, rows])
        shown = rows[latest[is_there]]
        shown["body"]["observed"] &= shown["t_us"] == frames_us.repeat(is_there.sum(axis=1))
        ids = [tuple([cars[k] for k in one.nonzero()[0]]) for one in is_there]
        self._there, self._latest = list(ids[-1]), rows[latest[-1, is_there[-1]]]
        self._before = {name: some for name, some in self._before.items() if self._last_us[name] > frames_us[-1]}
        ends = is_there.sum(axis=1).cumsum().tolist()
        bodies = [shown["body"][start:end] for start, end in pairwise([0, *ends])]
        frames = map(Footprints, frames_us.tolist(), ids, bodies)
        return [Seen(one, {}, filled.get(one.t_us, ())) for one in frames]

    def _has_name(self, name: str, frames_us: LongArray) -> BoolArray:
        spans = self._named.get(name, _ALWAYS)
        return np.asarray(
            np.logical_or.reduce([(start_us <= frames_us) & (frames_us < end_us) for start_us, end_us in spans])
        )

    def _rows(self, names: Sequence[str], columns: FloatArray) -> Rows:
        """Lay out rows with their places on the roads; a car is not seen where another one was taken for it."""
        t_us, is_seen, *centre_m = columns[:4]
        is_seen = is_seen > 0
        for k, (name, then_us) in enumerate(zip(names, t_us.tolist(), strict=True) if self._taken_for_others else ()):
            for link in self._taken_for_others.get(name, ()):
                if link.start_us <= then_us and (link.end_us is None or then_us < link.end_us):
                    is_seen[k] = False
        network, at_m, count = self._network, np.array(centre_m).T, len(names)
        places = nowhere(count) if network is None else network.locate(at_m, tolerance_m=self._tolerance_m)
        told = dict(zip(_AS_THEY_ARE, columns[4:], strict=True))
        rows = np.empty(count, _ROW)
        rows["t_us"] = t_us
        rows["body"] = bodies(count, centre_m=at_m, observed=is_seen, **told, **on_roads(places))
        return rows

    def _filled(self, names: Sequence[str], rows: Rows, counts: BoolArray) -> dict[int, list[Footprints]]:
        """Say for frames where the cars were before that are seen again there, or have got their name."""
        is_known = counts & rows["body"]["observed"]
        waiting = self._before.keys() | {names[k] for k in (~is_known).nonzero()[0].tolist()}
        found: dict[int, list[tuple[str, Rows]]] = {}
        for k, (name, is_one) in enumerate(zip(names, is_known.tolist(), strict=True)):
            if name in waiting and not is_one:
                self._before.setdefault(name, []).append(rows[k : k + 1].copy())
            elif name in self._before:
                found.setdefault(int(rows["t_us"][k]), []).extend((name, one) for one in self._before.pop(name))
        return {t_us: list(_by_time(some)) for t_us, some in found.items()}


def _named(log: EventLog, run: RunRecord) -> dict[str, list[list[float]]]:
    """Say from when to when each car had its name: what looked like no car any more may be one again later."""
    spans: dict[str, list[list[float]]] = {}
    for link in log.links(run.id):
        if link.level == "car" and link.kind in {"established", "reestablished"}:
            spans.setdefault(link.upper, []).append([link.t_us, math.inf])
        elif link.level == "car" and link.kind in {"refuted", "ended"}:
            spans[link.upper][-1][1] = link.t_us
    return spans


def _taken_for_others(log: EventLog, run: RunRecord) -> dict[str, list[IdentityLink]]:
    """Give for each car the links by which another one was taken for it, as turned out afterwards."""
    below = links_below(log, run.id)
    wrong = {
        one.car: [link for link in chain_of(below, one.car) if link.verdict == "refuted"] for one in log.cars(run.id)
    }
    return {car: links for car, links in wrong.items() if links}


def _by_time(rows: Iterable[tuple[str, Rows]]) -> Iterator[Footprints]:
    """Lay out rows of cars, those of one time together."""
    timed = sorted(((int(row["t_us"][0]), name, row["body"]) for name, row in rows), key=itemgetter(0))
    for t_us, group in groupby(timed, itemgetter(0)):
        _, names, some = zip(*group, strict=True)
        yield Footprints(t_us, names, joined(some))
