"""How much may one chronicle cost? What goes beyond is left out, and counted.

Nothing is consumed, so an event that is repeated while others are waited for multiplies instances: twelve of 22 equal
events can be chosen in 646,646 ways. The bounds are numbers of instances and no times, so that the same events give the
same occurrences on every machine; those that came first stay.
"""

from dataclasses import dataclass

from chronicles.errors import ChronicleError


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bound the instances of each chronicle.

    Attributes
    ----------
    most_waiting : how many may wait with the same events matched, two or more of them; by reason, as is the other.
        Instances of one event alone are bounded by the events themselves.
    most_matches : how many one event may complete, from the same events matched before.

    Raises
    ------
    ChronicleError
        If one is below 1.
    """

    most_waiting: int = 100_000
    most_matches: int = 10_000

    def __post_init__(self) -> None:
        """Check both, once."""
        for name in ("most_waiting", "most_matches"):
            if getattr(self, name) < 1:
                raise ChronicleError(f"limits: {name} must be 1 or more, got {getattr(self, name)!r}")


USUAL = Limits()
