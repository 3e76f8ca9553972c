"""On which road, and in which junction, is every object, and since when?

A place has no distance to a threshold, so noise is kept out by time: an object is at a new place when it has been there
for a while, and then the change is dated back to the first frame there.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from qsr.changes import RelationChange
from qsr.errors import QsrError

IndexArray = NDArray[np.int64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]


class PlaceTracker:
    """Follow one relation between objects and places, such as on(car, road).

    A place where an object has never been is false without a word: naming every road for every car would fill the log.
    The first change there has ``old`` False if the object was known before, None if it appears there.

    Parameters
    ----------
    relation : name in the change events.
    place_ids : names of the places, by index.
    dwell_us : how long an object must be at a new place.
    backdate_us : a change is dated back at most this far.
    """

    __slots__ = ("_at", "_backdate_us", "_candidate", "_current", "_dwell_us", "_place_ids", "_relation", "_since_us")

    def __init__(self, relation: str, place_ids: Sequence[str], *, dwell_us: int, backdate_us: int) -> None:
        self._relation = relation
        self._place_ids = tuple(place_ids)
        self._dwell_us = dwell_us
        self._backdate_us = backdate_us
        self._current: IndexArray = np.zeros(0, dtype=np.int64)
        self._candidate: IndexArray = self._current
        self._since_us: IndexArray = self._current
        # Object -> place -> (is it there, time of the last change).
        self._at: dict[str, dict[int, tuple[bool, int]]] = {}

    def check(self, t_us: int, places: IntArray) -> None:
        """Refuse an index that names no place."""
        if len(places) and (highest := int(places.max())) >= len(self._place_ids):
            raise QsrError(
                f"index of {self._relation} at {t_us} us must be below {len(self._place_ids)}, got {highest!r}"
            )

    def forget(self, object_id: str, t_us: int) -> list[RelationChange]:
        """Make every place of an object that has disappeared unknown."""
        places = self._at.pop(object_id, {})
        return [self._named(object_id, place, t_us, t_us, old=is_there) for place, (is_there, _) in places.items()]

    def keep(self, columns: NDArray[np.intp], places: IntArray, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start at their place, -1 for none."""
        fresh = columns < 0
        if len(self._current):
            self._current = np.where(fresh, places, self._current.take(columns))
            self._candidate = np.where(fresh, places, self._candidate.take(columns))
            self._since_us = np.where(fresh, t_us, self._since_us.take(columns))
        else:
            self._current, self._candidate = places.astype(np.int64), places.astype(np.int64)
            self._since_us = np.full(len(places), t_us, dtype=np.int64)
        changes = []
        for column in np.flatnonzero(fresh & (places >= 0)).tolist():
            object_id, place = ids[column], int(places[column])
            self._at[object_id] = {place: (True, t_us)}
            changes.append(self._named(object_id, place, t_us, t_us, new=True))
        return changes

    def update(self, t_us: int, places: IntArray, ids: Sequence[str]) -> list[RelationChange]:
        """Take the place of every object, -1 for none, and return the changes."""
        moved = places != self._candidate
        if moved.any():
            self._candidate = places.astype(np.int64)
            self._since_us = np.where(moved, t_us, self._since_us)
        settled = (self._candidate != self._current) & (t_us - self._since_us >= self._dwell_us)
        if not settled.any():
            return []
        changes = []
        for column in np.flatnonzero(settled).tolist():
            object_id, left, entered = ids[column], int(self._current[column]), int(self._candidate[column])
            at_us = max(int(self._since_us[column]), t_us - self._backdate_us)
            if left >= 0:
                changes.append(self._change(object_id, left, at_us, t_us, is_there=False))
            if entered >= 0:
                changes.append(self._change(object_id, entered, at_us, t_us, is_there=True))
        self._current = np.where(settled, self._candidate, self._current)
        return changes

    def _change(self, object_id: str, place: int, at_us: int, t_us: int, *, is_there: bool) -> RelationChange:
        places = self._at.setdefault(object_id, {})
        was_there, last_us = places.get(place, (False, at_us - 1))
        at_us = max(at_us, last_us + 1)
        places[place] = (is_there, at_us)
        return self._named(object_id, place, at_us, t_us, old=was_there, new=is_there)

    def _named(
        self,
        object_id: str,
        place: int,
        at_us: int,
        t_us: int,
        *,
        old: bool | None = None,
        new: bool | None = None,
    ) -> RelationChange:
        return RelationChange(self._relation, (object_id, self._place_ids[place]), at_us, t_us, old, new)
