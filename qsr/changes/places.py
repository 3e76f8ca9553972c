"""On which road, in which lane and in which junction is every object, and since when?"""

from collections.abc import Sequence

import numpy as np

from qsr.changes.crossings import Dwell, RelationChange
from qsr.errors import QsrError
from qsr.measuring.footprints import IntArray, LongArray


def check_places(relation: str, places: IntArray, count: int, t_us: int) -> None:
    """Refuse an index that names none of `count` places.

    Raises
    ------
    QsrError
        If there is one.
    """
    if len(places) and (highest := int(places.max())) >= count:
        raise QsrError(f"index of {relation} at {t_us} us must be below {count}, got {highest!r}")


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

    __slots__ = ("_at", "_dwell", "_place_ids", "_relation")

    def __init__(self, relation: str, place_ids: Sequence[str], *, dwell_us: int, backdate_us: int) -> None:
        self._relation = relation
        self._place_ids = tuple(place_ids)
        self._dwell = Dwell(dwell_us=dwell_us, backdate_us=backdate_us)
        # Object -> place -> (is it there, time of the last change).
        self._at: dict[str, dict[int, tuple[bool, int]]] = {}

    def forget(self, object_id: str, column: int, t_us: int) -> list[RelationChange]:
        """Make every place of an object that has disappeared unknown."""
        places = self._at.pop(object_id, {})
        return [self._named(object_id, place, t_us, t_us, old=is_there) for place, (is_there, _) in places.items()]

    def keep(self, columns: LongArray, places: IntArray, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start at their place, -1 for none."""
        self._dwell.keep(columns, places, t_us)
        changes = []
        for column in np.flatnonzero((columns < 0) & (places >= 0)).tolist():
            object_id, place = ids[column], int(places[column])
            self._at[object_id] = {place: (True, t_us)}
            changes.append(self._named(object_id, place, t_us, t_us, new=True))
        return changes

    def update(self, t_us: int, places: IntArray, ids: Sequence[str]) -> list[RelationChange]:
        """Take the place of every object, -1 for none, and return the changes."""
        changes = []
        for column, left, entered, at_us in self._dwell.update(t_us, places):
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
