"""Who is there in which frame, in which order, and what is known of who is not seen?"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from qsr.changes.crossings import rearranged
from qsr.changes.hidden_time import HiddenTime
from qsr.changes.looks import Doubt, Gone, Look
from qsr.measuring.footprints import Footprints, LongArray

NOBODY: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Seen:
    """Hold what one frame shows; see `qsr.observer.RelationObserver.observe`."""

    footprints: Footprints
    hidden: Mapping[str, int] = field(default_factory=dict)
    filled: Sequence[Footprints] = ()

    def without(self, objects: Collection[str]) -> "Seen":
        """Show some objects as not seen: where they are does not count then."""
        shown = self.footprints
        observed = shown.observed & ~np.array([one in objects for one in shown.ids], dtype=np.bool_)
        filled = [then.select([k for k, one in enumerate(then.ids) if one not in objects]) for then in self.filled]
        return Seen(shown.having(observed=observed), self.hidden, filled)


class LineUp:
    """Keep the order of objects from frame to frame.

    Parameters
    ----------
    back_us : as for `HiddenTime`.
    """

    def __init__(self, back_us: int) -> None:
        self._hidden_time = HiddenTime(back_us)
        self._ids: tuple[str, ...] = ()  # as in the last frame
        self._in_order: list[str] = []
        self._order: LongArray = np.zeros(0, dtype=np.int64)
        self._serials: LongArray = self._order
        self._next_serial = 0

    def looks(self, seen: Seen) -> list[Look]:
        """Take one frame; say which frames are looked at again, in order of time, and then how it is looked at."""
        looks = [self._look(then, returned=returned) for then, returned in self._hidden_time.moments(seen.filled)]
        frame = self._hidden_time.complete(seen.footprints, seen.hidden)
        gone = self._hidden_time.gone(frame, self._in_order) if frame.ids != self._ids else NOBODY
        return [*looks, self._look(frame, gone=gone, hidden=seen.hidden)]

    def _look(
        self,
        frame: Footprints,
        *,
        returned: Collection[str] = (),
        gone: Mapping[str, Gone] = NOBODY,
        hidden: Mapping[str, int] | None = None,
    ) -> Look:
        came_from = None if frame.ids == self._ids else self._rearrange(frame.ids)
        order, ids = self._order, self._in_order
        doubt: Doubt | None = None if hidden is None else self._hidden_time.doubt(frame, hidden, ids)
        return Look(
            frame,
            order,
            ids,
            self._serials,
            came_from,
            observed=None if not returned and frame.observed.all() else frame.observed.take(order),
            returned=np.array([one in returned for one in ids]) if returned else None,
            gone=gone,
            doubt=doubt,
        )

    def _rearrange(self, ids: tuple[str, ...]) -> LongArray:
        """Take over another set, or another order, of objects; say where each was before."""
        old_column = {object_id: column for column, object_id in enumerate(self._in_order)}
        columns = np.array([old_column.get(object_id, -1) for object_id in ids], dtype=np.int64)
        fresh = np.flatnonzero(columns < 0)
        serials = rearranged(self._serials, columns)
        serials[fresh] = np.arange(self._next_serial, self._next_serial + len(fresh))
        self._next_serial += len(fresh)
        self._order = np.argsort(serials)
        self._serials = serials[self._order]
        self._ids, self._in_order = ids, [ids[k] for k in self._order]
        return columns[self._order]
