"""The meaning of a chronicle, as a slow and obvious search over a whole trace.

Works on the syntax tree, one tick at a time, and shares nothing with the compiler or the recogniser: every choice of
events and values is tried, and every statement is checked as it reads.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, TypeVar

from chronicles.events import Event, Occurrence
from chronicles.language import model
from chronicles.language.parser import parse
from chronicles.language.printer import print_domain
from dyknow.language.diagnostics import Reporter
from tests.chronicles.execution.oracle_statements import (
    Binding,
    Times,
    end_of,
    names_of_equals,
    renamed,
    signed,
    start_of,
    text_of,
    unify,
    variables_of,
)

Kind = TypeVar("Kind")
_EVER = 10**15


@dataclass(frozen=True)
class Match:
    """One occurrence, with the indices of its events in the trace."""

    chronicle: str
    roles: tuple[tuple[str, str], ...]
    start_us: int
    end_us: int
    sub_events: tuple[tuple[str, int], ...]
    indices: tuple[int, ...]
    emitted: tuple[Event, ...]
    closes_us: int
    hypotheses: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Asserted:
    """A value that an action set; `closes_us` is when it did."""

    name: str
    args: tuple[str, ...]
    t_us: int
    value: str
    closes_us: int


@dataclass(frozen=True)
class _Found:
    """A match with what decides its place among others, and what its actions need."""

    match: Match
    order: Any
    anchor: int
    binding: Binding
    times: Times


class Oracle:
    """Finds all occurrences of the chronicles of one text."""

    def __init__(self, text: str) -> None:
        file = parse(text, "oracle", Reporter({"oracle": text}))
        self.chronicles = [one for one in file.declarations if isinstance(one, model.Chronicle)]
        self.declared = {one.name: one for one in file.declarations if isinstance(one, model.Attribute | model.Message)}

    def matches(self, trace: Sequence[Event]) -> list[Match]:
        """Find everything; emitted events are seen by the chronicles that stand later in the text."""
        found: list[Match] = []
        events = list(trace)
        for chronicle in self.chronicles:
            matches = _OneChronicle(chronicle, self.declared, events).matches()
            found += matches
            events += [event for match in matches for event in match.emitted]
        return found


class _OneChronicle:
    def __init__(
        self,
        chronicle: model.Chronicle,
        declared: dict[str, model.Attribute | model.Message],
        events: Sequence[Event],
    ) -> None:
        # "?x == ?y" makes two names of one variable.
        self.one_name = names_of_equals(chronicle)
        self.roles = [one.name for one in chronicle.parameters]
        self.chronicle = chronicle = renamed(chronicle, self.one_name)
        self.declared = declared
        self.events = events
        self.texts = sorted({text for event in events for text in (*event.args, event.old, event.new) if text})
        self.texts += [one for one in {*self._literals(), *map(self._initial, declared)} if one not in self.texts]
        self.sorts = self._sorts()
        self.bound = {name for one in self.of(model.EventStatement) for name in variables_of(one.pattern.terms)}
        self.asserted: list[_Asserted] = []
        self.held = {name for one in self.of(model.HoldStatement) for name in variables_of(one.pattern.terms)}

    def of(self, kind: type[Kind]) -> list[Kind]:
        """Give the statements of one kind."""
        return [one for one in self.chronicle.statements if isinstance(one, kind)]

    def matches(self) -> list[Match]:
        """Try every choice of events, times and values; then select, and let the actions happen in order."""
        best: dict[Any, _Found] = {}
        for binding, times, chosen in self._choices(self.of(model.EventStatement), {}, {}, ()):
            for all_times in self._with_free_points(times):
                if not self._times_fit(all_times):
                    continue
                for full in self._with_held_values(binding, all_times):
                    if self._values_fit(full) and self._are_obligations_kept(full, all_times):
                        found = self._found(full, all_times, chosen)
                        key = tuple(sorted(full.items())), frozenset(chosen)
                        best[key] = min(best.get(key, found), found, key=lambda one: one.order)
        in_order = sorted(best.values(), key=lambda one: one.order)
        return [self._with_emitted(one) for one in self._selected(in_order)]

    def _choices(
        self, statements: Sequence[Any], binding: Binding, times: Times, chosen: tuple[int, ...]
    ) -> Iterator[tuple[Binding, Times, tuple[int, ...]]]:
        if not statements:
            yield binding, times, chosen
            return
        one = statements[0]
        for index, event in enumerate(self.events):
            if index in chosen or times.get(one.point.name, event.t_us) != event.t_us:
                continue
            extended = unify(one.pattern, event, binding)
            if extended is not None:
                new_times = {**times, one.point.name: event.t_us}
                yield from self._choices(statements[1:], extended, new_times, (*chosen, index))

    # ---- times

    def _with_free_points(self, times: Times) -> Iterator[Times]:
        free = sorted(self._points() - times.keys())
        first, last = min(times.values()), max(times.values())
        for values in product(range(first - 40, last + 41), repeat=len(free)):
            candidate = {**times, **dict(zip(free, values, strict=True))}
            if all(self._holds_between(one, candidate) for one in self.chronicle.statements):
                yield candidate

    def _points(self) -> set[str]:
        points = {point.name for point in self.chronicle.points}
        for one in self.chronicle.statements:
            match one:
                case model.EventStatement():
                    points.add(one.point.name)
                case (
                    model.NoEventStatement() | model.OccursStatement() | model.HoldStatement() | model.AssertStatement()
                ):
                    points |= {one.interval.start.point.name, one.interval.end.point.name}
                case model.Comparison():
                    points |= {one.left.name, one.right.name}
                case model.Range():
                    points |= {one.later.name, one.earlier.name}
        return points

    def _times_fit(self, times: Times) -> bool:
        # A hold needs some time to hold in, and events some time to happen in.
        holds, counts = self.of(model.HoldStatement), self.of(model.OccursStatement)
        needing = [*holds, *(one for one in counts if one.least > 0)]
        return all(start_of(one, times) < end_of(one, times) for one in needing)

    def _holds_between(self, one: object, times: Times) -> bool:
        if isinstance(one, model.Comparison):
            left, right = times[one.left.name], times[one.right.name] + signed(one.offset)
            return {"<": left < right, "<=": left <= right, "=": left == right, ">=": left >= right, ">": left > right}[
                one.comparator
            ]
        if isinstance(one, model.Range):
            gap = times[one.later.name] - times[one.earlier.name]
            low_fits = one.low.duration is None or (gap > signed(one.low) if one.low_open else gap >= signed(one.low))
            high_fits = one.high.duration is None or (
                gap < signed(one.high) if one.high_open else gap <= signed(one.high)
            )
            return low_fits and high_fits
        return True

    # ---- attributes

    def _value(self, name: str, args: tuple[str, ...], t_us: int, known_us: int = _EVER) -> str:
        """Give the value at a time; `known_us` leaves out what was asserted later than that."""
        instants = {event.t_us for event in self._changes(name, args) if event.t_us <= t_us}
        asserted = [
            one
            for one in self.asserted
            if (one.name, one.args) == (name, args) and one.t_us <= t_us and one.closes_us <= known_us
        ]
        last = max(instants, default=-_EVER)
        if asserted and max(one.t_us for one in asserted) >= last:
            return max(enumerate(asserted), key=lambda pair: (pair[1].t_us, pair[0]))[1].value
        if not instants:
            return self._initial(name)
        before = self._value(name, args, last - 1, last)
        olds = [event.old or "unknown" for event in self._changes(name, args) if event.t_us == last]
        news = [str(event.new) for event in self._changes(name, args) if event.t_us == last]
        entered = [one for one in news if news.count(one) > olds.count(one)]
        return max(entered or olds) if entered or before not in olds else before

    def _changes(self, name: str, args: tuple[str, ...]) -> list[Event]:
        return [event for event in self.events if (event.name, event.args) == (name, args) and event.new is not None]

    def _initial(self, name: str) -> str:
        declaration = self.declared.get(name)
        if isinstance(declaration, model.Attribute) and declaration.default is not None:
            return declaration.default.text
        return "unknown"

    def _with_held_values(self, binding: Binding, times: Times) -> Iterator[Binding]:
        free = sorted(self.held - binding.keys())
        searched = [name for name in free if not self._is_constant(name)]
        for values in product(self.texts, repeat=len(free)):
            full = {**binding, **dict(zip(free, values, strict=True))}
            if all(self._holding(one, full, times, searched) for one in self.of(model.HoldStatement)):
                yield full

    def _holding(
        self, one: model.HoldStatement, binding: Binding, times: Times, free: Sequence[str]
    ) -> list[tuple[str, ...]]:
        """List the arguments for which a hold is true: several where it says "?"."""
        found = []
        start_us, end_us = start_of(one, times), end_of(one, times)
        places = [i for i, term in enumerate(one.pattern.arguments) if isinstance(term, model.Anything)]
        # Arguments that the hold itself gives values to need a report: a default is no evidence for them.
        searches = bool(places) or any(
            isinstance(term, model.Variable) and term.name in free for term in one.pattern.arguments
        )
        for filling in product(self.texts, repeat=len(places)):
            args = [text_of(term, binding) for term in one.pattern.arguments]
            for place, text in zip(places, filling, strict=True):
                args[place] = text
            if searches and not self._is_reported(one.pattern.name, tuple(args), start_us):
                continue
            values = {self._value(one.pattern.name, tuple(args), t_us) for t_us in range(start_us, end_us)}
            if searches and "unknown" in values:
                continue
            if len(values) == 1 and self._is_wanted(one.pattern.values[0], values.pop(), binding, free):
                found.append(tuple(args))
        return found

    def _is_wanted(self, term: model.Term, value: str, binding: Binding, free: Sequence[str]) -> bool:
        if isinstance(term, model.Anything):
            return value != "unknown"
        if isinstance(term, model.Variable) and term.name in free and value == "unknown":
            return False
        return text_of(term, binding) == value

    def _is_constant(self, name: str) -> bool:
        equal = [one for one in self.of(model.Equality) if one.equal and one.variable.name == name]
        return any(isinstance(one.term, model.Literal) for one in equal)

    def _is_reported(self, name: str, args: tuple[str, ...], t_us: int) -> bool:
        return any(
            (event.name, event.args) == (name, args) and event.new is not None and event.t_us <= t_us
            for event in self.events
        )

    # ---- values

    def _are_obligations_kept(self, binding: Binding, times: Times) -> bool:
        return (
            all(self._number(one, binding, times) == 0 for one in self.of(model.NoEventStatement))
            and all(
                one.least <= self._number(one, binding, times) <= (_EVER if one.most is None else one.most)
                for one in self.of(model.OccursStatement)
            )
            and all(self._is_uncontradicted(one, binding, times) for one in self.of(model.AssertStatement))
        )

    def _number(self, one: Any, binding: Binding, times: Times) -> int:
        within = [event for event in self.events if start_of(one, times) <= event.t_us < end_of(one, times)]
        extended = [unify(one.pattern, event, binding) for event in within]
        return sum(full is not None and self._values_fit(full) for full in extended)

    def _is_uncontradicted(self, one: model.AssertStatement, binding: Binding, times: Times) -> bool:
        args = tuple(text_of(term, binding) for term in one.pattern.arguments)
        wanted = {text_of(one.pattern.values[0], binding), "unknown"}
        return all(
            self._value(one.pattern.name, args, t_us) in wanted
            for t_us in range(start_of(one, times), end_of(one, times))
        )

    def _values_fit(self, binding: Binding) -> bool:
        for equality in self.of(model.Equality):
            names = [equality.variable, equality.term]
            if any(isinstance(one, model.Variable) and one.name not in binding for one in names):
                continue
            if (binding[equality.variable.name] == text_of(equality.term, binding)) != equality.equal:
                return False
        for member in self.of(model.Membership):
            assert isinstance(member.domain, model.DomainValues)
            values = {value.text for value in member.domain.values}
            if member.variable.name in binding and binding[member.variable.name] not in values:
                return False
        names_bound = sorted(binding)
        for left, right in product(names_bound, names_bound):
            if left < right and self._must_differ(left, right) and binding[left] == binding[right]:
                return False
        return True

    def _must_differ(self, left: str, right: str) -> bool:
        allowed = any({one.left.name, one.right.name} == {left, right} for one in self.of(model.Allowance))
        return bool(self.sorts[left] & self.sorts[right]) and not allowed

    def _sorts(self) -> dict[str, set[str]]:
        sorts: dict[str, set[str]] = {}
        for one in self.chronicle.statements:
            if isinstance(one, model.EventStatement | model.Obligation):
                self._add_sorts(one.pattern, sorts)
        return {name: {sort for sort in found if sort} or {""} for name, found in sorts.items()}

    def _add_sorts(self, pattern: model.Pattern, sorts: dict[str, set[str]]) -> None:
        declaration = self.declared.get(pattern.name)
        names = ["" for _ in pattern.arguments]
        value = ""
        if declaration is not None:
            by_name = {one.variable.name: print_domain(one.domain) for one in declaration.domains}
            names = [by_name.get(parameter.name, "") for parameter in declaration.parameters]
            if isinstance(declaration, model.Attribute) and declaration.value_domain is not None:
                value = print_domain(declaration.value_domain)
        fields = [*names, value, value]
        for term, sort in zip(pattern.terms, fields, strict=False):
            if isinstance(term, model.Variable):
                sorts.setdefault(term.name, set()).add(sort)

    def _literals(self) -> Iterable[str]:
        for one in self.chronicle.statements:
            if isinstance(one, model.HoldStatement):
                yield from (term.text for term in one.pattern.terms if isinstance(term, model.Literal))

    # ---- evidence

    def _hypotheses(self, binding: Binding, times: Times, chosen: tuple[int, ...]) -> tuple[str, ...]:
        found = {label for index in chosen for label in self.events[index].hypotheses}
        free = sorted(name for name in self.held - self.bound if not self._is_constant(name))
        for hold in self.of(model.HoldStatement):
            for args in self._holding(hold, binding, times, free):
                found |= self._labels_in_force(hold.pattern.name, args, start_of(hold, times))
        for one in self.of(model.AssertStatement):
            args = tuple(text_of(term, binding) for term in one.pattern.arguments)
            before = "unknown"
            for t_us in range(start_of(one, times), end_of(one, times)):
                value = self._value(one.pattern.name, args, t_us)
                if value not in ("unknown", before):
                    found |= self._labels_in_force(one.pattern.name, args, t_us)
                before = value
        return tuple(sorted(found))

    def _labels_in_force(self, name: str, args: tuple[str, ...], t_us: int) -> set[str]:
        """Give the hypotheses of the latest changes at or before a time."""
        changes = [event for event in self._changes(name, args) if event.t_us <= t_us]
        last = max((event.t_us for event in changes), default=0)
        return {label for event in changes if event.t_us == last for label in event.hypotheses}

    # ---- the result

    def _found(self, binding: Binding, times: Times, chosen: tuple[int, ...]) -> _Found:
        match = self._match(binding, times, chosen)
        [select] = self.of(model.SelectStatement) or [None]
        anchor = -1
        if select is not None and select.anchor is not None:
            points = [one.point.name for one in self.of(model.EventStatement)]
            anchor = chosen[points.index(select.anchor.name)]
        names = [*sorted(self.bound), *sorted(self.held - self.bound)]
        values = tuple(binding[name] for name in names if not self._is_constant(name))
        by_time = tuple(sorted(chosen, key=lambda index: (self.events[index].t_us, index)))
        return _Found(match, (match.closes_us, values, match.sub_events, by_time, anchor), anchor, binding, times)

    def _selected(self, in_order: Sequence[_Found]) -> list[_Found]:
        kind = next((one.kind for one in self.of(model.SelectStatement)), "all")
        told: list[_Found] = []
        for one in in_order:
            if kind == "first" and any(other.anchor == one.anchor for other in told):
                continue
            if kind == "non_overlapping" and any(
                other.match.roles == one.match.roles and _ticks(other.match) & _ticks(one.match) for other in told
            ):
                continue
            told.append(one)
        return told

    def _with_emitted(self, found: _Found) -> Match:
        emitted: list[Event] = []
        for one in self.chronicle.actions:
            if isinstance(one, model.Emit):
                emitted.append(
                    replace(self._emitted(one, found.binding, found.times), hypotheses=found.match.hypotheses)
                )
            elif isinstance(one, model.AssertAction):
                emitted += self._change(one, found)
        return replace(found.match, emitted=tuple(emitted))

    def _change(self, one: model.AssertAction, found: _Found) -> list[Event]:
        args = tuple(text_of(term, found.binding) for term in one.pattern.arguments)
        t_us, new = (
            found.times[one.time.point.name] + signed(one.time.offset),
            text_of(one.pattern.values[0], found.binding),
        )
        old = self._value(one.pattern.name, args, t_us)
        if old == new:
            return []
        self.asserted.append(_Asserted(one.pattern.name, args, t_us, new, found.match.closes_us))
        return [Event(one.pattern.name, args, t_us, old, new, found.match.hypotheses)]

    def _match(self, binding: Binding, times: Times, chosen: tuple[int, ...]) -> Match:
        kinds = (model.NoEventStatement, model.OccursStatement, model.HoldStatement, model.AssertStatement)
        ends = [end_of(one, times) for kind in kinds for one in self.of(kind)]
        asserts = [one.time for one in self.chronicle.actions if isinstance(one, model.AssertAction)]
        # What an assert finds at its time is known one tick later.
        ends += [times[time.point.name] + signed(time.offset) + 1 for time in asserts]
        event_times = [self.events[index].t_us for index in chosen]
        points = self.chronicle.points
        is_ordered = bool(asserts) or any(one.kind != "all" for one in self.of(model.SelectStatement))
        ends_us = [times[points[0].name], times[points[-1].name]] if points else event_times
        return Match(
            self.chronicle.name,
            tuple((name, binding[self.one_name.get(name, name)]) for name in self.roles),
            min(ends_us),
            max(ends_us),
            tuple((name, t_us) for t_us, name in sorted((t_us, name) for name, t_us in times.items())),
            tuple(sorted(chosen)),
            (),
            max(event_times + ends) + is_ordered,
            self._hypotheses(binding, times, chosen),
        )

    def _emitted(self, one: model.Emit, binding: Binding, times: Times) -> Event:
        point = self.chronicle.points[-1].name if one.time is None else one.time.point.name
        t_us = times[point] + (0 if one.time is None else signed(one.time.offset))
        args = tuple(text_of(term, binding) for term in one.pattern.arguments)
        if not one.pattern.values:
            return Event(one.pattern.name, args, t_us)
        old, new = (text_of(term, binding) for term in one.pattern.values)
        return Event(one.pattern.name, args, t_us, old, new)


def as_match(occurrence: Occurrence, index_of: Callable[[Event], int], closes_us: int) -> Match:
    """Put an occurrence into the oracle's form."""
    return Match(
        occurrence.chronicle,
        tuple(occurrence.roles.items()),
        occurrence.start_us,
        occurrence.end_us,
        occurrence.sub_events,
        tuple(sorted(index_of(event) for event in occurrence.events)),
        occurrence.emitted,
        closes_us,
        occurrence.hypotheses,
    )


def _ticks(match: Match) -> set[int]:
    return set(range(match.start_us, max(match.end_us, match.start_us + 1)))
