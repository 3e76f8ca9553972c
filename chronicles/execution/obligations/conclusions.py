"""Do the counts and persistences of an instance with all its events hold, and for which values?

An instance is concluded once, when the watermark has passed the end of its last window: then every event inside the
windows is known, and `noevent`, `occurs`, `hold` and `assert` are plain questions to the past. A `hold` may give
variables their values, so one instance can be concluded several times, or not at all.
"""

from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Anchor, Count, Persistence, Plan
from chronicles.events import Event
from chronicles.execution.instances import Instance, Layout
from chronicles.execution.obligations.count_log import CountLog
from chronicles.execution.obligations.history import AttributeHistory
from chronicles.execution.obligations.looks import Look, Values, Way


class Conclusions:
    """Tests the obligations of one chronicle's instances; keeps the events that its `noevent`s and `occurs` count."""

    def __init__(self, plan: Plan, history: AttributeHistory) -> None:
        self._plan = plan
        self._history = history
        self._layout = Layout(plan)
        self._logs = [CountLog(count) for count in plan.counts]
        self._logs_at: dict[str, list[CountLog]] = {}
        for log in self._logs:
            self._logs_at.setdefault(log.count.test.name, []).append(log)
        self._ends = tuple(
            (1 + anchor.position, anchor.offset_us)
            for anchor in [Anchor(index, 0) for index in range(len(plan.positions))]
            + [one.end for one in plan.obligations]
        )
        # What an `assert` action reads has a value always.
        self._looks = [Look(one, history) for one in plan.persistences if not one.is_reading]

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that must be given to `append`."""
        return frozenset(self._logs_at)

    def append(self, event: Event) -> None:
        """Remember an event that is to be counted; events come in the order of time."""
        for log in self._logs_at[event.name]:
            log.append(event)

    def closes_us(self, instance: Instance) -> int:
        """Give the time from which everything about a complete instance is known."""
        closes_us: int = max([instance[index] + offset_us for index, offset_us in self._ends])
        return closes_us + self._plan.settling_us

    def solutions(self, instance: Instance) -> list[Way]:
        """List the ways in which every obligation holds, each with other values."""
        slots = self._layout.slots
        bound: Values = tuple(instance[slots : slots + self._layout.event_slots])
        unknown = ("",) * (len(self._plan.slots) - self._layout.event_slots)
        ways: list[Way] = [(bound + unknown, ())]
        for look in self._looks:
            window = _window(look.one, instance)
            if look.is_check:
                ways = [way for way in ways if look.is_right(way[0], *window)]
            else:
                ways = [longer for way in ways for longer in look.longer(way, *window)]
            if not ways:
                return []
        found: dict[Values, Values] = {}
        for values, labels in ways:
            # Where a hold can be true of several things, all of them are evidence.
            found[values] = found.get(values, ()) + labels
        return [
            (values, self._hypotheses(instance, values, labels))
            for values, labels in found.items()
            if self._are_counts_right(instance, values)
        ]

    def is_doomed(self, instance: Instance, mask: int, now_us: int) -> bool:
        """Say whether what is known by now already breaks an obligation of a partial instance."""
        known = frozenset(slot for slot in range(self._layout.event_slots) if instance[self._layout.slots + slot])
        values: Values = tuple(
            instance[self._layout.slots + slot] if slot in known else "" for slot in range(len(self._plan.slots))
        )
        for log in self._logs:
            if known.issuperset(log.slots) and _is_placed(log.count, mask):
                start_us, end_us = _window(log.count, instance)
                is_over = end_us <= now_us
                if not log.is_right(values, start_us, min(end_us, now_us), is_over=is_over):
                    return True
        for look in self._looks:
            one = look.one
            needed = [slot for _, slot in one.bound] + [one.value_slot] * (one.value_slot >= 0)
            if one.is_complete and known.issuperset(needed) and _is_placed(one, mask):
                start_us, end_us = _window(one, instance)
                end_us = min(end_us, now_us)
                if start_us < end_us and not look.is_right(values, start_us, end_us):
                    return True
        return False

    def forget_before(self, t_us: int) -> int:
        """Drop events too old for any instance; give the number left."""
        return sum(log.forget_before(t_us) for log in self._logs)

    def state(self) -> list[Any]:
        """Give the events kept, as plain data."""
        return [log.state() for log in self._logs]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given, for the same chronicle."""
        for log, kept in zip(self._logs, state, strict=True):
            log.restore(kept)

    def _hypotheses(self, instance: Instance, values: Values, labels: Values) -> Values:
        """List the hypotheses that a solution rests on, with those of the statements that only checked."""
        if not self._history.has_labels:
            return ()
        for look in self._looks:
            if look.is_check:
                labels += look.labels(look.arguments(values), *_window(look.one, instance))
        return tuple(sorted(set(labels)))

    def _are_counts_right(self, instance: Instance, values: Values) -> bool:
        return all(log.is_right(values, *_window(log.count, instance)) for log in self._logs)


def _is_placed(one: Count | Persistence, mask: int) -> bool:
    """Say whether the events that the window hangs on are matched."""
    return bool(mask >> one.start.position & 1 and mask >> one.end.position & 1)


def _window(one: Count | Persistence, instance: Instance) -> tuple[int, int]:
    start_us = instance[1 + one.start.position] + one.start.offset_us
    end_us = instance[1 + one.end.position] + one.end.offset_us
    return start_us, end_us
