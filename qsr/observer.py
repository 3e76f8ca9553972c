"""Which relations have changed among all objects and places, frame by frame?"""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from qsr.changes import RelationChange
from qsr.errors import QsrError
from qsr.footprints import Footprints
from qsr.moving import MovingTracker
from qsr.pair_observer import PairObserver
from qsr.places import PlaceTracker
from qsr.relations import RANK
from qsr.road_relations import object_table
from qsr.settings import RelationSettings

LongArray = NDArray[np.int64]


class RelationObserver:
    """Turn footprints, frame after frame, into relation changes.

    Parameters
    ----------
    road_ids, junction_ids : names of the places that ``Footprints.road`` and ``Footprints.junction`` count.
    settings : thresholds.
    only : names of the relations to give out, None for all. Naming changes is most of the work where many cars meet
        each other, so name what is asked for.

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
        "_ids",
        "_last_t_us",
        "_moving",
        "_next_serial",
        "_only",
        "_order",
        "_pairs",
        "_places",
        "_serials",
        "_sorted_ids",
    )

    def __init__(
        self,
        road_ids: Sequence[str],
        junction_ids: Sequence[str],
        settings: RelationSettings | None = None,
        *,
        only: Collection[str] | None = None,
    ) -> None:
        settings = RelationSettings() if settings is None else settings
        self._only = frozenset(RANK if only is None else only)
        if unknown := sorted(self._only - RANK.keys()):
            raise QsrError(f"relation observer: expected names out of {sorted(RANK)!r}, got {unknown[0]!r}")
        self._pairs = PairObserver(settings, self._only)
        self._moving = MovingTracker(settings)
        self._places = tuple(
            PlaceTracker(name, place_ids, dwell_us=settings.place_dwell_us, backdate_us=settings.backdate_us)
            for name, place_ids in (("on", road_ids), ("in_crossing", junction_ids))
        )
        self._last_t_us: int | None = None
        self._ids: tuple[str, ...] = ()  # as in the last frame
        # Inside, objects stand in order of first appearance, each with a serial number that is never used again.
        self._next_serial = 0
        self._serials: LongArray = np.zeros(0, dtype=np.int64)
        self._sorted_ids: list[str] = []
        self._order: LongArray = self._serials

    def observe(self, footprints: Footprints) -> list[RelationChange]:
        """Take one frame and return the changes it decides.

        Parameters
        ----------
        footprints : of a frame later than the last one.

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
        for tracker, places in zip(self._places, (footprints.road, footprints.junction), strict=True):
            tracker.check(t_us, places)
        changes = self._rearrange(footprints) if footprints.ids != self._ids else []
        order, ids = self._order, self._sorted_ids
        changes += self._pairs.update(
            t_us, serials=self._serials, ids=ids, table=object_table(footprints).take(order, axis=1)
        )
        changes += self._moving.update(t_us, footprints.speed_mps.take(order), ids)
        for tracker, places in zip(self._places, (footprints.road, footprints.junction), strict=True):
            changes += tracker.update(t_us, places.take(order), ids)
        if len(self._only) < len(RANK):
            changes = [change for change in changes if change.name in self._only]
        changes.sort(key=_rank)
        return changes

    def _rearrange(self, footprints: Footprints) -> list[RelationChange]:
        """Take over another set, or another order, of objects."""
        t_us, changes = footprints.t_us, list[RelationChange]()
        present = set(footprints.ids)
        old_column = {object_id: column for column, object_id in enumerate(self._sorted_ids)}
        for object_id, column in old_column.items():
            if object_id not in present:
                changes.append(self._moving.forget(object_id, column, t_us))
                for tracker in self._places:
                    changes += tracker.forget(object_id, t_us)
        columns = np.array([old_column.get(object_id, -1) for object_id in footprints.ids], dtype=np.int64)
        fresh = np.flatnonzero(columns < 0)
        serials = (
            np.where(columns < 0, 0, self._serials.take(columns)) if len(self._serials) else np.zeros_like(columns)
        )
        serials[fresh] = np.arange(self._next_serial, self._next_serial + len(fresh))
        self._next_serial += len(fresh)
        order = np.argsort(serials)
        self._order, self._serials, columns = order, serials[order], columns[order]
        self._ids, self._sorted_ids = footprints.ids, [footprints.ids[k] for k in order]
        self._moving.keep(columns, t_us)
        for tracker, places in zip(self._places, (footprints.road, footprints.junction), strict=True):
            changes += tracker.keep(columns, places.take(order), self._sorted_ids, t_us)
        return changes


def _rank(change: RelationChange) -> tuple[int, int, int, tuple[str, ...]]:
    ending = 0 if change.new is None else 1 + change.new
    return change.t_us, ending, RANK[change.name], change.args
