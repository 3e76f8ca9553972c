"""Which relations are there of single cars, and of cars and places, and since when does each hold?

Where a car is, whether it is moving, and whether it drives along or against its road and its lane. The last two are
unknown off the roads and while the car goes across: within 45 degrees it drives one way or the other.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from qsr.changes.crossings import Dwell, RelationChange, SwitchBank, Value, rearranged
from qsr.measuring.footprints import BoolArray, FloatArray, Footprints, IntArray, LongArray
from qsr.settings import RelationSettings

# (n,) numbers, whole or not: each tracker is given what was measured for it.
Quantity = NDArray[Any]


class ObjectTracker(Protocol):
    """Describe what follows one relation of every object."""

    def unknown(self, object_id: str, column: int, since_us: int, t_us: int) -> list[RelationChange]:
        """Tell that nothing is known of an object since a time; what is kept of it stays."""
        ...

    def forget(self, object_id: str) -> None:
        """Forget an object that is gone; to be called before `keep`."""
        ...

    def keep(self, columns: LongArray, quantity: Quantity, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`."""
        ...

    def update(
        self, t_us: int, quantity: Quantity, ids: Sequence[str], measured: BoolArray | None
    ) -> list[RelationChange]:
        """Take one frame, objects as at the last `keep`, and return the changes.

        Those that are not ``measured``, (n,), stay as they are; None if all are.
        """
        ...


@dataclass(frozen=True, slots=True)
class ObjectRelation:
    """Hold a tracker and how to measure, from footprints, what it follows."""

    tracker: ObjectTracker
    measure: Callable[[Footprints], Quantity]


def object_relations(
    settings: RelationSettings,
    names: Collection[str],
    *,
    roads: Sequence[str],
    junctions: Sequence[str],
    lanes: Sequence[tuple[str, int]],
) -> tuple[ObjectRelation, ...]:
    """Set up the relations of single cars that are asked for; those to lanes only if there are lanes."""
    dwell_us, backdate_us = settings.place_dwell_us, settings.backdate_us
    least_cosine = math.sqrt(settings.road_alignment)
    lane_directions = np.array([direction for _, direction in lanes], dtype=np.int32)

    place = partial(PlaceTracker, dwell_us=dwell_us, backdate_us=backdate_us)
    travel = partial(TravelTracker, dwell_us=dwell_us, backdate_us=backdate_us)
    known = {
        "on": ObjectRelation(place("on", roads), lambda footprints: footprints.road),
        "in_crossing": ObjectRelation(place("in_crossing", junctions), lambda footprints: footprints.junction),
        # The speed of what has never left its place is noise.
        "moving": ObjectRelation(
            MovingTracker(settings), lambda footprints: footprints.speed_mps * footprints.has_moved
        ),
        "forward": ObjectRelation(travel("forward"), lambda footprints: forward_states(footprints, least_cosine)),
    }
    if lanes:
        known["in_lane"] = ObjectRelation(
            place("in_lane", [lane_id for lane_id, _ in lanes]), lambda footprints: footprints.lane
        )
        known["against_traffic"] = ObjectRelation(
            travel("against_traffic"),
            lambda footprints: against_traffic_states(footprints, least_cosine, lane_directions),
        )
    return tuple(relation for name, relation in known.items() if name in names)


class PlaceTracker:
    """Follow one relation between objects and places, such as on(car, road).

    A place where an object has never been is false without a word: naming every road for every car would fill the log.
    The first change there has ``old`` False if the object was known before, None if it appears there.

    Parameters
    ----------
    relation : name in the change events.
    place_ids : names of the places, by index.
    dwell_us, backdate_us : as in `Dwell`.
    """

    def __init__(self, relation: str, place_ids: Sequence[str], *, dwell_us: int, backdate_us: int) -> None:
        self._relation = relation
        self._place_ids = tuple(place_ids)
        self._dwell = Dwell(dwell_us=dwell_us, backdate_us=backdate_us)
        # Object -> place -> (is it there, time of the last change).
        self._at: dict[str, dict[int, tuple[bool, int]]] = {}

    def unknown(self, object_id: str, column: int, since_us: int, t_us: int) -> list[RelationChange]:
        """Tell every place of an object unknown."""
        return [
            RelationChange(self._relation, (object_id, self._place_ids[place]), since_us, t_us, is_there, None)
            for place, (is_there, _) in self._at.get(object_id, {}).items()
        ]

    def forget(self, object_id: str) -> None:
        """Forget an object that is gone; to be called before `keep`."""
        self._at.pop(object_id, None)

    def keep(self, columns: LongArray, places: IntArray, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start at their place, -1 for none."""
        self._dwell.keep(columns, places, t_us)
        changes = []
        for column in np.flatnonzero((columns < 0) & (places >= 0)).tolist():
            object_id, place = ids[column], int(places[column])
            self._at[object_id] = {place: (True, t_us)}
            changes.append(RelationChange(self._relation, (object_id, self._place_ids[place]), t_us, t_us, None, True))
        return changes

    def update(
        self, t_us: int, places: IntArray, ids: Sequence[str], measured: BoolArray | None = None
    ) -> list[RelationChange]:
        """Take the place of every object, -1 for none, and return the changes."""
        changes = []
        for column, left, entered, at_us in self._dwell.update(t_us, places, measured):
            if left >= 0:
                changes.append(self._change(ids[column], left, at_us, t_us, is_there=False))
            if entered >= 0:
                changes.append(self._change(ids[column], entered, at_us, t_us, is_there=True))
        return changes

    def _change(self, object_id: str, place: int, at_us: int, t_us: int, *, is_there: bool) -> RelationChange:
        places = self._at.setdefault(object_id, {})
        was_there, last_us = places.get(place, (False, at_us - 1))
        at_us = max(at_us, last_us + 1)
        places[place] = (is_there, at_us)
        return RelationChange(self._relation, (object_id, self._place_ids[place]), at_us, t_us, was_there, is_there)


# A state of the dwell: what is known of the relation.
_VALUES: dict[int, Value] = {-1: None, 0: False, 1: True}


def forward_states(footprints: Footprints, least_cosine: float) -> IntArray:
    """Say of every car whether it drives the way its road's reference line runs: 1, against it: 0, or neither: -1.

    Nobody knows which way something faces that has stood since it was seen first.

    Parameters
    ----------
    footprints : of one frame.
    least_cosine : between heading and road, of a car that drives along it.
    """
    travel = np.where(
        (footprints.road < 0) | ~footprints.has_moved, 0.0, np.cos(footprints.heading_rad - footprints.tangent_rad)
    )
    return np.where(np.abs(travel) < least_cosine, -1, travel > 0).astype(np.int32)


def against_traffic_states(footprints: Footprints, least_cosine: float, lane_directions: IntArray) -> IntArray:
    """Say of every car whether it drives against its lane: 1, along it: 0, or neither: -1.

    Parameters
    ----------
    footprints : of one frame.
    least_cosine : as in `forward_states`.
    lane_directions : by lane, +1 if it is driven along its road's reference line, -1 if against it.
    """
    forward = forward_states(footprints, least_cosine)
    is_against = forward != (lane_directions[footprints.lane] > 0)
    return np.where((forward < 0) | (footprints.lane < 0), -1, is_against).astype(np.int32)


class TravelTracker:
    """Follow one relation of a single car that can be unknown while the car is seen.

    Parameters
    ----------
    relation : name in the change events.
    dwell_us, backdate_us : as in `Dwell`.
    """

    def __init__(self, relation: str, *, dwell_us: int, backdate_us: int) -> None:
        self._relation = relation
        self._dwell = Dwell(dwell_us=dwell_us, backdate_us=backdate_us)
        self._changed_us: dict[str, int] = {}

    def unknown(self, object_id: str, column: int, since_us: int, t_us: int) -> list[RelationChange]:
        """Tell that nothing is known of an object since a time; what is kept of it stays."""
        old = _VALUES[int(self._dwell.current[column])]
        return [] if old is None else [RelationChange(self._relation, (object_id,), since_us, t_us, old, None)]

    def forget(self, object_id: str) -> None:
        """Forget an object that is gone; to be called before `keep`."""
        self._changed_us.pop(object_id, None)

    def keep(self, columns: LongArray, states: IntArray, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start with what is known of them."""
        self._dwell.keep(columns, states, t_us)
        changes = []
        for column in np.flatnonzero((columns < 0) & (states >= 0)).tolist():
            self._changed_us[ids[column]] = t_us
            changes.append(
                RelationChange(self._relation, (ids[column],), t_us, t_us, None, _VALUES[int(states[column])])
            )
        return changes

    def update(
        self, t_us: int, states: IntArray, ids: Sequence[str], measured: BoolArray | None = None
    ) -> list[RelationChange]:
        """Take what is known of every object now, and return the changes."""
        changes = []
        for column, old, new, since_us in self._dwell.update(t_us, states, measured):
            object_id = ids[column]
            at_us = max(since_us, self._changed_us.get(object_id, since_us - 1) + 1)
            self._changed_us[object_id] = at_us
            changes.append(RelationChange(self._relation, (object_id,), at_us, t_us, _VALUES[old], _VALUES[new]))
        return changes


class MovingTracker:
    """Follow moving(object): faster than a limit, with hysteresis.

    Parameters
    ----------
    settings : thresholds.
    """

    def __init__(self, settings: RelationSettings) -> None:
        self._limit_mps = settings.moving_mps
        self._bank = SwitchBank(np.array([settings.moving_margin_mps]), backdate_us=settings.backdate_us)
        self._changed_us: LongArray = np.zeros(0, dtype=np.int64)
        self._fresh: LongArray = np.zeros(0, dtype=np.int64)

    def unknown(self, object_id: str, column: int, since_us: int, t_us: int) -> list[RelationChange]:
        """Tell that nothing is known of an object since a time; what is kept of it stays."""
        return [RelationChange("moving", (object_id,), since_us, t_us, bool(self._bank.is_on[0, column]), None)]

    def forget(self, object_id: str) -> None:
        """Keep nothing by name that had to be forgotten."""

    def keep(self, columns: LongArray, speed_mps: FloatArray, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start with their next `update`."""
        self._bank.keep(columns)
        self._changed_us = rearranged(self._changed_us, columns, t_us)
        self._fresh = np.flatnonzero(columns < 0)
        return []

    def update(
        self, t_us: int, speed_mps: FloatArray, ids: Sequence[str], measured: BoolArray | None = None
    ) -> list[RelationChange]:
        """Take the speed of every object, (n,), and return the changes."""
        held = None if measured is None else ~measured
        turned = self._bank.update(t_us, (speed_mps - self._limit_mps).reshape(1, -1), held)[0]
        is_on = self._bank.is_on[0]
        changes = [
            RelationChange("moving", (ids[column],), t_us, t_us, None, bool(is_on[column]))
            for column in self._fresh.tolist()
        ]
        self._fresh = self._fresh[:0]
        if turned.any():
            for column in np.flatnonzero(turned).tolist():
                at_us = max(int(self._bank.since_us[0, column]), int(self._changed_us[column]) + 1)
                self._changed_us[column] = at_us
                now = bool(is_on[column])
                changes.append(RelationChange("moving", (ids[column],), at_us, t_us, not now, now))
        return changes
