"""What was seen where a chronicle asks for an absence, a number of events or a value, and what does that cost?

The recogniser only decides; this reads the same facts again and keeps them. Where a `hold` may give a variable its
value, all values are tried and the nearest is kept.
"""

from dataclasses import dataclass, replace

from chronicles.compilation.plan import Plan
from chronicles.events import Event
from chronicles.explanation.explanations import CountReading, HoldReading, ObligationReading
from chronicles.explanation.readings.counts import CountReader
from chronicles.explanation.readings.holds import HoldReader
from chronicles.explanation.readings.intervals import Cost, Place, Times, add, cost_of
from chronicles.explanation.search.assignments import Values
from chronicles.explanation.search.chronicle_text import ChronicleText
from chronicles.explanation.search.event_log import EventLog


@dataclass(frozen=True, slots=True)
class Readings:
    """The obligations of one instance as read: the values of all slots, and what it cost."""

    values: Values
    holds: tuple[HoldReading, ...]
    counts: tuple[CountReading, ...]
    cost: Cost

    @property
    def all(self) -> tuple[ObligationReading, ...]:
        """Holds and counts in one row."""
        return self.holds + self.counts


class ObligationReader:
    """Reads the obligations of instances of one chronicle in one log.

    `text` is the canonical text that the plan was made from, or one that differs in a bound.
    """

    def __init__(self, plan: Plan, text: ChronicleText, log: EventLog) -> None:
        holds = [one for one in plan.persistences if not one.is_reading]
        self.plan = plan
        slots = plan.event_slot_count
        self._hold_readers = [HoldReader(one, slots, Place.of(one.text, text), log) for one in holds]
        self._count_readers = [CountReader(one, Place.of(one.text, text), log) for one in plan.counts]

    def best(self, times: Times, values: Values, *, base: Cost, limit: Cost) -> Readings | None:
        """Read all obligations in the way that costs least.

        Parameters
        ----------
        times : of all positions, None where the event is missing.
        values : of all slots, None where nothing is known; a value given here is kept.
        base : what the instance costs without its obligations.
        limit : what costs this much or more altogether is not wanted.

        Returns
        -------
        None if nothing costs less than the limit.
        """
        best: Readings | None = None

        def descend(values: Values, holds: tuple[HoldReading, ...], cost: Cost) -> None:
            """Read the persistence that comes next in each way."""
            nonlocal best, limit
            if len(holds) == len(self._hold_readers):
                counts = tuple([one.read(times, values) for one in self._count_readers])
                for one in counts:
                    cost = add(cost, cost_of(one))
                if cost < limit:
                    best, limit = Readings(values, holds, counts, cost), cost
                return
            for extended, reading in self._hold_readers[len(holds)].readings(times, values):
                new_cost = add(cost, cost_of(reading))
                if new_cost < limit:
                    descend(extended, (*holds, reading), new_cost)

        if base < limit:
            descend(values, (), base)
        return best

    def with_alternatives(self, readings: Readings, times: Times) -> Readings:
        """Add to every failed hold what held throughout its interval with other values of what it binds."""
        pairs = zip(self._hold_readers, readings.holds, strict=True)
        holds = [reader.with_alternatives(reading, times, readings.values) for reader, reading in pairs]
        return replace(readings, holds=tuple(holds))

    def evidence(self, values: Values) -> list[Event]:
        """Give every event that decides the obligations of an instance with these values."""
        held = [event for one in self._hold_readers for event in one.evidence(values)]
        return held + [event for one in self._count_readers for event in one.evidence(values)]
