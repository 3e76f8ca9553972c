"""Which rows of stored columns make complete instances of a chronicle?

A range join: the rows of one position look up, with binary search in the sorted times of another position (of the same
values of shared variables), the range of rows that lie in their window; each pair becomes a row of the next, longer
table. The position with the fewest rows comes first. Before a table grows, every missing position is asked how many
rows fit, rows with an empty window are dropped, and the position with the fewest partners is joined next: the order
follows the data, not the text.

Work goes in blocks of time: the rows of the first position one stretch at a time, of the others what lies in their
windows. Blocks shrink until they hold no more than a given number of rows, and a table that would grow beyond it is
cut, so memory stays bounded whatever the length of the log.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce

import numpy as np

from chronicles.compilation.plan import Plan
from chronicles.execution.stored.columns import Codes, Fitting, Mask, Rows, Times, kind_of
from chronicles.execution.stored.row_index import Partners, RowIndex, is_too_long

MOST_ROWS = 1 << 17
"""How many rows a block of time, or a table between two joins, has at most."""


def complete_rows(plan: Plan, found: Sequence[Fitting], *, most_rows: int = MOST_ROWS) -> Iterator[list[Rows]]:
    """List all choices of rows that keep the bounds and agree in the values of variables.

    Parameters
    ----------
    plan : says how positions are bound to each other.
    found : the rows that fit each position.
    most_rows : how many rows a block or a table in between may have.

    Yields
    ------
    For each position the places in its `Fitting`, in parallel.
    """
    first = min(range(len(found)), key=lambda one: len(found[one].rows))
    distance = plan.distance_us
    pending = [slice(0, len(found[first].rows))] if len(found[first].rows) else []
    while pending:
        block = pending.pop()
        start_us, end_us = found[first].times_us[block][[0, -1]].tolist()
        parts = [
            _between(one.times_us, start_us - distance[index][first], end_us + distance[first][index])
            for index, one in enumerate(found)
        ]
        parts[first] = block
        rows = max(part.stop - part.start for part in parts)
        span_us = end_us - start_us + max(distance[first]) + max(one[first] for one in distance) + 1
        if block.stop - block.start > 1 and (rows > most_rows or is_too_long(rows, span_us)):
            middle = (block.start + block.stop) // 2
            pending += [slice(middle, block.stop), slice(block.start, middle)]
            continue
        if any(part.start >= part.stop for part in parts):
            continue
        cut = [one.cut(part) for one, part in zip(found, parts, strict=True)]
        join = _Join(plan, cut, most_rows)
        for places in join.extended({first: join.begin(first)}):
            yield [places[index] + part.start for index, part in enumerate(parts)]


def _between(times_us: Times, start_us: int, end_us: int) -> slice:
    """Give the places of the times in [start, end]."""
    return slice(int(np.searchsorted(times_us, start_us)), int(np.searchsorted(times_us, end_us, "right")))


class _Join:
    """Joins the rows of one block."""

    def __init__(self, plan: Plan, found: Sequence[Fitting], most_rows: int) -> None:
        self._plan = plan
        self._found = found
        self._most_rows = most_rows
        self._indexes: dict[tuple[int, tuple[int, ...]], RowIndex] = {}

    def begin(self, first: int) -> Rows:
        """Give the rows of the first position, those of the same values next to each other.

        Look-ups then go through the other indexes in their order, which is several times faster.
        """
        others = [one for one in range(len(self._found)) if one != first]
        rows = np.arange(len(self._found[first].rows))
        return self._index(first, _joined_slots(self._plan, first, others)).places(rows)

    def extended(self, table: dict[int, Rows]) -> Iterator[dict[int, Rows]]:
        """Extend a table, given as the places of each position joined so far, by all other positions."""
        missing = [one for one in range(len(self._found)) if one not in table]
        if not missing:
            yield table
            return
        partners: dict[int, Partners] = {}
        for one in missing:
            partners[one] = self._partners(one, table)
            keep = partners[one].counts > 0
            if not keep.any():
                return
            if not keep.all():
                table = {place: rows[keep] for place, rows in table.items()}
                partners = {place: found.picked(keep) for place, found in partners.items()}
        following = min(missing, key=lambda one: int(partners[one].counts.sum()))
        chosen = partners[following]
        for part in _stretches(chosen.counts, self._most_rows):
            cut = {place: rows[part] for place, rows in table.items()}
            longer = self._joined(cut, following, chosen.picked(part))
            if len(longer[following]):
                yield from self.extended(longer)

    def _partners(self, one: int, table: Mapping[int, Rows]) -> Partners:
        """Find the range of rows of a position that lie in the window of each row of a table."""
        known, distance = tuple(table), self._plan.distance_us
        lows, highs = _window(self._plan, one, known)
        times = {place: self._found[place].times_us[table[place]] for place in {*lows, *highs}}
        low_us = reduce(np.maximum, [times[place] - distance[one][place] for place in lows])
        high_us = reduce(np.minimum, [times[place] + distance[place][one] for place in highs])
        slots = _joined_slots(self._plan, one, known)
        index = self._indexes.get((one, slots))
        if index is None:
            index = self._indexes[one, slots] = self._index(one, slots)
        return index.partners([self._values(slot, table) for slot in slots], low_us, high_us)

    def _index(self, one: int, slots: tuple[int, ...]) -> RowIndex:
        found = self._found[one]
        return RowIndex(found.times_us, [found.slots[slot] for slot in slots])

    def _joined(self, table: Mapping[int, Rows], one: int, partners: Partners) -> dict[int, Rows]:
        """Pair each row with each of its partners; drop pairs of one event with itself and of equal variables."""
        counts = partners.counts
        ends = np.cumsum(counts)
        longer = {place: np.repeat(rows, counts) for place, rows in table.items()}
        places = np.arange(ends[-1] if len(ends) else 0) + np.repeat(partners.starts - ends + counts, counts)
        longer[one] = partners.index.places(places)
        keep: Mask | None = None
        for rival in _rivals(self._plan, one, tuple(table)):
            differs = self._found[rival].rows[longer[rival]] != self._found[one].rows[longer[one]]
            keep = differs if keep is None else keep & differs
        for first, second in _fresh_differences(self._plan, one, tuple(table)):
            differs = self._values(first, longer) != self._values(second, longer)
            keep = differs if keep is None else keep & differs
        return longer if keep is None else {place: rows[keep] for place, rows in longer.items()}

    def _values(self, slot: int, table: Mapping[int, Rows]) -> Codes:
        place = next(one for one in table if slot in self._found[one].slots)
        return self._found[place].slots[slot][table[place]]


def _stretches(counts: Rows, most_rows: int) -> Iterator[slice]:
    """Cut rows into stretches of at most so many partners together, or of one row."""
    ends = np.cumsum(counts)
    start = 0
    while start < len(counts):
        before = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + most_rows, "right")))
        yield slice(start, stop)
        start = stop


def _window(plan: Plan, position: int, known: Sequence[int]) -> tuple[list[int], list[int]]:
    """Give the known positions that bound the time of a position from below, and those that do from above.

    Those that follow from the others are left out: where the bounds by way of another known position add up to the
    direct one, the direct one follows, because the known times keep the bounds between each other.
    """
    distance = plan.distance_us
    lows, highs = list(known), list(known)
    for one in known:
        if any(distance[position][via] + distance[via][one] == distance[position][one] for via in lows if via != one):
            lows.remove(one)
        if any(distance[one][via] + distance[via][position] == distance[one][position] for via in highs if via != one):
            highs.remove(one)
    return lows, highs


def _joined_slots(plan: Plan, position: int, known: Sequence[int]) -> tuple[int, ...]:
    """Give the variables that a position shares with known ones, in the order of its fields."""
    bound = {slot for one in known for _, slot in plan.positions[one].test.variables}
    return tuple(slot for _, slot in plan.positions[position].test.variables if slot in bound)


def _fresh_differences(plan: Plan, position: int, known: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Give the pairs of variables that must differ and are both known only once the position is."""
    bound = {slot for one in known for _, slot in plan.positions[one].test.variables}
    together = bound | {slot for _, slot in plan.positions[position].test.variables}
    return tuple(pair for pair in plan.different if together.issuperset(pair) and not bound.issuperset(pair))


def _rivals(plan: Plan, position: int, known: Sequence[int]) -> tuple[int, ...]:
    """Give the known positions that could have taken the very same event."""
    kinds = [kind_of(one.test) for one in plan.positions]
    return tuple(one for one in known if kinds[one] == kinds[position])
