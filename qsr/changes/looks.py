"""How is a frame looked at, and how are many frames at once?

A frame is looked at once for all who are seen in it, and again for those of whom it turns out later that they were
there. Within each look objects stand in order of first appearance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gis.roads.lane_graph import LaneGraph
from qsr.measuring.footprints import (
    OBSERVED,
    BoolArray,
    FloatArray,
    Footprints,
    LongArray,
    object_table,
    stacked,
)
from qsr.measuring.routes import Routes

# (..., n) numbers or truth values of n objects or pairs.
Reading = NDArray[Any]

# Later than every frame.
NEVER_US = 2**62


@dataclass(frozen=True, slots=True, eq=False)
class Doubt:
    """Say of which objects nothing is known for the time being, and of which again.

    Attributes
    ----------
    since_us : (n,) from when on nothing is known; `NEVER_US` for the others.
    was_told : (n,) True for those of which that was told before.
    """

    since_us: LongArray
    was_told: BoolArray

    @property
    def is_hidden(self) -> BoolArray:
        """Of which nothing is known, (n,)."""
        is_hidden: BoolArray = self.since_us < NEVER_US
        return is_hidden

    @property
    def is_new(self) -> BoolArray:
        """Of which that is to be told now, (n,)."""
        return self.is_hidden & ~self.was_told

    @property
    def has_returned(self) -> BoolArray:
        """Of which it is known again what happens, (n,)."""
        return self.was_told & ~self.is_hidden


@dataclass(frozen=True, slots=True)
class Gone:
    """Say of an object that is gone since when it has not been seen, and whether that was told.

    Its column is the one that it had in the look before.
    """

    since_us: int
    is_told: bool
    column: int


@dataclass(frozen=True, slots=True)
class Look:
    """Hold how one frame is looked at; entry k of every array belongs to ``ids[k]``.

    Attributes
    ----------
    footprints : of all objects that are kept, also of those who are not seen, in any order.
    order : (n,) their rows in order of first appearance.
    ids : n names.
    serials : (n,) a number per object, rising, and never used for another object.
    came_from : (n,) column in the look before, -1 for who is new; None if the objects are the same.
    observed : (n,) which objects are seen in this frame; None if all are.
    returned : (n,) of a frame that is looked at again, those of whom it is known only now where they were. None of one
        that comes for the first time.
    gone : who was there in the last frame and is not any more.
    doubt : of whom nothing is known; None if of nobody.
    """

    footprints: Footprints
    order: LongArray
    ids: Sequence[str]
    serials: LongArray
    came_from: LongArray | None
    observed: BoolArray | None
    returned: BoolArray | None = None
    gone: Mapping[str, Gone] = field(default_factory=dict)
    doubt: Doubt | None = None

    @property
    def t_us(self) -> int:
        """Time of the frame."""
        return self.footprints.t_us

    @property
    def fresh(self) -> list[str]:
        """Who was not there in the look before."""
        return [] if self.came_from is None else [self.ids[k] for k in (self.came_from < 0).nonzero()[0].tolist()]

    @property
    def is_plain(self) -> bool:
        """Whether the objects are those of the look before, and nothing is new but where they are."""
        return self.came_from is None and self.returned is None and self.doubt is None

    @property
    def sigma_m(self) -> FloatArray:
        """Noise of each centre, (n,); nan where it is not known."""
        return self.footprints.sigma_m.take(self.order)

    @property
    def measured(self) -> BoolArray | None:
        """Which objects are looked at, (n,); None if all are."""
        return self.observed if self.returned is None else self.returned

    def is_measured(self, pairs: LongArray) -> BoolArray:
        """Tell of which pairs, (2, pairs), something new is known: both are seen, and not both were known before.

        Examples
        --------
        >>> pairs, one = np.array([[0, 1, 0], [1, 2, 2]]), (None, np.arange(3), "abc", np.arange(3), None)
        >>> Look(*one, observed=np.array([True, True, False])).is_measured(pairs).tolist()
        [True, False, False]
        >>> seen, returned = np.ones(3, np.bool_), np.array([False, False, True])
        >>> Look(*one, observed=seen, returned=returned).is_measured(pairs).tolist()
        [False, True, True]
        """
        if self.observed is None:
            return np.ones(pairs.shape[1], np.bool_)
        measured = np.asarray(self.observed.take(pairs).all(axis=0))
        if self.returned is not None:
            measured &= self.returned.take(pairs).any(axis=0)
        return measured


@dataclass(frozen=True, slots=True)
class Objects:
    """Hold the objects of some looks, those of one look behind those of the other.

    Attributes
    ----------
    looks : at least one.
    starts : (looks + 1,) where the objects of each look begin, and n.
    serials : (n,) as in `Look`.
    shown : the objects as if they were those of one frame; row ``order[k]`` is object k.
    table : (13, n) as made by `qsr.measuring.footprints.object_table`.
    routes : the ways between them; None where the map says nothing of them.
    """

    looks: Sequence[Look]
    starts: LongArray
    serials: LongArray
    shown: Footprints
    order: LongArray
    table: FloatArray
    routes: Routes | None

    @classmethod
    def of(cls, looks: Sequence[Look], *, widest_m: float, graph: LaneGraph | None) -> Self:
        """Lay out the objects of some looks."""
        shown = stacked([look.footprints for look in looks])
        starts = np.cumsum([0, *(len(look.ids) for look in looks)])
        order = np.concatenate([look.order + start for look, start in zip(looks, starts[:-1], strict=True)])
        serials = np.concatenate([look.serials for look in looks])
        table = object_table(shown, widest_m=widest_m).take(order, axis=1)
        routes = None if graph is None else Routes.of(graph, shown, order)
        return cls(looks, starts, serials, shown, order, table, routes)

    def of_look(self, quantity: Reading, number: int) -> Reading:
        """Give what was measured of the objects of one look, out of that of all, (n,)."""
        return quantity[self.starts[number] : self.starts[number + 1]]

    def have_moved(self, pairs: LongArray) -> BoolArray:
        """Tell of which pairs, (2, pairs), both have ever moved."""
        has_moved = self.shown.has_moved
        if has_moved.all():
            return np.ones(pairs.shape[1], np.bool_)
        return np.asarray(has_moved.take(self.order).take(pairs).all(axis=0))

    def measured(self, pairs: LongArray) -> BoolArray | None:
        """Tell of which pairs, (2, pairs), something new is known, as `Look.is_measured` does; None of all."""
        if all(look.observed is None for look in self.looks):
            return None
        is_measured = (self.table[OBSERVED] > 0).take(pairs).all(axis=0)
        if any(look.returned is not None for look in self.looks):
            returned = np.ones(len(self.order), np.bool_)
            for number, look in enumerate(self.looks):
                if look.returned is not None:
                    self.of_look(returned, number)[:] = look.returned
            is_measured &= returned.take(pairs).any(axis=0)
        return np.asarray(is_measured)

    def is_again(self, pairs: LongArray) -> BoolArray:
        """Tell which pairs are of frames that are looked at again."""
        is_again = np.array([look.returned is not None for look in self.looks])
        return np.asarray(is_again.repeat(np.diff(self.starts)).take(pairs[0]))

    def starts_of(self, pairs: LongArray) -> LongArray:
        """Say where the pairs of each look begin, and how many there are, (looks + 1,)."""
        return np.asarray(pairs[0].searchsorted(self.starts))


def differs(starts: LongArray, *readings: Reading) -> BoolArray:
    """Tell which looks show something else than the look before, (looks,); the first one does.

    Parameters
    ----------
    starts : (looks + 1,) where the objects or pairs of each look begin, and n.
    readings : of all of them.

    Examples
    --------
    >>> differs(np.array([0, 2, 4, 6, 7]), np.array([5, 6, 5, 6, 5, 7, 5])).tolist()
    [True, False, True, True]
    """
    counts = np.diff(starts)
    is_other = np.append(True, counts[1:] != counts[:-1])
    look = np.arange(len(counts)).repeat(np.where(is_other, 0, counts))
    rows = (~is_other).repeat(counts).nonzero()[0]
    before = rows - counts.take(look)
    for reading in readings:
        is_new = reading.take(rows, axis=-1) != reading.take(before, axis=-1)
        is_other[look[np.atleast_2d(is_new).any(axis=0)]] = True
    return is_other
