"""Which chronicles occur in stored columns of events?

The instances of a chronicle are found by joins of whole columns (`joins.py`). Where that is all there is to a set of
chronicles, its occurrences stay columns until somebody looks at them. Otherwise the engine of the recogniser takes the
events one by one, and the joined instances stand in for those that it would have found: what concludes, selects, emits
and orders is the same code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from heapq import merge
from operator import itemgetter

import numpy as np

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.events import Event, Occurrence
from chronicles.execution.engine import Engine
from chronicles.execution.instances import Instance
from chronicles.execution.live.eager import Completed
from chronicles.execution.results import is_told_at_once
from chronicles.execution.stored.columns import EventColumns
from chronicles.execution.stored.found import FoundOccurrences, as_stored
from chronicles.execution.stored.joins import MOST_ROWS
from chronicles.execution.stored.matches import Matches, find_matches

_MATCHES_AT_A_TIME = 1 << 14


def recognise_columns(
    chronicles: ChronicleSet, columns: EventColumns, *, until_us: int | None = None, most_rows: int = MOST_ROWS
) -> Sequence[Occurrence]:
    """Recognise chronicles in stored columns; the results are those of a recogniser fed event by event.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    columns : the events.
    until_us : the time up to which the events are complete; the latest event's time if not given.
    most_rows : how many rows a block of time or a table in between may have; bounds the memory used on the way.
    """
    if all(is_told_at_once(plan) for plan in chronicles.plans):
        return FoundOccurrences([find_matches(plan, columns, most_rows=most_rows) for plan in chronicles.plans])

    engine = Engine(chronicles, 0, columns.events)
    found: list[Occurrence] = []
    for event, complete in _completed(chronicles, columns, most_rows):
        found += engine.conclude(event, complete)
    if until_us is not None:
        found += engine.advance(until_us)
    return [as_stored(one) for one in found]


def _completed(chronicles: ChronicleSet, columns: EventColumns, most_rows: int) -> Iterator[tuple[Event, Completed]]:
    """Give the events in the order of time, each with the joined instances that it completes."""
    placed = levels(chronicles.plans)
    plans = [(number, plan) for number, plan in enumerate(chronicles.plans) if placed[plan.name][0] == 0]
    joined = [_joined(number, find_matches(plan, columns, most_rows=most_rows)) for number, plan in plans]
    queue = merge(*joined, key=itemgetter(0, 1))
    following = next(queue, None)
    for step, event in enumerate(columns.events):
        complete: Completed = []
        while following is not None and following[0] == step:
            complete.append((following[1], [following[2]]))
            following = next(queue, None)
        yield event, complete


def _joined(number: int, matches: Matches) -> Iterator[tuple[int, int, Instance]]:
    """Give instances in the order of their last events, each with its place and the number of its chronicle."""
    steps = matches.steps()
    order = np.argsort(steps, kind="stable")
    for start in range(0, len(order), _MATCHES_AT_A_TIME):
        part = order[start : start + _MATCHES_AT_A_TIME]
        for step, instance in zip(steps[part].tolist(), matches.picked(part).instances(), strict=True):
            yield step, number, instance
