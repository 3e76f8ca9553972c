"""Which pairs are looked at, and what has changed between them?

Cars that are near each other, cars that are near in time (at their speed), and cars that drive towards each other. A
pair of which one is not seen in a frame neither comes in nor goes with that frame.

Of some pairs nothing is said, since what would be told is a tracker's mistake. Bodies cannot be in each other: who
overlaps for longer, and deeper than noise explains, is one vehicle under two names, or in two pieces. And what never
moved may be a shadow, a mark on the road, or a car burned into the background.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from qsr.changes.crossings import RelationChange
from qsr.changes.pair_observer import Doubt, Gone, PairObserver
from qsr.measuring.conflicts import oncoming_values
from qsr.measuring.footprints import HALF_LENGTH, BoolArray, FloatArray, LongArray, X, Y
from qsr.measuring.free_space import FreeSpace
from qsr.measuring.pairs import NearPairs, NearSet, facing_pairs, near_in_time, pairs_within
from qsr.measuring.road_relations import switch_margins, switch_values
from qsr.measuring.routes import Routes
from qsr.relations import (
    FACING_RELATIONS,
    NEAR_IN_TIME_RELATIONS,
    NEAR_RELATIONS,
    PairRelation,
    Switch,
    asked_for,
)
from qsr.settings import RelationSettings


@dataclass(frozen=True, slots=True)
class ObjectsNow:
    """Hold the objects of one frame, in order of their first appearance.

    Attributes
    ----------
    t_us : time of the frame.
    ids : n names.
    serials : (n,) a number per object, rising, and never used for another object.
    table : (13, n) as made by `qsr.measuring.footprints.object_table`.
    has_moved, sigma_m : (n,) as in `qsr.measuring.footprints.Footprints`.
    observed : (n,) which objects are seen in this frame; None if all are.
    returned : (n,) of a frame that is looked at again, those of whom it is known only now where they were. None of one
        that comes for the first time.
    routes : the ways between them; None where the map says nothing of them.
    gone : who was there in the last frame and is not any more.
    """

    t_us: int
    ids: Sequence[str]
    serials: LongArray
    table: FloatArray
    has_moved: BoolArray
    sigma_m: FloatArray
    observed: BoolArray | None
    returned: BoolArray | None = None
    routes: Routes | None = None
    gone: Mapping[str, Gone] = field(default_factory=dict)

    @property
    def measured(self) -> BoolArray | None:
        """Which objects are looked at, (n,); None if all are."""
        return self.observed if self.returned is None else self.returned

    def is_measured(self, pairs: LongArray) -> BoolArray:
        """Tell of which pairs, (2, pairs), something new is known: both are seen, and not both were known before.

        Examples
        --------
        >>> pairs, three = np.array([[0, 1, 0], [1, 2, 2]]), (np.zeros((13, 3)), np.ones(3, np.bool_), np.zeros(3))
        >>> ObjectsNow(0, "abc", np.arange(3), *three, np.array([True, True, False])).is_measured(pairs).tolist()
        [True, False, False]
        >>> seen, returned = np.ones(3, np.bool_), np.array([False, False, True])
        >>> ObjectsNow(0, "abc", np.arange(3), *three, seen, returned).is_measured(pairs).tolist()
        [False, True, True]
        """
        if self.observed is None:
            return np.ones(pairs.shape[1], np.bool_)
        measured = np.asarray(self.observed.take(pairs).all(axis=0))
        if self.returned is not None:
            measured &= self.returned.take(pairs).any(axis=0)
        return measured


class NearCars:
    """Look at cars that are near each other in the plane, and at cars whose time gap or conflict may matter.

    The latter are looked at from further away the faster they are. Whoever is near in the plane counts as near in time
    as well, so those near in time are found and measured, by as many switches as the names ask for, and the others are
    picked out of them.
    """

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        near, in_time = asked_for(NEAR_RELATIONS, names), asked_for(NEAR_IN_TIME_RELATIONS, names)
        self._settings = settings
        self._one_vehicle = OneVehicle(settings)
        self._near_rows, self._rows = _rows_used(near), _rows_used((*near, *in_time))
        margins = switch_margins(settings)
        self._near = _Kept(near, margins[: self._near_rows], settings) if near else None
        self._in_time = _Kept(in_time, margins[: self._rows], settings) if in_time else None

    def update(self, now: ObjectsNow) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order."""
        if self._in_time is None:
            return [] if self._near is None else self._update_near(self._near, now)
        settings = self._settings
        pairs, distance_m, is_near = near_in_time(now.table, settings)
        pairs, distance_m, is_near = self._one_vehicle.leave_out(now, pairs, distance_m, is_near)
        in_time = self._in_time.find(now, pairs, is_near)
        values = self._values(now, in_time.columns, self._rows)
        changes = self._in_time.update(now, in_time, values)
        if self._near is not None:
            rows = (distance_m <= settings.leave_radius_m).nonzero()[0]
            is_near = distance_m.take(rows) <= settings.enter_radius_m
            near = self._near.find(now, pairs.take(rows, axis=1), is_near)
            among = in_time.keys.searchsorted(near.keys)
            changes += self._near.update(now, near, values[: self._near_rows].take(among, axis=1))
        return changes

    def _update_near(self, kept: "_Kept", now: ObjectsNow) -> list[RelationChange]:
        settings, table = self._settings, now.table
        pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], settings.leave_radius_m)
        pairs, _, is_near = self._one_vehicle.leave_out(now, pairs, distance_m, distance_m <= settings.enter_radius_m)
        near = kept.find(now, pairs, is_near)
        return kept.update(now, near, self._values(now, near.columns, self._near_rows))

    def doubt(self, t_us: int, doubt: Doubt) -> list[RelationChange]:
        """Tell unknown what concerns objects of which nothing is known; see `PairObserver.doubt`."""
        kinds = [one for one in (self._near, self._in_time) if one is not None]
        return [change for one in kinds for change in one.relations.doubt(t_us, doubt)]

    def _values(self, now: ObjectsNow, columns: LongArray, rows: int) -> FloatArray:
        """Measure the pairs of which something new is known; the others, whatever stands there, are not looked at."""
        if now.observed is None:
            return switch_values(now.table, columns, self._settings, rows=rows, routes=now.routes)
        values, measured = np.zeros((rows, columns.shape[1])), now.is_measured(columns)
        asked = columns[:, measured]
        values[:, measured] = switch_values(now.table, asked, self._settings, rows=rows, routes=now.routes)
        if now.returned is not None:  # nobody saw that they nearly met
            values[Switch.SHORT_TTC :, measured] = -1.0
        return values


class FacingCars:
    """Look at cars that drive in opposite directions on one road or on a route, from further away."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        relations = asked_for(FACING_RELATIONS, names)
        self._settings = settings
        self._kept = _Kept(relations, np.array([settings.oncoming_margin_s]), settings) if relations else None

    def update(self, now: ObjectsNow) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order."""
        if self._kept is None:
            return []
        pairs, distance_m = facing_pairs(now.table, self._settings, now.routes)
        if not now.has_moved.all():
            kept = now.has_moved.take(pairs).all(axis=0)
            pairs, distance_m = pairs[:, kept], distance_m[kept]
        facing = self._kept.find(now, pairs, distance_m <= self._settings.oncoming_enter_m)
        route_m = None if now.routes is None else now.routes.facing_m(facing.columns)
        ends = now.table.take(facing.columns, axis=1)
        return self._kept.update(now, facing, oncoming_values(ends, self._settings, route_m))

    def doubt(self, t_us: int, doubt: Doubt) -> list[RelationChange]:
        """Tell unknown what concerns objects of which nothing is known; see `PairObserver.doubt`."""
        return [] if self._kept is None else self._kept.relations.doubt(t_us, doubt)


class OneVehicle:
    """Keep which pairs are no two vehicles that drive.

    Parameters
    ----------
    settings : thresholds.
    """

    __slots__ = ("_settings", "_since_us", "_until_us")

    def __init__(self, settings: RelationSettings) -> None:
        self._settings = settings
        # Both by the key of a pair, as in `NearSet`.
        self._since_us: dict[int, int] = {}  # from which frame on it overlaps
        self._until_us: dict[int, int] = {}  # up to when it counts as one vehicle

    def leave_out(
        self, now: ObjectsNow, pairs: LongArray, distance_m: FloatArray, is_near: BoolArray
    ) -> tuple[LongArray, FloatArray, BoolArray]:
        """Take such pairs out of those of a frame, (2, pairs) and (pairs,), as `near_in_time` gives them."""
        knows_noise = not np.isnan(now.sigma_m).all()  # else nobody knows what noise explains
        if not knows_noise and now.has_moved.all():
            return pairs, distance_m, is_near
        kept: BoolArray = np.asarray(now.has_moved.take(pairs).all(axis=0))
        touching = (distance_m < self._settings.widest_m).nonzero()[0]  # the others are apart, however they lie
        if knows_noise and now.returned is None and (len(touching) or self._since_us or self._until_us):
            touching = touching[now.is_measured(pairs.take(touching, axis=1))]
            self._note(now, pairs, touching[self._overlaps(now, pairs.take(touching, axis=1))])
        if self._until_us:
            kept &= ~np.isin(_keys(now, pairs), list(self._until_us))
        return (pairs, distance_m, is_near) if kept.all() else (pairs[:, kept], distance_m[kept], is_near[kept])

    def _overlaps(self, now: ObjectsNow, pairs: LongArray) -> BoolArray:
        ends = now.table.take(pairs, axis=1)
        noise_m = self._settings.sigma_factor * np.hypot(*now.sigma_m.take(pairs))
        overlaps: BoolArray = FreeSpace.of(ends).depth_m(ends) > np.maximum(noise_m, self._settings.margin_m)
        return overlaps

    def _note(self, now: ObjectsNow, pairs: LongArray, overlapping: LongArray) -> None:
        t_us, settings = now.t_us, self._settings
        keys = _keys(now, pairs.take(overlapping, axis=1)).tolist()
        since_us = {key: self._since_us.get(key, t_us) for key in keys}
        if now.observed is not None and self._since_us.keys() - since_us.keys():
            # Those of which one is not seen now may overlap still.
            unseen, first_us = set(now.serials[~now.observed].tolist()), t_us - settings.double_us
            old = ((key, us) for key, us in self._since_us.items() if us >= first_us)
            since_us |= {key: us for key, us in old if not unseen.isdisjoint((key >> 31, key & (2**31 - 1)))}
        self._since_us = since_us
        self._until_us = {key: us for key, us in self._until_us.items() if us > t_us}
        doubled = [key for key in keys if t_us - since_us[key] >= settings.place_dwell_us]
        self._until_us |= dict.fromkeys(doubled, t_us + settings.double_us)


def _keys(now: ObjectsNow, pairs: LongArray) -> LongArray:
    keys: LongArray = (now.serials.take(pairs[0]) << 31) | now.serials.take(pairs[1])
    return keys


class _Kept:
    """Keep the pairs of one kind, and their relations."""

    __slots__ = ("_near", "relations")

    def __init__(self, relations: Sequence[PairRelation], margins: FloatArray, settings: RelationSettings) -> None:
        self._near = NearSet()
        self.relations = PairObserver(relations, margins, margin_m=settings.margin_m, backdate_us=settings.backdate_us)

    def find(self, now: ObjectsNow, pairs: LongArray, is_near: BoolArray) -> NearPairs:
        """Find the pairs of a frame: those that are near, and of those that are not measured all that there were."""
        if now.observed is None:
            return self._near.update(now.serials, pairs, is_near)
        kept = self._near.columns(now.serials)
        kept = kept[:, ~now.is_measured(kept)]
        measured = now.is_measured(pairs)
        pairs = np.concatenate((kept, pairs[:, measured]), axis=1)
        is_near = np.concatenate((np.ones(kept.shape[1], np.bool_), is_near[measured]))
        order = np.lexsort(pairs[::-1])
        return self._near.update(now.serials, pairs.take(order, axis=1), is_near.take(order))

    def update(self, now: ObjectsNow, pairs: NearPairs, values: FloatArray) -> list[RelationChange]:
        held = None if now.observed is None else ~now.is_measured(pairs.columns)
        return self.relations.update(
            now.t_us, ids=now.ids, sigma_m=now.sigma_m, pairs=pairs, values=values, held=held, gone=now.gone
        )


def _rows_used(relations: Sequence[PairRelation]) -> int:
    """Count the switches up to the last one that some relation needs."""
    used = [switch for relation in relations for switch in (*relation.switches, *relation.but_not)]
    return 1 + max(used, default=Switch.PAST_REAR)
