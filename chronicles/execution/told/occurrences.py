"""How does an instance become an occurrence that is told, or a description of what it still expects?

Where a text does not ask for all occurrences, `Selector` takes what comes first in the order of results. An occurrence
lasts from its start up to, without, its end, so one may start where another ends; one whose start is its end counts as
that one microsecond.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Anchor, Emission, Plan, ReportPart
from chronicles.compilation.steps import members, missing_from
from chronicles.events import Event, ExpectedEvent, Occurrence, PartialInstance
from chronicles.execution.instances import Instance, Layout, Record
from chronicles.execution.obligations.history import AttributeHistory
from chronicles.execution.obligations.looks import Values, Way
from chronicles.execution.told.confidence import calibrated, confidence_of

# The watermark at which it became certain, the chronicle's place in its set, values, time points, events' numbers, and
# the number of the event that a selection looks at (-1 for none).
Order = tuple[int, int, Values, tuple[tuple[str, int], ...], tuple[int, ...], int]


@dataclass(slots=True)
class Finding:
    """An occurrence with its place in the order of output, and the values and events that identify it.

    What an `assert` action changes depends on the findings before it, so `occurrence` is complete once the builder was
    asked whether it is new.
    """

    order: Order
    occurrence: Occurrence
    builder: OccurrenceBuilder


class OccurrenceBuilder:
    """Builds the occurrences of one chronicle and knows which ones were reported already; `past` is what it sets."""

    def __init__(self, plan: Plan, rank: int, past: AttributeHistory) -> None:
        self._plan = plan
        self._rank = rank
        self._past = past
        self._layout = Layout(plan)
        self._selector = Selector(plan)
        self._reported: dict[tuple[Values, frozenset[int]], int] = {}
        self._is_plain = not (plan.is_symmetric or plan.asserts or plan.selection.kind != "all")
        # Looked up once: thousands of occurrences may be built in one step.
        self._points = [(1 + anchor.position, anchor.offset_us, name) for name, anchor in plan.points]

    def finding(self, instance: Instance, way: Way, certain_us: int, clock_us: int) -> Finding:
        """Build the occurrence of an instance that was concluded in some way."""
        plan, (values, held_by) = self._plan, way
        records: list[Record] = instance[self._layout.records :]
        records.sort()
        events = tuple([record[2] for record in records])
        hypotheses = _hypotheses(events, held_by)
        points = [(instance[index] + offset_us, name) for index, offset_us, name in self._points]
        points.sort()
        sub_events = tuple([(name, t_us) for t_us, name in points])
        first_us = records[0][0] if plan.start is None else _time(instance, plan.start)
        last_us = records[-1][0] if plan.end is None else _time(instance, plan.end)
        times_us = instance[1 : 1 + len(plan.positions)]
        confidence = confidence_of(events, times_us, plan.distance_us)
        occurrence = Occurrence(
            chronicle=plan.name,
            version=plan.version,
            roles={name: _text(filling, values) for name, filling in plan.roles},
            # The header may name its time points in any order, and their order may differ between instances.
            start_us=min(first_us, last_us),
            end_us=max(first_us, last_us),
            sub_events=sub_events,
            events=events,
            emitted=tuple([_emitted(one, instance, values, hypotheses, confidence) for one in plan.emissions]),
            reports=tuple(["".join([_text(part, values) for part in parts]) for parts in plan.reports]),
            recognised_us=clock_us,
            hypotheses=hypotheses,
            confidence=calibrated(confidence),
            floor=plan.floor,
        )
        sequence = tuple([record[1] for record in records])
        anchor = instance[self._layout.records + plan.selection.anchor][1] if plan.selection.anchor >= 0 else -1
        return Finding((certain_us, self._rank, values, sub_events, sequence, anchor), occurrence, self)

    def plain_finding(self, instance: Instance, certain_us: int, clock_us: int) -> Finding:
        """Build the occurrence of an instance of a chronicle without obligations."""
        values = tuple(instance[self._layout.slots : self._layout.records])
        return self.finding(instance, (values, ()), certain_us, clock_us)

    def is_new(self, finding: Finding) -> bool:
        """Say whether a finding is told; asked once for each, in the order of results.

        Told is what was not told before and is selected. What its `assert` actions change is worked out and remembered.
        """
        if self._is_plain:
            return True
        if self._plan.is_symmetric and self._is_repeated(finding):
            return False
        certain_us, _, _, _, _, anchor = finding.order
        if not self._selector.is_selected(finding.occurrence, anchor=anchor, certain_us=certain_us):
            return False
        if self._plan.asserts:
            finding.occurrence = replace(finding.occurrence, emitted=self._asserted(finding))
        return True

    def forget_before(self, now_us: int) -> None:
        """Drop what cannot be found again."""
        self._reported = {key: last_us for key, last_us in self._reported.items() if last_us >= now_us}
        self._selector.forget_before(now_us)

    def state(self) -> list[Any]:
        """Give what was told and may be found again, as plain data."""
        return [dict(self._reported), self._selector.state()]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given, for the same chronicle."""
        reported, selected = state
        self._reported = dict(reported)
        self._selector.restore(selected)

    def _is_repeated(self, finding: Finding) -> bool:
        """Say whether the same values and events were found before, with the events in other positions."""
        certain_us, _, values, _, sequence, _ = finding.order
        identity = values, frozenset(sequence)
        if identity in self._reported:
            return True
        self._reported[identity] = certain_us + self._plan.tail_us
        return False

    def _asserted(self, finding: Finding) -> tuple[Event, ...]:
        """Give the emitted events with the old values of what is asserted; an assert that changes nothing is none."""
        pairs = zip(finding.occurrence.emitted, self._plan.emissions, strict=True)
        events = [self._past.assign(event) if one.is_assertion else event for event, one in pairs]
        return tuple([event for event in events if event is not None])


class Selector:
    """Selects among the occurrences of one chronicle; invariant: the selected ones that may still matter are kept.

    `first` tells one for each event at the anchor; `non_overlapping` tells, for each combination of roles, occurrences
    that have no time in common.
    """

    def __init__(self, plan: Plan) -> None:
        self._selection = plan.selection
        self._tail_us = plan.tail_us
        self._anchors: dict[int, int] = {}  # number of the event at the anchor: how long it can come up again
        self._intervals: dict[Values, list[tuple[int, int]]] = {}

    def is_selected(self, occurrence: Occurrence, *, anchor: int, certain_us: int) -> bool:
        """Say whether an occurrence is told, and remember it; they come in the order of results.

        Parameters
        ----------
        occurrence : with its start, end and roles.
        anchor : the number of the event at the anchor of the selection.
        certain_us : the time at which it became certain.
        """
        if self._selection.kind == "all":
            return True
        if self._selection.kind == "first":
            is_first = anchor not in self._anchors
            if is_first:
                self._anchors[anchor] = certain_us + self._tail_us
            return is_first
        told = self._intervals.setdefault(tuple(occurrence.roles.values()), [])
        start_us, end_us = _extent(occurrence)
        is_disjoint = all(end_us <= other_start_us or other_end_us <= start_us for other_start_us, other_end_us in told)
        if is_disjoint:
            told.append((start_us, end_us))
        return is_disjoint

    def forget_before(self, now_us: int) -> None:
        """Drop what no occurrence that is concluded from now on can meet."""
        self._anchors = {anchor: last_us for anchor, last_us in self._anchors.items() if last_us >= now_us}
        earliest_us = now_us - self._selection.reach_us
        kept = {
            cast: [(start_us, end_us) for start_us, end_us in told if end_us > earliest_us]
            for cast, told in self._intervals.items()
        }
        self._intervals = {cast: told for cast, told in kept.items() if told}

    def state(self) -> list[Any]:
        """Give what is kept, as plain data."""
        return [list(self._anchors.items()), [[list(cast), list(told)] for cast, told in self._intervals.items()]]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given, for the same chronicle."""
        anchors, intervals = state
        self._anchors = dict(anchors)
        self._intervals = {tuple(cast): [(start, end) for start, end in told] for cast, told in intervals}


def _extent(occurrence: Occurrence) -> tuple[int, int]:
    return occurrence.start_us, max(occurrence.end_us, occurrence.start_us + 1)


def expecting_instance(plan: Plan, instance: Instance, mask: int, now_us: int) -> PartialInstance:
    """Describe an instance that misses events; nothing earlier than `now_us` can come any more."""
    windows = _windows(plan, instance, mask, now_us)
    missing = [(plan.positions[index], windows[index]) for index in missing_from(plan, mask)]
    expected = [ExpectedEvent(position.label, position.pattern, *window) for position, window in missing]
    expected.sort(key=lambda one: (one.earliest_us, one.latest_us, one.label, one.pattern))
    return _partial(plan, instance, mask, tuple(expected), instance[0])


def pending_instance(plan: Plan, instance: Instance, closes_us: int) -> PartialInstance:
    """Describe an instance that has its events and waits for the end of its windows."""
    return _partial(plan, instance, (1 << len(plan.positions)) - 1, (), closes_us)


def _windows(plan: Plan, instance: Instance, mask: int, now_us: int) -> list[tuple[int, int]]:
    """Intersect the windows of missing positions with those that the matched ones and the clock leave."""
    distance, matched, missing = plan.distance_us, members(mask), missing_from(plan, mask)
    places = range(len(distance))
    earliest = [max(instance[1 + one] - distance[index][one] for one in matched) for index in places]
    latest = [min(instance[1 + one] + distance[one][index] for one in matched) for index in places]
    cut = {index: max(earliest[index], now_us) for index in missing}
    # The network is minimal, so one round of propagation is enough.
    pushed = [max([earliest[one], *(cut[m] - distance[one][m] for m in missing)]) for one in places]
    return list(zip(pushed, latest, strict=True))


def _partial(
    plan: Plan, instance: Instance, mask: int, expected: tuple[ExpectedEvent, ...], latest_us: int
) -> PartialInstance:
    layout = Layout(plan)
    records: list[Record] = sorted(one for one in instance[layout.records :] if one is not None)
    matched = sorted({(instance[1 + index], plan.positions[index].label) for index in members(mask)})
    sub_events = tuple((name, t_us) for t_us, name in matched)
    values = tuple(instance[layout.slots : layout.records]) + (None,) * (len(plan.slots) - layout.event_slots)
    roles = {
        name: filling.constant if filling.slot < 0 else values[filling.slot]
        for name, filling in plan.roles
        if filling.slot < 0 or values[filling.slot] is not None
    }
    hypotheses = _hypotheses([record[2] for record in records])
    return PartialInstance(plan.name, roles, sub_events, expected, latest_us, hypotheses)


def _hypotheses(events: Iterable[Event], others: Iterable[str] = ()) -> tuple[str, ...]:
    found = {*others}
    for event in events:
        if event.hypotheses:  # rare, and building nothing is what costs
            found.update(event.hypotheses)
    return tuple(sorted(found)) if found else ()


def _time(instance: Instance, anchor: Anchor) -> int:
    t_us: int = instance[1 + anchor.position] + anchor.offset_us
    return t_us


def _text(part: ReportPart, values: Values) -> str:
    if isinstance(part, str):
        return part
    return part.constant if part.slot < 0 else values[part.slot]


def _emitted(
    one: Emission, instance: Instance, values: Values, hypotheses: tuple[str, ...], confidence: float
) -> Event:
    arguments = tuple([_text(filling, values) for filling in one.arguments])
    t_us = _time(instance, one.time)
    if one.change is None:
        return Event(one.name, arguments, t_us, hypotheses=hypotheses, confidence=confidence)
    old, new = (_text(filling, values) for filling in one.change)
    # An assert has no old value yet, see `OccurrenceBuilder.is_new`.
    return Event(one.name, arguments, t_us, old, new, hypotheses, confidence)
