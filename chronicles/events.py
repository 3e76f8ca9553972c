"""What goes into a recogniser and what comes out of it?"""

from dataclasses import dataclass, field
from operator import attrgetter
from typing import Literal

from chronicles.errors import ChronicleError

# Sums of two such times, and differences to any bound, still fit into 64 bits.
LARGEST_US = 2**60

by_time = attrgetter("t_us")
"""Key that sorts whatever has a time."""

Status = Literal["recognised", "tentative", "confirmed", "retracted"]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to some things at one time.

    Without `old` and `new` it is a message. With them it is a change of the attribute `name[args]`, whose value is
    `old` before `t_us` and `new` from `t_us` on; values are texts such as "true", "false", "unknown".
    `hypotheses` are labels of the assumptions it rests on, such as identities of the things. `confidence` is how
    probable it is, as whoever gives it knows: 1 if nothing is said. It makes no other event of it.

    Raises
    ------
    ChronicleError
        If the time is no whole number of microseconds within some 36,000 years, if the arguments are no tuple, or if
        there is an old value without a new one.
    """

    name: str
    args: tuple[str, ...]
    t_us: int
    old: str | None = None
    new: str | None = None
    hypotheses: tuple[str, ...] = ()
    confidence: float = field(default=1.0, compare=False, repr=False)

    def __post_init__(self) -> None:
        # Every executor computes with these, some in 64 bits: refused here, they are the same everywhere.
        if type(self.t_us) is not int or not -LARGEST_US <= self.t_us <= LARGEST_US:
            raise ChronicleError(f"event {self.name!r}: expected t_us, a whole number of us, got {self.t_us!r}")
        if type(self.args) is not tuple:
            raise ChronicleError(f"event {self.name!r}: expected a tuple of texts as args, got {self.args!r}")
        if not 0 <= self.confidence <= 1:
            raise ChronicleError(f"event {self.name!r}: expected a confidence of 0 to 1, got {self.confidence!r}")
        if self.new is None and self.old is not None:
            raise ChronicleError(f"event {self.name!r}: expected a new value with the old one {self.old!r}, got none")


OccurrenceKey = tuple[str, tuple[tuple[str, str], ...], tuple[tuple[str, int], ...], tuple[Event, ...]]


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A recognised instance of a chronicle.

    Attributes
    ----------
    chronicle, version : name of the chronicle, and a digest of its text and of the declarations it rests on.
    roles : the header's variables without "?" and their values.
    start_us, end_us : the smaller and the larger of the header's first and last time point; the first and last event's
        time without such.
    sub_events : (time point, time) for all time points, sorted by time.
    events : the matched events, sorted by time.
    emitted : the events that the chronicle emits.
    reports : its report texts.
    recognised_us : the latest time the recogniser had been told when it concluded.
    hypotheses : those of all matched events and of the changes that its holds rest on, sorted.
    status : "tentative" while one of the hypotheses is open, then "confirmed" or "retracted"; "recognised" if none was
        open from the start.
    confidence : how often what is as sure as this is right, 0 to 1; 1 if none of its events says how sure it is.
    floor : below this confidence the chronicle does not tell it.
    """

    chronicle: str
    version: str
    roles: dict[str, str]
    start_us: int
    end_us: int
    sub_events: tuple[tuple[str, int], ...]
    events: tuple[Event, ...]
    emitted: tuple[Event, ...]
    reports: tuple[str, ...]
    recognised_us: int
    hypotheses: tuple[str, ...]
    status: Status = "recognised"
    confidence: float = 1.0
    floor: float = 0.0

    @property
    def key(self) -> OccurrenceKey:
        """What makes it the same occurrence, whatever its status: chronicle, roles, time points and events."""
        return self.chronicle, tuple(self.roles.items()), self.sub_events, self.events

    @property
    def given(self) -> tuple[Event, ...]:
        """The messages that it emits, or else one of its own name, with its roles and at its end.

        What an `assert` sets is a value and no event of its own.
        """
        own = Event(self.chronicle, tuple(self.roles.values()), self.end_us)
        return tuple(event for event in self.emitted if event.new is None) or (own,)


@dataclass(frozen=True, slots=True)
class ExpectedEvent:
    """An event that a partial instance waits for: its time point, its pattern, and when it may still come (closed)."""

    label: str
    pattern: str
    earliest_us: int
    latest_us: int


@dataclass(frozen=True, slots=True)
class PartialInstance:
    """An instance that may still be recognised.

    `roles` holds the header variables known so far; `matched` (time point, time) sorted by time; `expected` what is
    missing, empty when only the end of a `noevent` or `hold` is awaited; `latest_us` is when it dies, or concludes,
    at the latest.
    """

    chronicle: str
    roles: dict[str, str]
    matched: tuple[tuple[str, int], ...]
    expected: tuple[ExpectedEvent, ...]
    latest_us: int
    hypotheses: tuple[str, ...]
