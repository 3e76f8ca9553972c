"""What does an event look like, before the log has it and afterwards?"""

from typing import Literal

from msgspec import Struct
from msgspec.structs import asdict

from service.records.runs import RunRecord
from service.records.times import format_utc

EventStatus = Literal["recognised", "tentative", "confirmed", "retracted", "doubtful"]


class ChronicleRef(Struct, frozen=True, gc=False):
    """The chronicle behind an event: its name and the digest of its text."""

    name: str
    version: str


class SubEvent(Struct, frozen=True, gc=False):
    """One labelled part of an occurrence, and when it happened."""

    label: str
    t_us: int


class Place(Struct, frozen=True, gc=False):
    """Where an event began: road (empty when off every road) and ground position."""

    road: str
    x_m: float
    y_m: float


class EventDraft(Struct, frozen=True, kw_only=True):
    """An event as the pipeline hands it to the log, before it has a number.

    Attributes
    ----------
    type : name of the emitted event, such as `overtake`.
    start_us, end_us : the interval `[start_us, end_us)`; equal for an event without duration.
    roles : role name to object symbol, `{"overtaker": "car7", "overtaken": "car3"}`.
    hypotheses : identity hypotheses it rests on; `tentative` until all of them are validated.
    recognised_us : media time at which it was recognised; of a newer state, at which that was decided.
    revises : identifier of the event of which this is the newer state; None for an event told the first time.
    confidence : how often what is as sure as this is right, 0 to 1; 1 where nothing says how sure it is.
    """

    type: str
    chronicle: ChronicleRef
    start_us: int
    end_us: int
    roles: dict[str, str]
    recognised_us: int
    status: EventStatus = "recognised"
    confidence: float = 1.0
    hypotheses: tuple[str, ...] = ()
    sub_events: tuple[SubEvent, ...] = ()
    place: Place | None = None
    revises: str | None = None


class EventRecord(Struct, frozen=True, kw_only=True, gc=False):
    """An event of the log: the JSON object of HTTP and of each line of JSONL.

    It has no way to hold itself, so the collector of garbage need not look at the thousands that are read at once.

    Attributes
    ----------
    id : opaque, unique in the log and the same when the run is repeated; empty of what is in none.
    seq : grows with every row ever written to this log; never used twice; 0 of what is in none.
    start, end : the interval on the UTC calendar, RFC 3339 with six decimals.
    status : `recognised` if it rests on nothing open, else `tentative`; its newer state is `confirmed` or `retracted`.
        `doubtful` if it is less sure than its chronicle, or who processed it, asks for.
    confidence : how often what is as sure as this is right, 0 to 1, in thousandths; 1 where nothing says how sure it
        is.
    revises : identifier of the event of which this is the newer state; null for an event told the first time.
    """

    id: str
    seq: int
    type: str
    chronicle: ChronicleRef
    source: str
    run: str
    start: str
    end: str
    start_us: int
    end_us: int
    roles: dict[str, str]
    status: EventStatus
    confidence: float = 1.0
    hypotheses: tuple[str, ...]
    sub_events: tuple[SubEvent, ...]
    place: Place | None
    recognised_us: int
    revises: str | None = None

    @classmethod
    def of(cls, draft: EventDraft, run: RunRecord, event_id: str = "", seq: int = 0) -> "EventRecord":
        """Put an event of a run on the calendar, and give it its names."""
        zero_us = run.start_utc_us
        return cls(
            id=event_id,
            seq=seq,
            source=run.source,
            run=run.id,
            start=format_utc(zero_us + draft.start_us),
            end=format_utc(zero_us + draft.end_us),
            **asdict(draft),
        )


class MonitorVerdict(Struct, frozen=True):
    """What a monitor told of some objects: since when they had been looked at, and when the outcome was certain."""

    monitor: ChronicleRef
    outcome: str
    roles: dict[str, str]
    since_us: int
    t_us: int
