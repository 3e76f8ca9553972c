"""Which chronicles occur in events that are all at hand?

Two executors find the same occurrences in the same order:

* eager: the live one keeps every partial instance; the work is done when events come, so answers come at once.
* backfill: joins whole columns of stored events.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from operator import attrgetter

from chronicles.chronicle_set import ChronicleSet
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.execution.stored.backfill import recognise_columns
from chronicles.execution.stored.columns import EventColumns
from chronicles.recogniser import Recogniser

_EXECUTORS = ("eager", "backfill")


def recognise(
    chronicles: ChronicleSet,
    events: Iterable[Event] | EventColumns,
    *,
    until_us: int | None = None,
    executor: str = "backfill",
) -> Sequence[Occurrence]:
    """Recognise chronicles in events that are all at hand.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    events : in any order, or stored columns.
    until_us : the time up to which the events are complete; the latest event's time if not given. An absence that ends
        later stays open: nobody saw it come true.
    executor : "eager" or "backfill".

    Returns
    -------
    The occurrences in the order in which a `Recogniser` tells them. Where chronicles ask for events alone, those of
    "backfill" are built when they are looked at.

    Raises
    ------
    ChronicleError
        If there is no such executor, or `until_us` is no whole number.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> alone = load("chronicle alone[?car](t1) { event(enter[?car], t1) noevent(enter[?], (t1 + 1us, t1 + 5s)) }")
    >>> events = [Event("enter", ("car1",), 0), Event("enter", ("car2",), 3_000_000)]
    >>> [found.roles for found in recognise(alone, events)]
    []
    >>> [found.roles for found in recognise(alone, events, until_us=8_000_000)]
    [{'car': 'car2'}]
    """
    if executor not in _EXECUTORS:
        raise ChronicleError(f"recognise: expected the executor 'eager' or 'backfill', got {executor!r}")
    if until_us is not None and type(until_us) is not int:
        raise ChronicleError(f"recognise: expected until_us, a whole number of us, got {until_us!r}")
    if executor == "backfill":
        columns = events if isinstance(events, EventColumns) else EventColumns.from_events(events)
        return recognise_columns(chronicles, columns, until_us=until_us)
    recogniser = Recogniser(chronicles)
    stream = events.events if isinstance(events, EventColumns) else sorted(events, key=attrgetter("t_us"))
    found = [occurrence for event in stream for occurrence in recogniser.observe(event)]
    if until_us is not None:
        found += recogniser.advance(until_us)
    return found
