"""Which relations have changed among all objects and places, frame by frame?"""

import math
from collections.abc import Collection, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from gis.lane_graph import LaneGraph
from gis.turns import Turn
from qsr.changes.crossings import RelationChange, rearranged
from qsr.changes.hidden_time import HiddenTime
from qsr.changes.object_relations import Quantity, check_places, object_relations
from qsr.changes.pair_kinds import FacingCars, NearCars, ObjectsNow
from qsr.changes.pair_observer import Doubt, Gone
from qsr.errors import QsrError
from qsr.measuring.footprints import OBSERVED, Footprints, LongArray, object_table
from qsr.measuring.routes import Routes
from qsr.relations import FACING_RELATIONS, NEAR_IN_TIME_RELATIONS, NEAR_RELATIONS, RANK, asked_for
from qsr.settings import RelationSettings

NOBODY: Mapping[str, Any] = MappingProxyType({})


class RelationObserver:
    """Turn footprints, frame after frame, into relation changes.

    What nobody sees changes nothing: relations are decided in frames in which all of their objects are seen. Until then
    they stay as they were, for as long as an object is given as not observed or as hidden. When it comes back, what
    happened meanwhile is told, and dated there; if it never does, unknown is told from the moment of the loss.

    Parameters
    ----------
    road_ids, junction_ids : names of the places that ``Footprints.road`` and ``Footprints.junction`` count.
    settings : thresholds.
    only : names of the relations to give out, None for all. Naming changes is most of the work where many cars meet
        each other, so name what is asked for; what nobody asks for is not measured either.
    lanes : name of each lane that ``Footprints.lane`` counts, and its direction: +1 if it is driven along its road's
        reference line, -1 if against it. Without lanes there are no relations to lanes.
    turns : what a way from one road over a junction to another one is; told once, with the first frame.
    graph : of the lanes that ``Footprints.lane`` counts; with it, cars that are not on one road are measured along the
        route between them.

    Raises
    ------
    QsrError
        If ``only`` holds a name that is not in the relation table.

    Examples
    --------
    >>> def frame(t_us, along_m):                        # b drives 10 m in front of a, on no road
    ...     return Footprints(t_us, ("a", "b"), np.array([[along_m, 0.0], [10.0, 3.0]]), np.zeros(2), np.full(2, 9.0),
    ...                       np.full(2, 4.0), np.full(2, 2.0), np.full(2, -1, np.int32), np.full(2, np.nan),
    ...                       np.full(2, np.nan), np.full(2, np.nan), np.full(2, -1, np.int32))
    >>> observer = RelationObserver((), ())
    >>> sorted(change.name for change in observer.observe(frame(0, 0.0)) if change.new and change.args == ("a", "b"))
    ['behind', 'close', 'right', 'same_direction']
    >>> for change in observer.observe(frame(1_000_000, 8.0)):
    ...     print(change.name, change.args, change.t_us, change.old, change.new)
    behind ('a', 'b') 750000 True False
    ahead ('b', 'a') 750000 True False
    beside ('a', 'b') 750000 False True
    beside ('b', 'a') 750000 False True
    """

    __slots__ = (
        "_graph",
        "_hidden_time",
        "_ids",
        "_last_t_us",
        "_next_serial",
        "_objects",
        "_order",
        "_pairs",
        "_place_counts",
        "_serials",
        "_sorted_ids",
        "_turns",
        "_widest_m",
    )

    def __init__(
        self,
        road_ids: Sequence[str],
        junction_ids: Sequence[str],
        settings: RelationSettings | None = None,
        *,
        only: Collection[str] | None = None,
        lanes: Sequence[tuple[str, int]] = (),
        turns: Sequence[Turn] = (),
        graph: LaneGraph | None = None,
    ) -> None:
        settings = RelationSettings() if settings is None else settings
        names = frozenset(RANK if only is None else only)
        if unknown := sorted(names - RANK.keys()):
            raise QsrError(f"relation observer: expected names out of {sorted(RANK)!r}, got {unknown[0]!r}")
        self._pairs = NearCars(settings, names), FacingCars(settings, names)
        self._objects = object_relations(settings, names, roads=road_ids, junctions=junction_ids, lanes=lanes)
        self._place_counts = len(road_ids), len(junction_ids), len(lanes)
        self._widest_m = settings.widest_m
        # Places on the graph are found in every frame, so only for who asks for pairs.
        self._graph = graph if asked_for((*NEAR_RELATIONS, *NEAR_IN_TIME_RELATIONS, *FACING_RELATIONS), names) else None
        self._turns = turns if "turn" in names else ()
        self._last_t_us: int | None = None
        self._ids: tuple[str, ...] = ()  # as in the last frame
        # Inside, objects stand in order of first appearance, each with a serial number that is never used again.
        self._next_serial = 0
        self._serials: LongArray = np.zeros(0, dtype=np.int64)
        self._sorted_ids: list[str] = []
        self._order: LongArray = self._serials
        self._hidden_time = HiddenTime(settings.backdate_us)

    def observe(
        self, footprints: Footprints, *, hidden: Mapping[str, int] = NOBODY, filled: Sequence[Footprints] = ()
    ) -> list[RelationChange]:
        """Take one frame and return the changes it decides.

        Parameters
        ----------
        footprints : of a frame later than the last one.
        hidden : objects that are not in the frame but may come back, and when each was not seen for the first time. Of
            these unknown is told at once, from that time on, but what it was before is kept.
        filled : where objects of this frame that are new, were hidden, or not observed, were at earlier frames, in
            order of time. What was told unknown of them counts as not told; of new ones the last change alone is told.

        Returns
        -------
        Sorted by time; at one time what ends comes before what begins, then in the order of the relation table, then by
        arguments. An object that is new starts with ``old`` None, one that is gone ends with ``new`` None.

        Raises
        ------
        QsrError
            If the frame is not later than the last one, or a place index is beyond the list of places.
        """
        t_us = footprints.t_us
        if self._last_t_us is not None and t_us <= self._last_t_us:
            raise QsrError(f"relation observer: expected a frame after {self._last_t_us} us, got one at {t_us!r} us")
        self._last_t_us = t_us
        self._check_places(footprints)
        changes = [_stated(turn, t_us) for turn in self._turns]
        self._turns = ()
        known = set(self._ids)
        for then, returned in self._hidden_time.moments(filled):
            quantities, found = self._measure(then), list[RelationChange]()
            if then.ids != self._ids:
                found += self._rearrange(then, quantities, NOBODY)
            found += self._update(then, quantities, returned)
            changes += [replace(one, decided_us=t_us) for one in found]
        fresh = set(self._ids) - known
        footprints = self._hidden_time.complete(footprints, hidden)
        quantities, gone = self._measure(footprints), dict[str, Gone]()
        if footprints.ids != self._ids:
            gone = self._hidden_time.gone(footprints)
            changes += self._rearrange(footprints, quantities, gone)
        changes += self._update(footprints, quantities, gone=gone)
        changes = _settled(changes, fresh) if fresh else changes
        doubt = self._hidden_time.doubt(footprints, hidden, self._order.tolist())
        if doubt is not None:
            changes += self._doubt(doubt, t_us)
        if changes and not np.isnan(footprints.sigma_m).all():
            changes = _as_sure_as_objects(changes, footprints)
        changes.sort(key=rank)
        return changes

    def copy(self) -> "RelationObserver":
        """Make an observer that goes on from here on its own; the map, which never changes, is shared."""
        return deepcopy(self, {id(self._graph): self._graph})

    def _measure(self, footprints: Footprints) -> list[Quantity]:
        return [relation.measure(footprints) for relation in self._objects]

    def _update(
        self,
        footprints: Footprints,
        quantities: Sequence[Quantity],
        returned: Collection[str] = (),
        gone: Mapping[str, Gone] = NOBODY,
    ) -> list[RelationChange]:
        """Let all relations see a frame; one that was seen before shows only those who have ``returned``."""
        order, ids, t_us = self._order, self._sorted_ids, footprints.t_us
        table = object_table(footprints, widest_m=self._widest_m).take(order, axis=1)
        now = ObjectsNow(
            t_us,
            ids,
            self._serials,
            table,
            footprints.has_moved[order],
            footprints.sigma_m[order],
            observed=None if footprints.observed.all() and not returned else table[OBSERVED] > 0,
            returned=np.array([one in returned for one in ids]) if returned else None,
            routes=None if self._graph is None else Routes.of(self._graph, footprints, order),
            gone=gone,
        )
        changes = [change for pairs in self._pairs for change in pairs.update(now)]
        for relation, quantity in zip(self._objects, quantities, strict=True):
            changes += relation.tracker.update(t_us, quantity.take(order), ids, now.measured)
        return changes

    def _doubt(self, doubt: Doubt, t_us: int) -> list[RelationChange]:
        """Tell unknown of those who are hidden what has not been told yet."""
        changes = [change for pairs in self._pairs for change in pairs.doubt(t_us, doubt)]
        for column in doubt.is_new.nonzero()[0].tolist():
            one, since_us = self._sorted_ids[column], int(doubt.since_us[column])
            for relation in self._objects:
                told = relation.tracker.unknown(one, column, since_us, t_us)
                changes += [replace(change, absent=(one,)) for change in told]
        return changes

    def _check_places(self, footprints: Footprints) -> None:
        roads, junctions, lanes = self._place_counts
        check_places("on", footprints.road, roads, footprints.t_us)
        check_places("in_crossing", footprints.junction, junctions, footprints.t_us)
        if lanes:
            check_places("in_lane", footprints.lane, lanes, footprints.t_us)

    def _rearrange(
        self, footprints: Footprints, quantities: Sequence[Quantity], gone: Mapping[str, Gone]
    ) -> list[RelationChange]:
        """Take over another set, or another order, of objects."""
        t_us, changes = footprints.t_us, list[RelationChange]()
        old_column = {object_id: column for column, object_id in enumerate(self._sorted_ids)}
        for object_id, lost in gone.items():
            for relation in self._objects:
                if not lost.is_told:
                    changes += relation.tracker.unknown(object_id, old_column[object_id], lost.since_us, t_us)
                relation.tracker.forget(object_id)
        columns = np.array([old_column.get(object_id, -1) for object_id in footprints.ids], dtype=np.int64)
        fresh = np.flatnonzero(columns < 0)
        serials = rearranged(self._serials, columns)
        serials[fresh] = np.arange(self._next_serial, self._next_serial + len(fresh))
        self._next_serial += len(fresh)
        order = np.argsort(serials)
        self._order, self._serials, columns = order, serials[order], columns[order]
        self._ids, self._sorted_ids = footprints.ids, [footprints.ids[k] for k in order]
        for relation, quantity in zip(self._objects, quantities, strict=True):
            changes += relation.tracker.keep(columns, quantity.take(order), self._sorted_ids, t_us)
        return changes


def _as_sure_as_objects(changes: Sequence[RelationChange], footprints: Footprints) -> list[RelationChange]:
    """Say of every change how sure it is, by itself so far, with all objects that it is about.

    What is said first of young objects is left as it is: how long they are seen afterwards tells more of them.
    """
    sure = dict(zip(footprints.ids, footprints.confidence.tolist(), strict=True))
    return [
        one
        if one.old is None
        else replace(one, confidence=round(one.confidence * math.prod([sure.get(name, 1.0) for name in one.args]), 3))
        for one in changes
    ]


def _settled(changes: Sequence[RelationChange], fresh: set[str]) -> list[RelationChange]:
    """Of objects that are new, say what holds in the end and since when: rows before a name are doubtful."""
    begun: dict[tuple[str, tuple[str, ...]], RelationChange] = {}
    settled = []
    for one in changes:
        if fresh.isdisjoint(one.args):
            settled.append(one)
        else:
            first = begun.setdefault((one.name, one.args), one)
            begun[one.name, one.args] = replace(one, old=first.old, confidence=first.confidence)
    return settled + [one for one in begun.values() if one.new is not one.old]


def _stated(turn: Turn, t_us: int) -> RelationChange:
    args = (turn.from_road, turn.junction, turn.to_road)
    return RelationChange("turn", args, t_us, t_us, None, turn.direction)


def rank(change: RelationChange) -> tuple[int, int, tuple[str, ...]]:
    """Order changes as `RelationObserver.observe` gives them."""
    ending = 0 if change.new is None else 1 + bool(change.new)
    return change.t_us, ending * len(RANK) + RANK[change.name], change.args
