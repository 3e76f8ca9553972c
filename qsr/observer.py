"""Which relations have changed among all objects and places, frame by frame?"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import accumulate, groupby
from operator import itemgetter

import numpy as np

from gis.roads.lane_graph import LaneGraph
from gis.roads.turns import Turn
from qsr.changes.crossings import RelationChange
from qsr.changes.line_up import NOBODY, LineUp, Seen
from qsr.changes.looks import Doubt, Look, Objects, differs
from qsr.changes.object_relations import Quantity, object_relations
from qsr.changes.pair_kinds import FacingCars, Found, KeptPairs, NearCars
from qsr.errors import QsrError
from qsr.measuring.footprints import OBSERVED, Footprints, LongArray
from qsr.relations import FACING_RELATIONS, NEAR_IN_TIME_RELATIONS, NEAR_RELATIONS, RANK, asked_for
from qsr.settings import RelationSettings

_OBJECTS_AT_ONCE = 4096


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
    ...     centre_m = np.array([[along_m, 0.0], [10.0, 3.0]])
    ...     return Footprints.of(t_us, ("a", "b"), centre_m=centre_m, heading_rad=np.zeros(2),
    ...                          speed_mps=np.full(2, 9.0), length_m=np.full(2, 4.0), width_m=np.full(2, 2.0))
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
        self._line_up = LineUp(settings.backdate_us)
        self._pairs = NearCars(settings, names), FacingCars(settings, names)
        self._objects = object_relations(settings, names, roads=road_ids, junctions=junction_ids, lanes=lanes)
        self._places = {"on": ("road", len(road_ids)), "in_crossing": ("junction", len(junction_ids))}
        self._places |= {"in_lane": ("lane", len(lanes))} if lanes else {}
        self._widest_m = settings.widest_m
        # Places on the graph are found in every frame, so only for who asks for pairs.
        self._graph = graph if asked_for((*NEAR_RELATIONS, *NEAR_IN_TIME_RELATIONS, *FACING_RELATIONS), names) else None
        self._turns = turns if "turn" in names else ()
        self._last_t_us: int | None = None

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
        [changes] = self.observe_all([Seen(footprints, hidden, filled)])
        return changes

    def observe_all(self, frames: Sequence[Seen]) -> list[list[RelationChange]]:
        """Take frames one after the other, as `observe` does, and return the changes that each decides.

        Some hundred frames of a few cars take a third of the time that they take one by one: many are measured at once,
        and pairs need not see one that shows nothing new.
        """
        if not frames:
            return []
        self._check(frames)
        looks = [self._line_up.looks(seen) for seen in frames]
        measured = (one for some in _in_parts(looks) for one in self._measured(some))
        return [self._decide(again, look, measured) for *again, look in looks]

    def _decide(self, again: Sequence[Look], look: Look, measured: Iterator["_Measured"]) -> list[RelationChange]:
        """Tell what a frame decides, by the looks at earlier ones and at itself."""
        t_us = look.t_us
        changes = [_stated(turn, t_us) for turn in self._turns]
        self._turns = ()
        for then in again:
            changes += [replace(one, decided_us=t_us) for one in self._update(then, next(measured))]
        changes += self._update(look, next(measured))
        if again:
            changes = _settled(changes, {one for then in again for one in then.fresh})
        if look.doubt is not None:
            changes += self._doubt(look, look.doubt)
        if changes and not np.isnan(look.footprints.sigma_m).all():
            changes = _as_sure_as_objects(changes, look.footprints)
        changes.sort(key=rank)
        return changes

    def copy(self) -> "RelationObserver":
        """Make an observer that goes on from here on its own; the map, which never changes, is shared."""
        return deepcopy(self, {id(self._graph): self._graph})

    def _measured(self, looks: Sequence[Look]) -> Iterator["_Measured"]:
        """Find and measure what is asked for, of all looks at once."""
        objects = Objects.of(looks, widest_m=self._widest_m, graph=self._graph)
        quantities = [relation.measure(objects.shown).take(objects.order) for relation in self._objects]
        found = [(kept, some) for kind in self._pairs for kept, some in zip(kind.kept, kind.find(objects), strict=True)]
        is_new = np.ones(len(looks), np.bool_)
        if len(looks) > 2:
            is_new = np.array([not look.is_plain for look in looks])
            is_new |= differs(objects.starts, objects.table[OBSERVED])
            for kept, some in found:
                is_new |= kept.differs(some)
            # What comes before something new counts too: crossings are dated between the two.
            is_new[:-1] |= is_new[1:]
            is_new[-1] = True
        for number, is_needed in enumerate(is_new.tolist()):
            yield _Measured(is_needed, number, [objects.of_look(one, number) for one in quantities], found)

    def _update(self, look: Look, measured: "_Measured") -> list[RelationChange]:
        """Let all relations see a frame; those of pairs need not see one that is like those before and after it."""
        changes = [] if look.came_from is None else self._rearrange(look, look.came_from, measured.quantities)
        for kept, found in measured.found if measured.is_needed else ():
            changes += kept.update(look, found, measured.number)
        for relation, quantity in zip(self._objects, measured.quantities, strict=True):
            changes += relation.tracker.update(look.t_us, quantity, look.ids, look.measured)
        return changes

    def _doubt(self, look: Look, doubt: Doubt) -> list[RelationChange]:
        """Tell unknown of those who are hidden what has not been told yet."""
        t_us = look.t_us
        changes = [change for kind in self._pairs for kept in kind.kept for change in kept.doubt(t_us, doubt)]
        for column in doubt.is_new.nonzero()[0].tolist():
            one, since_us = look.ids[column], int(doubt.since_us[column])
            for relation in self._objects:
                told = relation.tracker.unknown(one, column, since_us, t_us)
                changes += [replace(change, absent=(one,)) for change in told]
        return changes

    def _check(self, frames: Sequence[Seen]) -> None:
        """Refuse frames before anything has changed."""
        last_us = self._last_t_us
        for t_us in (seen.footprints.t_us for seen in frames):
            if last_us is not None and t_us <= last_us:
                raise QsrError(f"relation observer: expected a frame after {last_us} us, got one at {t_us!r} us")
            last_us = t_us
        self._last_t_us = last_us
        for relation, (column, count) in self._places.items():
            for shown in (seen.footprints for seen in frames):
                place = int(getattr(shown, column).max(initial=-1))
                if place >= count:
                    raise QsrError(f"index of {relation} at {shown.t_us} us must be below {count}, got {place!r}")

    def _rearrange(self, look: Look, came_from: LongArray, quantities: Sequence[Quantity]) -> list[RelationChange]:
        """Take over another set, or another order, of objects."""
        t_us, changes = look.t_us, list[RelationChange]()
        for object_id, lost in look.gone.items():
            for relation in self._objects:
                if not lost.is_told:
                    changes += relation.tracker.unknown(object_id, lost.column, lost.since_us, t_us)
                relation.tracker.forget(object_id)
        for relation, quantity in zip(self._objects, quantities, strict=True):
            changes += relation.tracker.keep(came_from, quantity, look.ids, t_us)
        return changes


@dataclass(frozen=True, slots=True)
class _Measured:
    """Hold what a look shows.

    Attributes
    ----------
    is_needed : whether it, or the next one, shows something new.
    number : of the look among those of the pairs.
    quantities : (n,) for each relation of single objects.
    found : the pairs of all looks, for each set of relations of pairs.
    """

    is_needed: bool
    number: int
    quantities: Sequence[Quantity]
    found: Sequence[tuple[KeptPairs, Found]]


def _in_parts(frames: Iterable[Sequence[Look]]) -> Iterator[list[Look]]:
    """Part the looks at frames so that what is measured at once needs little memory."""
    looks = [look for some in frames for look in some]
    parts = (count // _OBJECTS_AT_ONCE for count in accumulate(len(look.ids) for look in looks))
    return ([look for look, _ in group] for _, group in groupby(zip(looks, parts, strict=True), itemgetter(1)))


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


def _settled(changes: Sequence[RelationChange], fresh: Collection[str]) -> list[RelationChange]:
    """Of objects that are new, say what holds in the end and since when: rows before a name are doubtful."""
    begun: dict[tuple[str, tuple[str, ...]], RelationChange] = {}
    settled = []
    for one in changes:
        if not any(name in fresh for name in one.args):
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
