"""What is produced here, from what, under which policy, at what cost? One row for each process and its stream."""

import reprlib
from dataclasses import dataclass

from dyknow.streams.mediation import Mediation
from dyknow.streams.process import Process

_LONGEST_VALUE = 60


@dataclass(frozen=True, slots=True)
class StreamReport:
    """Say what one process and its stream have done so far.

    Attributes
    ----------
    kind : ``source``, ``refinement``, ``selection``, ``collection`` or ``configuration``.
    inputs, policies : the labels it reads and, at the same places, the policies in the words of KPL.
    waiting_for : labels that a mediation was told to pass on and that no stream has.
    published, delivered : samples published, and samples handed to subscribers, all of them together.
    dropped : by cause, what subscribers were offered and did not get: refused by their policies, or without room;
        and what the unit itself left out.
    queued : how many samples wait in each pulled stream.
    rate_hz : samples a second by available time, on average since the first.
    lag_us : how long after its valid time the newest sample became available.
    last_value : the newest value, shortened.
    updates, busy_ns : calls of the producing code and the time spent in it; zero for a source.
    """

    label: str
    kind: str
    inputs: tuple[str, ...]
    policies: tuple[str, ...]
    waiting_for: tuple[str, ...]
    published: int
    delivered: int
    dropped: dict[str, int]
    subscribers: int
    queued: tuple[int, ...]
    rate_hz: float
    lag_us: int | None
    last_valid_us: int | None
    last_value: str | None
    updates: int
    busy_ns: int


def report_on(process: Process) -> StreamReport:
    """Describe a process and its stream."""
    output, last = process.output, process.output.last
    return StreamReport(
        label=process.label,
        kind=process.kind,
        inputs=tuple(one.stream.label for one in process.inputs),
        policies=tuple(str(one.subscription.policy) for one in process.inputs),
        waiting_for=process.waiting_for if isinstance(process, Mediation) else (),
        published=output.published,
        delivered=output.delivered,
        dropped=output.dropped() | dict(process.left_out),
        subscribers=len(output.subscriptions),
        queued=tuple(len(one.buffer) for one in output.subscriptions if one.buffer is not None),
        rate_hz=output.rate_hz,
        lag_us=last.delay_us if last else None,
        last_valid_us=last.valid_us if last else None,
        last_value=short_repr(last.value) if last else None,
        updates=process.updates,
        busy_ns=process.busy_ns,
    )


def short_repr(value: object) -> str:
    """Write a value on one line of at most 60 characters.

    Examples
    --------
    >>> short_repr({"a": 1}), len(short_repr(list(range(1000))))
    ("{'a': 1}", 23)
    """
    shortening = reprlib.Repr()
    shortening.maxother = _LONGEST_VALUE
    text = " ".join(shortening.repr(value).split())
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 3]}..."
