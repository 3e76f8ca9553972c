"""Which instances of one chronicle are under way?

The algorithm follows Ghallab 1996 (*On chronicles: representation, on-line recognition and learning*, section 3) and
Dousson: an event that an instance expects makes a copy with the event in it, and the original keeps waiting, so all
matches are found and nothing is consumed. We depart from it in that the network is minimised once, when the chronicle
is compiled; an instance only compares times, and its deadline is exact.

An instance is a plain list, because it is copied for every match:
``[deadline_us, time of each position..., value of each slot..., record of each position...]`` with None where nothing
is known. A record is ``(t_us, sequence number, event)``. Instances with the same set of matched positions share a
state; each state keeps them, for each position it can take next, in buckets by the values of the variables they must
agree on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from operator import itemgetter
from typing import Any  # an instance is a heterogeneous list, see above

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.compilation.plan import Plan
from chronicles.events import Event
from chronicles.execution.event_tests import EventMatcher, Values, event_matcher

Instance = list[Any]
Record = tuple[int, int, Event]


class Layout:
    """Where the parts of an instance stand in its list."""

    __slots__ = ("event_slots", "positions", "records", "slots", "times")

    def __init__(self, plan: Plan) -> None:
        self.positions = len(plan.positions)
        self.event_slots = plan.event_slot_count
        self.times = 1
        self.slots = self.times + self.positions
        self.records = self.slots + self.event_slots

    def empty(self) -> Instance:
        """Make the instance that has matched nothing."""
        return [UNBOUNDED_US] + [None] * (2 * self.positions + self.event_slots)


class _Step:
    """The way from one state to another by matching one position."""

    __slots__ = (
        "all",
        "buckets",
        "checks",
        "differ",
        "instance_key",
        "match_key",
        "new_values",
        "record_at",
        "target",
        "time_at",
    )

    def __init__(self, target: int, time_at: int, record_at: int) -> None:
        self.target = target
        self.time_at = time_at
        self.record_at = record_at
        self.buckets: dict[Any, list[Instance]] = {}  # Any: one value, or a tuple of values
        self.all: list[Instance] = []
        self.instance_key: Callable[[Instance], Any] | None = None
        self.match_key: Callable[[Values], Any] | None = None
        self.checks: tuple[tuple[int, int, int], ...] = ()
        self.differ: tuple[tuple[int, int], ...] = ()
        self.new_values: tuple[tuple[int, int], ...] = ()

    def extend(self, values: Values, record: Record, extended: list[tuple[int, Instance]]) -> None:
        """Add to `extended` a copy of each waiting instance that can take the record, with the record in it."""
        waiting = self.all if self.match_key is None else self.buckets.get(self.match_key(values))
        if not waiting:
            return
        t_us, checks, expired = record[0], self.checks, False
        for instance in waiting:
            if instance[0] < t_us:
                expired = True
                continue
            for index, low_us, high_us in checks:
                if not low_us <= t_us - instance[index] <= high_us:
                    break
            else:
                if self.differ and any(values[place] == instance[index] for place, index in self.differ):
                    continue
                copy = instance.copy()
                copy[self.time_at] = t_us
                copy[self.record_at] = record
                for place, index in self.new_values:
                    copy[index] = values[place]
                extended.append((self.target, copy))
        if expired:
            waiting[:] = [instance for instance in waiting if instance[0] >= t_us]

    def add(self, instance: Instance) -> None:
        """Keep an instance that waits for this step."""
        if self.instance_key is None:
            self.all.append(instance)
            return
        key = self.instance_key(instance)
        bucket = self.buckets.get(key)
        if bucket is None:
            self.buckets[key] = [instance]
        else:
            bucket.append(instance)

    def sweep(self, now_us: int) -> int:
        """Drop instances past their deadline; give the number left."""
        self.all = [one for one in self.all if one[0] >= now_us]
        kept = {key: [one for one in bucket if one[0] >= now_us] for key, bucket in self.buckets.items()}
        self.buckets = {key: bucket for key, bucket in kept.items() if bucket}
        return len(self.all) + sum(map(len, self.buckets.values()))

    def instances(self) -> Iterator[Instance]:
        """Give all instances that wait for this step."""
        yield from self.all
        for bucket in self.buckets.values():
            yield from bucket


class _State:
    """All instances that have matched the same positions."""

    __slots__ = ("deadlines", "mask", "steps")

    def __init__(self, mask: int, steps: tuple[_Step, ...], deadlines: tuple[tuple[int, int], ...]) -> None:
        self.mask = mask
        self.steps = steps
        self.deadlines = deadlines


class InstanceStore:
    """The instances of one chronicle that still expect events."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._layout = Layout(plan)
        self._full = (1 << len(plan.positions)) - 1
        self._states: dict[int, _State] = {}
        self._steps_at: list[list[_Step]] = [[] for _ in plan.positions]
        self._by_name: dict[str, list[tuple[EventMatcher, list[_Step]]]] = {}
        for index, position in enumerate(plan.positions):
            matcher = event_matcher(position.test, [field for field, _ in position.test.variables])
            self._by_name.setdefault(position.test.name, []).append((matcher, self._steps_at[index]))
        for step in self._state(0).steps:
            step.add(self._layout.empty())

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that instances expect."""
        return frozenset(self._by_name)

    def feed(self, record: Record) -> tuple[list[Instance], int]:
        """Let an event extend every instance that expects it; events come in the order of time.

        Returns
        -------
        Instances that now have all their events, and the number of other new instances.
        """
        event = record[2]
        extended: list[tuple[int, Instance]] = []
        for matcher, steps in self._by_name[event.name]:
            values = matcher(event)
            if values is not None:
                for step in steps:
                    step.extend(values, record, extended)
        # Only now may the new instances be seen: one event fills at most one position of an instance.
        complete: list[Instance] = []
        for mask, instance in extended:
            if mask == self._full:
                complete.append(instance)
                continue
            state = self._states.get(mask) or self._state(mask)
            instance[0] = min([instance[index] + bound_us for index, bound_us in state.deadlines])
            for step in state.steps:
                step.add(instance)
        return complete, len(extended) - len(complete)

    def sweep(self, now_us: int) -> int:
        """Drop instances past their deadline; give the number of places left."""
        return sum(step.sweep(now_us) for state in self._states.values() if state.mask for step in state.steps)

    def waiting(self, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give the instances that may still get all their events, with the set of positions they have matched."""
        for mask, state in sorted(self._states.items()):
            if mask:
                for instance in state.steps[0].instances():
                    if instance[0] >= now_us:
                        yield mask, instance

    # ---- states are made when the first instance reaches them: most sets of positions never occur

    def _state(self, mask: int) -> _State:
        following = [position for position in range(self._layout.positions) if self._can_follow(mask, position)]
        steps = []
        for position in following:
            step = self._step(mask, position)
            self._steps_at[position].append(step)
            steps.append(step)
        state = _State(mask, tuple(steps), self._deadlines(mask))
        self._states[mask] = state
        return state

    def _can_follow(self, mask: int, position: int) -> bool:
        """Say whether a position can be the next in the order of time; simultaneous events come in any order."""
        distance = self._plan.distance_us
        others = [one for one in range(self._layout.positions) if not mask >> one & 1 and one != position]
        return not mask >> position & 1 and all(distance[position][other] >= 0 for other in others)

    def _step(self, mask: int, position: int) -> _Step:
        plan, layout = self._plan, self._layout
        step = _Step(mask | 1 << position, layout.times + position, layout.records + position)
        slots = [slot for _, slot in plan.positions[position].test.variables]
        known = {slot for one in _members(mask) for _, slot in plan.positions[one].test.variables}
        joined = [place for place, slot in enumerate(slots) if slot in known]
        fresh = [place for place, slot in enumerate(slots) if slot not in known]
        if joined:
            step.match_key = itemgetter(*joined)
            step.instance_key = itemgetter(*(layout.slots + slots[place] for place in joined))
        step.new_values = tuple((place, layout.slots + slots[place]) for place in fresh)
        step.differ = tuple(
            (place, layout.slots + slot)
            for place in fresh
            for slot in sorted(known)
            if (min(slot, slots[place]), max(slot, slots[place])) in plan.different
        )
        step.checks = tuple((1 + one, low, high) for one, low, high in self._checks(mask, position))
        return step

    def _checks(self, mask: int, position: int) -> list[tuple[int, int, int]]:
        """List the bounds on `t[position] - t[one]` for matched `one`, without those that the others imply."""
        distance = self._plan.distance_us
        needed = list(_members(mask))
        for one in list(needed):
            implied = any(
                distance[one][position] == distance[one][other] + distance[other][position]
                and distance[position][one] == distance[position][other] + distance[other][one]
                for other in needed
                if other != one
            )
            if implied:
                needed.remove(one)
        return [(one, -distance[position][one], distance[one][position]) for one in needed]

    def _deadlines(self, mask: int) -> tuple[tuple[int, int], ...]:
        """List (index, bound): the deadline of an instance is the least of its times plus their bounds."""
        distance = self._plan.distance_us
        missing = [one for one in range(self._layout.positions) if not mask >> one & 1]
        if not missing:
            return ()
        return tuple((1 + one, min(distance[one][other] for other in missing)) for one in _members(mask))


def _members(mask: int) -> Sequence[int]:
    return [index for index in range(mask.bit_length()) if mask >> index & 1]
