"""Which pairs are looked at, and what has changed between them?

Cars that are near each other, cars that are near in time (at their speed), and cars that drive towards each other. A
pair of which one is not seen in a frame neither comes in nor goes with that frame. What never moved takes part in no
pair: it may be a shadow, a mark on the road, or a car burned into the background.

Pairs are found and measured for many looks at once; what has changed is told look by look.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from qsr.changes.crossings import RelationChange
from qsr.changes.looks import Doubt, Look, Objects, differs
from qsr.changes.one_vehicle import OneVehicle
from qsr.changes.pair_observer import PairObserver
from qsr.measuring.conflicts import oncoming_values
from qsr.measuring.footprints import HALF_LENGTH, BoolArray, FloatArray, LongArray, X, Y
from qsr.measuring.pairs import NearSet, facing_pairs, near_in_time, pair_keys, pairs_within
from qsr.measuring.road_relations import switch_margins, switch_noise, switch_values
from qsr.relations import (
    FACING_RELATIONS,
    NEAR_IN_TIME_RELATIONS,
    NEAR_RELATIONS,
    PairRelation,
    Switch,
    asked_for,
    switches_of,
)
from qsr.settings import RelationSettings


@dataclass(frozen=True, slots=True)
class Found:
    """Hold pairs of some looks that are near enough to stay if they were there, those of each look together.

    Attributes
    ----------
    starts : (looks + 1,) where the pairs of each look begin, and how many there are.
    keys : (pairs,) as from `qsr.measuring.pairs.pair_keys`.
    columns : (2, pairs) of the objects among those of their look.
    enters : (pairs,) which are near enough to come in.
    values : (switches, pairs) the quantity of every switch.
    """

    starts: LongArray
    keys: LongArray
    columns: LongArray
    enters: BoolArray
    values: FloatArray

    @classmethod
    def of(cls, objects: Objects, pairs: LongArray, enters: BoolArray, values: FloatArray) -> Self:
        """Hold what was found of pairs, (2, pairs), in lexicographic order."""
        starts = objects.starts_of(pairs)
        columns = pairs if len(objects.looks) == 1 else pairs - objects.starts[:-1].repeat(np.diff(starts))
        return cls(starts, pair_keys(objects.serials, pairs), columns, enters, values)

    def where(self, is_wanted: BoolArray, enters: BoolArray) -> Self:
        """Keep some pairs, (pairs,), and say anew which of all come in, (pairs,)."""
        starts, rows = np.append(0, is_wanted.cumsum())[self.starts], is_wanted.nonzero()[0]
        columns, values = self.columns.take(rows, axis=1), self.values.take(rows, axis=1)
        return replace(self, starts=starts, keys=self.keys[rows], columns=columns, enters=enters[rows], values=values)

    def of_look(self, number: int) -> tuple[LongArray, LongArray, BoolArray, FloatArray]:
        """Give keys, columns, enters and values of one look."""
        some = slice(*self.starts[number : number + 2])
        return self.keys[some], self.columns[:, some], self.enters[some], self.values[:, some]


class NearCars:
    """Look at cars that are near each other in the plane, and at cars whose time gap or conflict may matter.

    The latter are looked at from further away the faster they are. Whoever is near in the plane counts as near in time
    as well, so those near in time are found and measured, by as many switches as the names ask for, and the others are
    picked out of them.
    """

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self._settings = settings
        self._one_vehicle = OneVehicle(settings)
        margins = switch_margins(settings)
        self._in_time, self._near = asked_for(NEAR_IN_TIME_RELATIONS, names), asked_for(NEAR_RELATIONS, names)
        self.kept = [KeptPairs(some, margins, settings) for some in (self._in_time, self._near) if some]
        self._rows = max((kept.rows for kept in self.kept), default=0)

    def find(self, objects: Objects) -> Sequence[Found]:
        """Find and measure pairs for each of ``kept``, as far as something new is known of them.

        Call it with each look once, in their order.
        """
        if not self.kept:
            return ()
        settings, table = self._settings, objects.table
        if self._in_time:
            pairs, distance_m, enters = near_in_time(table, settings, objects.starts)
        else:
            radius_m = settings.leave_radius_m
            pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], radius_m, objects.starts)
            enters = distance_m <= settings.enter_radius_m
        is_measured = objects.measured(pairs)
        if is_measured is not None:
            pairs, distance_m, enters = pairs[:, is_measured], distance_m[is_measured], enters[is_measured]
        are_two = self._one_vehicle.are_two(objects, pairs, distance_m) & objects.have_moved(pairs)
        if not are_two.all():
            pairs, distance_m, enters = pairs[:, are_two], distance_m[are_two], enters[are_two]
        values = switch_values(table, pairs, settings, rows=self._rows, routes=objects.routes)
        if is_measured is not None:  # of frames that are looked at again, nobody saw that they nearly met
            values[Switch.SHORT_TTC :, objects.is_again(pairs)] = -1.0
        found = [Found.of(objects, pairs, enters, values)]
        if len(self.kept) == 2:
            stays, enters = distance_m <= settings.leave_radius_m, distance_m <= settings.enter_radius_m
            found.append(found[0].where(stays, enters))
        return found


class FacingCars:
    """Look at cars that drive in opposite directions on one road or on a route, from further away."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        relations = asked_for(FACING_RELATIONS, names)
        self._settings = settings
        self.kept = [KeptPairs(relations, np.array([settings.oncoming_margin_s]), settings)] if relations else []

    def find(self, objects: Objects) -> Sequence[Found]:
        """Find and measure pairs, as `NearCars.find` does."""
        if not self.kept:
            return ()
        table, routes = objects.table, objects.routes
        pairs, distance_m = facing_pairs(table, self._settings, routes, objects.starts)
        is_asked, is_measured = objects.have_moved(pairs), objects.measured(pairs)
        if is_measured is not None:
            is_asked &= is_measured
        if not is_asked.all():
            pairs, distance_m = pairs[:, is_asked], distance_m[is_asked]
        route_m = None if routes is None else routes.facing_m(pairs)
        values = oncoming_values(table.take(pairs, axis=1), self._settings, route_m)
        return [Found.of(objects, pairs, distance_m <= self._settings.oncoming_enter_m, values)]


class KeptPairs:
    """Keep the pairs that there are, and some of their relations.

    Parameters
    ----------
    relations : of the pairs.
    margins : of their switches, and of more.
    settings : thresholds.

    Attributes
    ----------
    rows : how many switches the relations need, from the first on.
    """

    def __init__(self, relations: Sequence[PairRelation], margins: FloatArray, settings: RelationSettings) -> None:
        self.rows = 1 + max(switches_of(relations))
        self._near = NearSet()
        margins = margins[: self.rows]
        noise = partial(switch_noise, margins=margins, settings=settings)
        self._relations = PairObserver(relations, margins, noise=noise, backdate_us=settings.backdate_us)

    def differs(self, found: Found) -> BoolArray:
        """Tell in which looks pairs show something else than in the look before, (looks,)."""
        return differs(found.starts, found.keys, found.enters, self._relations.sides(found.values[: self.rows]))

    def update(self, look: Look, found: Found, number: int) -> list[RelationChange]:
        """Take one look, by its number among those of the pairs, and return the changes, in no particular order.

        Those pairs that are not measured stay, as far as both are still there.
        """
        keys, columns, enters, values = found.of_look(number)
        values, held = values[: self.rows], None
        if look.observed is not None:
            kept = self._near.columns(look.serials)
            kept = kept[:, ~look.is_measured(kept)]
            keys = np.concatenate((pair_keys(look.serials, kept), keys))
            order = keys.argsort()
            held = order < kept.shape[1]
            keys, columns = keys.take(order), np.concatenate((kept, columns), axis=1).take(order, axis=1)
            enters = np.concatenate((np.ones(kept.shape[1], np.bool_), enters)).take(order)
            values = np.concatenate((np.zeros((self.rows, kept.shape[1])), values), axis=1).take(order, axis=1)
        pairs = self._near.update(keys, enters)
        if len(pairs.rows) < len(keys):
            columns, values = columns.take(pairs.rows, axis=1), values.take(pairs.rows, axis=1)
            held = None if held is None else held.take(pairs.rows)
        return self._relations.update(look, pairs, columns, values=values, held=held)

    def doubt(self, t_us: int, doubt: Doubt) -> list[RelationChange]:
        """Tell unknown what concerns objects of which nothing is known; see `PairObserver.doubt`."""
        return self._relations.doubt(t_us, doubt)
