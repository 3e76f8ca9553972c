"""Where are the partial instances of one set of matched positions kept, and when are they forgotten?

A million of them must fit into memory, so one is a row: a tuple of numbers and texts only (Python's garbage collector
stops looking at such tuples), and the events in it are not kept, as `live.programs` tells. Rows come in the order of
time. They stand in a queue, and for each step that asks for certain values in an index from those values to the rows.

Rows are dropped from the front of the queue, a few each time some are added, so that no event has to wait for a big
clean-up. A row behind one that lives longer stays a little beyond its deadline; no step extends it, because the
windows of a step end at the deadline at the latest.
"""

from collections import deque
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from operator import itemgetter
from typing import Any  # a row is a heterogeneous tuple, see `live.programs`

Row = tuple[Any, ...]
Index = dict[Hashable, Row | list[Row]]

_NEVER_LOOKED_US = -(2**62)
_DROPPED_AT_ONCE = 32


class Rows:
    """Rows of one state; invariant: queue and buckets hold the same rows in the same order.

    A bucket that holds one row is the row itself: with a key a thing most buckets do, and lists are big.
    """

    __slots__ = ("_deadline", "_due_us", "_index_at", "_indexes", "queue")

    def __init__(self, deadline: Callable[[Row], int]) -> None:
        self.queue: deque[Row] = deque()
        self._deadline = deadline
        self._due_us = _NEVER_LOOKED_US  # no row in front is past its deadline before this time
        self._indexes: list[tuple[Callable[[Row], Hashable], Index]] = []
        self._index_at: dict[tuple[int, ...], Index] = {}

    def index_by(self, places: tuple[int, ...]) -> Mapping[Hashable, Iterable[Any]]:
        """Keep an index by the values at some places of a row: the value if it is one, else a tuple of them.

        By no places all rows are under None. Called while there are no rows yet.
        """
        if not places:
            return {None: self.queue}
        if places not in self._index_at:
            self._index_at[places] = {}
            self._indexes.append((itemgetter(*places), self._index_at[places]))
        return self._index_at[places]

    def add(self, rows: Sequence[Row], now_us: int) -> None:
        """Keep rows that were made at `now_us`, and drop some whose deadline is over."""
        self.queue.extend(rows)
        for key_of, index in self._indexes:
            for row in rows:
                key = key_of(row)
                bucket = index.get(key)
                if bucket is None:
                    index[key] = row
                elif isinstance(bucket, list):
                    bucket.append(row)
                else:
                    index[key] = [bucket, row]
        if now_us > self._due_us:
            self.drop(now_us, _DROPPED_AT_ONCE + len(rows))

    def drop(self, now_us: int, most: int) -> None:
        """Drop up to `most` rows from the front whose deadline is before `now_us`."""
        queue, deadline = self.queue, self._deadline
        for _ in range(most):
            if not queue:
                self._due_us = _NEVER_LOOKED_US
                return
            row = queue[0]
            if deadline(row) >= now_us:
                break
            queue.popleft()
            for key_of, index in self._indexes:
                key = key_of(row)
                bucket = index[key]
                if bucket is row:
                    del index[key]
                elif len(bucket) == 2:
                    index[key] = bucket[1]
                else:
                    del bucket[0]  # type: ignore[union-attr]  # a list, whose order is that of the queue
        # Looking is dearer than dropping: the next look comes when there are some to drop, but no more than live.
        self._due_us = deadline(queue[min(len(queue) // 2, _DROPPED_AT_ONCE // 2)]) if queue else _NEVER_LOOKED_US

    def replace(self, rows: Iterable[Row]) -> None:
        """Forget all rows and keep these, given in the order in which they once were added."""
        self.queue.clear()
        for _, index in self._indexes:
            index.clear()
        self._due_us = _NEVER_LOOKED_US
        self.add(list(rows), _NEVER_LOOKED_US)
