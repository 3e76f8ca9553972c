"""Do the counts and persistences of an instance with all its events hold, and for which values?

An instance is concluded once, when the watermark has passed the end of its last window: then every event inside the
windows is known, and `noevent`, `occurs`, `hold` and `assert` are plain questions to the past. A `hold` may give
variables their values, so one instance can be concluded several times, or not at all.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Anchor, Count, Persistence, Plan
from chronicles.compilation.symbols import UNKNOWN
from chronicles.events import Event
from chronicles.execution.count_log import CountLog
from chronicles.execution.history import AttributeHistory
from chronicles.execution.instances import Instance, Layout

Values = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Solution:
    """A way to conclude an instance: the values of all slots, the hypotheses its persistences rest on, the past."""

    values: Values
    hypotheses: Values
    past: AttributeHistory


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
        self._places = [_known_places(one) for one in plan.persistences]
        for one, places in zip(plan.persistences, self._places, strict=True):
            if not one.is_complete:
                history.index_by(one.attribute, places)

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

    def solutions(self, instance: Instance) -> list[Solution]:
        """List the ways in which every obligation holds, each with other values."""
        slots = self._layout.slots
        bound: Values = tuple(instance[slots : slots + self._layout.event_slots])
        if not self._plan.persistences:
            return [Solution(bound, (), self._history)] if self._are_counts_right(instance, bound) else []
        unknown = ("",) * (len(self._plan.slots) - self._layout.event_slots)
        found: dict[Values, Values] = {}
        for values, labels in self._persistent(0, instance, bound + unknown, ()):
            # Where a hold can be true of several things, all of them are evidence.
            found[values] = found.get(values, ()) + labels
        return [
            Solution(values, tuple(sorted(set(labels))), self._history)
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
        for one in self._plan.persistences:
            needed = [slot for _, slot in one.bound] + [one.value_slot] * (one.value_slot >= 0)
            if one.is_complete and known.issuperset(needed) and _is_placed(one, mask):
                start_us, end_us = _window(one, instance)
                if start_us < now_us and not self._is_kept(one, values, (start_us, min(end_us, now_us))):
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

    def _persistent(
        self, index: int, instance: Instance, values: Values, labels: Values
    ) -> Iterator[tuple[Values, Values]]:
        """Extend values, and the hypotheses they rest on, by each way to make the persistences from `index` on hold."""
        if index == len(self._plan.persistences):
            yield values, labels
            return
        one = self._plan.persistences[index]
        window = _window(one, instance)
        if one.is_reading:
            yield from self._persistent(index + 1, instance, values, labels)
        elif one.is_assumed:
            if self._is_kept(one, values, window):
                found = self._labels(one, self._arguments(one, values), window)
                yield from self._persistent(index + 1, instance, values, labels + found)
        else:
            yield from self._held(index, instance, values, labels)

    def _held(self, index: int, instance: Instance, values: Values, labels: Values) -> Iterator[tuple[Values, Values]]:
        one = self._plan.persistences[index]
        window = _window(one, instance)
        for args in self._candidates(index, values):
            value = self._value(one, args, window)
            if value is None or any(args[first] != args[second] for first, second in one.equal):
                continue
            extended = _bind(one, args, value, values)
            if _fits(one, value, extended) and _is_allowed(one, extended):
                yield from self._persistent(index + 1, instance, extended, labels + self._labels(one, args, window))

    def _candidates(self, index: int, values: Values) -> Iterator[Values]:
        one = self._plan.persistences[index]
        if one.is_complete:
            yield self._arguments(one, values)
            return
        known = dict(one.constants) | {place: values[slot] for place, slot in one.bound}
        key = tuple(known[place] for place in self._places[index])
        for args in self._history.matching(one.attribute, self._places[index], key):
            if len(args) == one.arity:
                yield args

    def _arguments(self, one: Persistence, values: Values) -> Values:
        known = dict(one.constants) | {place: values[slot] for place, slot in one.bound}
        return tuple(known[place] for place in range(one.arity))

    def _value(self, one: Persistence, args: Values, window: tuple[int, int]) -> str | None:
        if one.needs_report and not self._history.is_reported(one.attribute, args, window[0]):
            return None
        return self._history.value_throughout(one.attribute, args, *window)

    def _is_kept(self, one: Persistence, values: Values, window: tuple[int, int]) -> bool:
        """Say whether a persistence with all values known is true in a window; an empty one asks for nothing."""
        if window[0] >= window[1]:
            return True
        args = self._arguments(one, values)
        if not one.is_assumed:
            value = self._value(one, args, window)
            return value is not None and _fits(one, value, values)
        wanted = one.value if one.value_slot < 0 else values[one.value_slot]
        return all(value in (wanted, UNKNOWN) for value, _ in self._history.values_within(one.attribute, args, *window))

    def _labels(self, one: Persistence, args: Values, window: tuple[int, int]) -> Values:
        """List the hypotheses of the changes that brought the value; what is unknown is evidence for no assert."""
        if window[0] >= window[1]:
            return ()
        return self._history.hypotheses_within(one.attribute, args, *window, of_known=one.is_assumed)

    def _are_counts_right(self, instance: Instance, values: Values) -> bool:
        return all(log.is_right(values, *_window(log.count, instance)) for log in self._logs)


def _is_placed(one: Count | Persistence, mask: int) -> bool:
    """Say whether the events that the window hangs on are matched."""
    return bool(mask >> one.start.position & 1 and mask >> one.end.position & 1)


def _known_places(one: Persistence) -> tuple[int, ...]:
    return tuple(sorted(place for place, _ in (*one.constants, *one.bound)))


def _window(one: Count | Persistence, instance: Instance) -> tuple[int, int]:
    start_us = instance[1 + one.start.position] + one.start.offset_us
    end_us = instance[1 + one.end.position] + one.end.offset_us
    return start_us, end_us


def _bind(one: Persistence, args: Values, value: str, values: Values) -> Values:
    if not one.binds and one.value_binds < 0:
        return values
    extended = list(values)
    for place, slot in one.binds:
        extended[slot] = args[place]
    if one.value_binds >= 0:
        extended[one.value_binds] = value
    return tuple(extended)


def _fits(one: Persistence, value: str, values: Values) -> bool:
    """Say whether the value is the wanted one."""
    if one.needs_known and value == UNKNOWN:
        return False
    if one.value is not None:
        return value == one.value
    return one.value_slot < 0 or value == values[one.value_slot]


def _is_allowed(one: Persistence, values: Values) -> bool:
    return all(values[slot] in allowed for slot, allowed in one.filters) and all(
        values[slot] != values[other] for slot, other in one.different
    )
