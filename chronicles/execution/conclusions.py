"""Do the absences and persistences of an instance with all its events hold, and for which values?

An instance is concluded once, when the watermark has passed the end of its last window: then every event inside the
windows is known, and `noevent` and `hold` are plain questions to the past. A `hold` may give variables their values,
so one instance can be concluded several times, or not at all.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

from chronicles.compilation.plan import Anchor, Count, Persistence, Plan
from chronicles.compilation.symbols import UNKNOWN
from chronicles.events import Event
from chronicles.execution.event_tests import EventMatcher, event_matcher
from chronicles.execution.history import AttributeHistory
from chronicles.execution.instances import Instance, Layout

Values = tuple[str, ...]


class _CountLog:
    """The events that one `noevent` forbids, by the values of its bound variables, in the order of time."""

    def __init__(self, count: Count) -> None:
        bound = count.test.variables
        self.count = count
        self._bound_slots = tuple(slot for _, slot in bound)
        self._other_slots = tuple(slot for _, slot in count.different)
        fields = [field for field, _ in bound] + [field for field, _ in count.different]
        self._matcher: EventMatcher = event_matcher(count.test, fields)
        self._found: dict[Values, tuple[list[int], list[Values]]] = {}

    def append(self, event: Event) -> None:
        """Keep an event if it is forbidden; events come in the order of time."""
        values = self._matcher(event)
        if values is None:
            return
        key, own = values[: len(self._bound_slots)], values[len(self._bound_slots) :]
        times, owns = self._found.setdefault(key, ([], []))
        times.append(event.t_us)
        owns.append(own)

    def is_violated(self, values: Values, start_us: int, end_us: int) -> bool:
        """Say whether a forbidden event lies in [start, end)."""
        times, owns = self._found.get(tuple(values[slot] for slot in self._bound_slots), ((), ()))
        index = bisect_left(times, start_us)
        while index < len(times) and times[index] < end_us:
            if all(own != values[slot] for own, slot in zip(owns[index], self._other_slots, strict=True)):
                return True
            index += 1
        return False

    def knows(self, known: frozenset[int]) -> bool:
        """Say whether the slots that the test compares with are among the known ones."""
        return known.issuperset(self._bound_slots) and known.issuperset(self._other_slots)

    def forget_before(self, t_us: int) -> int:
        """Drop the events before a time; return how many are left."""
        kept: dict[Values, tuple[list[int], list[Values]]] = {}
        for key, (times, owns) in self._found.items():
            start = bisect_left(times, t_us)
            if start < len(times):
                kept[key] = (times[start:], owns[start:])
        self._found = kept
        return sum(len(times) for times, _ in kept.values())


class Conclusions:
    """Tests the obligations of one chronicle's instances; keeps the events that its `noevent`s forbid."""

    def __init__(self, plan: Plan, history: AttributeHistory) -> None:
        self._plan = plan
        self._history = history
        self._layout = Layout(plan)
        self._logs = [_CountLog(count) for count in plan.counts]
        self._logs_at: dict[str, list[_CountLog]] = {}
        for log in self._logs:
            self._logs_at.setdefault(log.count.test.name, []).append(log)
        self._ends = tuple(
            (1 + anchor.position, anchor.offset_us)
            for anchor in [Anchor(index, 0) for index in range(len(plan.positions))]
            + [one.end for one in plan.counts]
            + [one.end for one in plan.persistences]
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
        """Remember an event that a `noevent` may forbid; events come in the order of time."""
        for log in self._logs_at[event.name]:
            log.append(event)

    def closes_us(self, instance: Instance) -> int:
        """Give the time from which everything about a complete instance is known."""
        closes_us: int = max([instance[index] + offset_us for index, offset_us in self._ends])
        return closes_us

    def solutions(self, instance: Instance) -> list[Values]:
        """List the values of all slots for which every obligation holds, without doubles."""
        slots = self._layout.slots
        bound: Values = tuple(instance[slots : slots + self._layout.event_slots])
        unknown = ("",) * (len(self._plan.slots) - self._layout.event_slots)
        if not self._plan.persistences:
            return [] if self._logs and self._is_forbidden(instance, bound) else [bound]
        found = dict.fromkeys(self._persistent(0, instance, bound + unknown))
        return [values for values in found if not self._is_forbidden(instance, values)]

    def is_doomed(self, instance: Instance, mask: int, now_us: int) -> bool:
        """Say whether what is known by now already breaks an obligation of a partial instance."""
        known = frozenset(slot for slot in range(self._layout.event_slots) if instance[self._layout.slots + slot])
        values: Values = tuple(
            instance[self._layout.slots + slot] if slot in known else "" for slot in range(len(self._plan.slots))
        )
        for log in self._logs:
            window = self._window_so_far(log.count, instance, mask, now_us)
            if window is not None and log.knows(known) and log.is_violated(values, *window):
                return True
        for one in self._plan.persistences:
            window = self._window_so_far(one, instance, mask, now_us)
            needed = [slot for _, slot in one.bound] + [one.value_slot] * (one.value_slot >= 0)
            if window is not None and one.is_complete and known.issuperset(needed):
                value = self._value(one, self._arguments(one, values), window)
                if value is None or not _fits(one, value, values):
                    return True
        return False

    def forget_before(self, t_us: int) -> int:
        """Drop events too old for any instance; give the number left."""
        return sum(log.forget_before(t_us) for log in self._logs)

    def _window_so_far(
        self, one: Count | Persistence, instance: Instance, mask: int, now_us: int
    ) -> tuple[int, int] | None:
        """Give the part of a window that is over, None if there is none or its place is not known."""
        if not (mask >> one.start.position & 1 and mask >> one.end.position & 1):
            return None
        start_us, end_us = _window(one, instance)
        end_us = min(end_us, now_us)
        return (start_us, end_us) if start_us < end_us else None

    def _persistent(self, index: int, instance: Instance, values: Values) -> Iterator[Values]:
        """Extend values by each way to make the persistences from `index` on hold."""
        if index == len(self._plan.persistences):
            yield values
            return
        one = self._plan.persistences[index]
        window = _window(one, instance)
        for args in self._candidates(index, values):
            value = self._value(one, args, window)
            if value is None or any(args[first] != args[second] for first, second in one.equal):
                continue
            extended = _bind(one, args, value, values)
            if _fits(one, value, extended) and _is_allowed(one, extended):
                yield from self._persistent(index + 1, instance, extended)

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

    def _is_forbidden(self, instance: Instance, values: Values) -> bool:
        return any(log.is_violated(values, *_window(log.count, instance)) for log in self._logs)


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
