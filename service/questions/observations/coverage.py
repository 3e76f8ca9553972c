"""Which time did a run look at? Without it nobody can tell what did not happen from what nobody watched."""

import math
import time
from collections.abc import Iterable
from itertools import groupby, pairwise, zip_longest
from typing import NamedTuple

from msgspec import Struct
from sqlalchemy import func, select

from service.questions.events.queries import EventFilter
from service.records.runs import RunRecord
from service.store import schema
from service.store.chunks.kinds import FRAMES
from service.store.log import EventLog

Spans = tuple[tuple[int, int], ...]

MAX_RUNS = 100
"""So many runs are told of beside a list; their number is not bounded, and a page is."""
LOOK_EVERY_S = 1.0


class _State(NamedTuple):
    """How far a run has come, as far as what it looked at depends on it."""

    id: str
    source: str
    status: str
    last_span_us: int | None


class LookedAt(Struct, frozen=True):
    """The media time that a run looked at.

    Attributes
    ----------
    spans_us : from the first frame to the last, without the time in which the view was lost; none without frames.
    """

    run: str
    source: str
    spans_us: Spans


def lost_views(log: EventLog, run_id: str) -> Spans | None:
    """Tell when the view was lost: from a row without a map to the next one with a map, or to the end of the run.

    None for a run that says nothing of its view, as one whose camera never moved.
    """
    views = list(log.views(run_id))
    if not views:
        return None
    # Where it changes between lost and known: a loss, its end, the next loss ...
    edges_us = [next(same).t_us for _, same in groupby(views, lambda view: bool(view.pixel_from_ground))]
    losing_us = edges_us[1:] if views[0].pixel_from_ground else edges_us
    _, end_us = log.covered_us(run_id) or (0, views[-1].t_us)
    return tuple(zip_longest(losing_us[::2], losing_us[1::2], fillvalue=end_us))


class Coverage:
    """Tells which time the runs of a log looked at; what is known of a run is kept until it has gone on.

    A run that is being written may be some seconds further than is told, never less far.

    Parameters
    ----------
    look_every_s : how old an answer may be: to ask the log takes as long as a page of events does.
    """

    def __init__(self, log: EventLog, *, look_every_s: float = LOOK_EVERY_S) -> None:
        self._log = log
        self._look_every_s = look_every_s
        self.looked_s = -math.inf
        self._known: dict[str, tuple[_State, LookedAt]] = {}

    @property
    def is_fresh(self) -> bool:
        """Tell whether the log need not be looked at for the next answer."""
        return time.monotonic() < self.looked_s + self._look_every_s

    def of(self, wanted: EventFilter) -> list[LookedAt] | None:
        """Tell it of the runs that a filter asks for; None if these are more than `MAX_RUNS`."""
        found = [
            one
            for one in self.of_all().values()
            if one.run in (wanted.runs or (one.run,)) and one.source in (wanted.sources or (one.source,))
        ]
        return found if len(found) <= MAX_RUNS else None

    def beside(self, wanted: EventFilter) -> list[LookedAt] | None:
        """Tell what stands beside a list; nothing of an older state of the log, which must stay as it was."""
        return self.of(wanted) if wanted.as_of is None else None

    def of_run(self, run: RunRecord) -> list[LookedAt]:
        """Tell it of one run, which may have begun this moment."""
        return [self.of_all().get(run.id) or LookedAt(run.id, run.source, ())]

    def of_all(self) -> dict[str, LookedAt]:
        """Tell it of all runs, by their identifiers."""
        if not self.is_fresh:
            now_s = time.monotonic()
            # Replaced at once, since several threads ask.
            self._known = {row.id: (row, self._look(row)) for row in self._states()}
            self.looked_s = now_s
        return {run: told for run, (_, told) in self._known.items()}

    def _states(self) -> list[_State]:
        chunks, runs = schema.chunks, schema.runs
        last_span = select(func.max(chunks.c.span_us)).where(chunks.c.run_no == runs.c.run_no)
        last_span = last_span.where(chunks.c.kind == FRAMES.name)
        query = select(runs.c.id, runs.c.source, runs.c.status, last_span.scalar_subquery()).order_by(runs.c.run_no)
        with self._log.connect() as connection:
            return [_State(*row) for row in connection.execute(query)]

    def _look(self, now: _State) -> LookedAt:
        state, told = self._known.get(now.id, (None, None))
        if told is not None and state == now:
            return told
        covered_us = self._log.covered_us(now.id)
        spans_us = _without(*covered_us, lost_views(self._log, now.id) or ()) if covered_us else ()
        return LookedAt(now.id, now.source, spans_us)


def _without(first_us: int, last_us: int, holes_us: Iterable[tuple[int, int]]) -> Spans:
    """Give what is left of a time without some holes, which are in order.

    Examples
    --------
    >>> _without(0, 100, [(0, 10), (40, 60)])
    ((10, 40), (60, 100))
    >>> _without(0, 0, [])    # a single frame
    ((0, 0),)
    """
    edges_us = [first_us, *(edge_us for hole_us in holes_us for edge_us in hole_us), last_us]
    spans_us = tuple(span_us for span_us in list(pairwise(edges_us))[::2] if span_us[0] < span_us[1])
    return spans_us if first_us < last_us else ((first_us, last_us),)
