"""The meaning of a chronicle, as a slow and obvious search over a whole trace.

Works on the syntax tree, one tick at a time, and shares nothing with the compiler or the recogniser: every choice of
events and values is tried, and every statement is checked as it reads.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import product
from typing import Any, TypeVar

from chronicles.events import Event, Occurrence
from chronicles.language import model
from chronicles.language.diagnostics import Reporter
from chronicles.language.parser import parse
from chronicles.language.printer import print_domain

Binding = dict[str, str]
Times = dict[str, int]
Kind = TypeVar("Kind")


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
        self.one_name = _names_of_equals(chronicle)
        self.roles = [one.name for one in chronicle.parameters]
        self.chronicle = chronicle = _renamed(chronicle, self.one_name)
        self.declared = declared
        self.events = events
        self.texts = sorted({text for event in events for text in (*event.args, event.old, event.new) if text})
        self.texts += [one for one in {*self._literals(), *map(self._initial, declared)} if one not in self.texts]
        self.sorts = self._sorts()
        self.bound = {name for one in self.of(model.EventStatement) for name in _variables(_terms(one.pattern))}
        self.held = {name for one in self.of(model.HoldStatement) for name in _variables(_terms(one.fluent))}

    def of(self, kind: type[Kind]) -> list[Kind]:
        """Give the statements of one kind."""
        return [one for one in self.chronicle.statements if isinstance(one, kind)]

    def matches(self) -> list[Match]:
        """Try every choice of events, times and values."""
        found: dict[Any, Match] = {}
        for binding, times, chosen in self._choices(self.of(model.EventStatement), {}, {}, ()):
            for all_times in self._with_free_points(times):
                if not self._times_fit(all_times):
                    continue
                for full in self._with_held_values(binding, all_times):
                    if self._values_fit(full) and self._nothing_forbidden(full, all_times):
                        match = self._match(full, all_times, chosen)
                        key = tuple(sorted(full.items())), frozenset(chosen)
                        best = found.setdefault(key, match)
                        if (match.closes_us, match.sub_events) < (best.closes_us, best.sub_events):
                            found[key] = match
        return list(found.values())

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
            extended = _unify(one.pattern, event, binding)
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
                case model.NoEventStatement() | model.HoldStatement():
                    points |= {one.interval.start.point.name, one.interval.end.point.name}
                case model.Comparison():
                    points |= {one.left.name, one.right.name}
                case model.Range():
                    points |= {one.later.name, one.earlier.name}
        return points

    def _times_fit(self, times: Times) -> bool:
        # A hold needs some time to hold in.
        return all(_start(one, times) < _end(one, times) for one in self.of(model.HoldStatement))

    def _holds_between(self, one: object, times: Times) -> bool:
        if isinstance(one, model.Comparison):
            left, right = times[one.left.name], times[one.right.name] + _signed(one.offset)
            return {"<": left < right, "<=": left <= right, "=": left == right, ">=": left >= right, ">": left > right}[
                one.comparator
            ]
        if isinstance(one, model.Range):
            gap = times[one.later.name] - times[one.earlier.name]
            low_fits = one.low.duration is None or (gap > _signed(one.low) if one.low_open else gap >= _signed(one.low))
            high_fits = one.high.duration is None or (
                gap < _signed(one.high) if one.high_open else gap <= _signed(one.high)
            )
            return low_fits and high_fits
        return True

    # ---- attributes

    def _value(self, name: str, args: tuple[str, ...], t_us: int) -> str:
        value = self._initial(name)
        changes = [event for event in self.events if (event.name, event.args) == (name, args) and event.new is not None]
        for instant in sorted({event.t_us for event in changes if event.t_us <= t_us}):
            olds = [event.old or "unknown" for event in changes if event.t_us == instant]
            news = [event.new for event in changes if event.t_us == instant]
            entered = [one for one in news if one is not None and news.count(one) > olds.count(one)]
            if entered or value not in olds:
                value = max(entered or olds)
        return value

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
            if all(self._is_held(one, full, times, searched) for one in self.of(model.HoldStatement)):
                yield full

    def _is_held(self, one: model.HoldStatement, binding: Binding, times: Times, free: Sequence[str]) -> bool:
        start_us, end_us = _start(one, times), _end(one, times)
        places = [i for i, term in enumerate(one.fluent.arguments) if isinstance(term, model.Anything)]
        # Arguments that the hold itself gives values to need a report: a default is no evidence for them.
        searches = bool(places) or any(
            isinstance(term, model.Variable) and term.name in free for term in one.fluent.arguments
        )
        for filling in product(self.texts, repeat=len(places)):
            args = [_text(term, binding) for term in one.fluent.arguments]
            for place, text in zip(places, filling, strict=True):
                args[place] = text
            if searches and not self._is_reported(one.fluent.name, tuple(args), start_us):
                continue
            values = {self._value(one.fluent.name, tuple(args), t_us) for t_us in range(start_us, end_us)}
            if searches and "unknown" in values:
                continue
            if len(values) == 1 and self._is_wanted(one.fluent.value, values.pop(), binding, free):
                return True
        return False

    def _is_wanted(self, term: model.Term, value: str, binding: Binding, free: Sequence[str]) -> bool:
        if isinstance(term, model.Anything):
            return value != "unknown"
        if isinstance(term, model.Variable) and term.name in free and value == "unknown":
            return False
        return _text(term, binding) == value

    def _is_constant(self, name: str) -> bool:
        equal = [one for one in self.of(model.Equality) if one.equal and one.variable.name == name]
        return any(isinstance(one.term, model.Literal) for one in equal)

    def _is_reported(self, name: str, args: tuple[str, ...], t_us: int) -> bool:
        return any(
            (event.name, event.args) == (name, args) and event.new is not None and event.t_us <= t_us
            for event in self.events
        )

    # ---- values

    def _nothing_forbidden(self, binding: Binding, times: Times) -> bool:
        for one in self.of(model.NoEventStatement):
            for event in self.events:
                if _start(one, times) <= event.t_us < _end(one, times):
                    extended = _unify(one.pattern, event, binding)
                    if extended is not None and self._values_fit(extended):
                        return False
        return True

    def _values_fit(self, binding: Binding) -> bool:
        for equality in self.of(model.Equality):
            names = [equality.variable, equality.term]
            if any(isinstance(one, model.Variable) and one.name not in binding for one in names):
                continue
            if (binding[equality.variable.name] == _text(equality.term, binding)) != equality.equal:
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
            if isinstance(one, model.EventStatement | model.NoEventStatement):
                self._add_sorts(one.pattern, sorts)
            elif isinstance(one, model.HoldStatement):
                self._add_sorts(one.fluent, sorts)
        return {name: {sort for sort in found if sort} or {""} for name, found in sorts.items()}

    def _add_sorts(self, pattern: model.Pattern | model.Fluent, sorts: dict[str, set[str]]) -> None:
        declaration = self.declared.get(pattern.name)
        names = ["" for _ in pattern.arguments]
        value = ""
        if declaration is not None:
            by_name = {one.variable.name: print_domain(one.domain) for one in declaration.domains}
            names = [by_name.get(parameter.name, "") for parameter in declaration.parameters]
            if isinstance(declaration, model.Attribute) and declaration.value_domain is not None:
                value = print_domain(declaration.value_domain)
        fields = [*names, value, value]
        for term, sort in zip(_terms(pattern), fields, strict=False):
            if isinstance(term, model.Variable):
                sorts.setdefault(term.name, set()).add(sort)

    def _literals(self) -> Iterable[str]:
        for one in self.chronicle.statements:
            if isinstance(one, model.HoldStatement):
                yield from (term.text for term in _terms(one.fluent) if isinstance(term, model.Literal))

    # ---- the result

    def _match(self, binding: Binding, times: Times, chosen: tuple[int, ...]) -> Match:
        ends = [_end(one, times) for kind in (model.NoEventStatement, model.HoldStatement) for one in self.of(kind)]
        event_times = [self.events[index].t_us for index in chosen]
        points = self.chronicle.points
        return Match(
            self.chronicle.name,
            tuple((name, binding[self.one_name.get(name, name)]) for name in self.roles),
            times[points[0].name] if points else min(event_times),
            times[points[-1].name] if points else max(event_times),
            tuple((name, t_us) for t_us, name in sorted((t_us, name) for name, t_us in times.items())),
            tuple(sorted(chosen)),
            tuple(self._emitted(one, binding, times) for one in self.chronicle.actions if isinstance(one, model.Emit)),
            max(event_times + ends),
        )

    def _emitted(self, one: model.Emit, binding: Binding, times: Times) -> Event:
        point = self.chronicle.points[-1].name if one.time is None else one.time.point.name
        t_us = times[point] + (0 if one.time is None else _signed(one.time.offset))
        args = tuple(_text(term, binding) for term in one.pattern.arguments)
        if one.pattern.change is None:
            return Event(one.pattern.name, args, t_us)
        old, new = (_text(term, binding) for term in one.pattern.change)
        return Event(one.pattern.name, args, t_us, old, new)


def _names_of_equals(chronicle: model.Chronicle) -> dict[str, str]:
    names: dict[str, str] = {}
    for one in chronicle.statements:
        if isinstance(one, model.Equality) and one.equal and isinstance(one.term, model.Variable):
            left = names.setdefault(one.variable.name, one.variable.name)
            right = names.setdefault(one.term.name, one.term.name)
            names = {name: min(left, right) if root in (left, right) else root for name, root in names.items()}
    return names


def _renamed(node: Any, names: dict[str, str]) -> Any:
    """Replace the names of variables everywhere below a node of the tree."""
    if isinstance(node, tuple):
        return tuple(_renamed(one, names) for one in node)
    if isinstance(node, model.Variable):
        return replace(node, name=names.get(node.name, node.name))
    if is_dataclass(node) and not isinstance(node, type):
        return replace(node, **{one.name: _renamed(getattr(node, one.name), names) for one in fields(node)})
    return node


def _unify(pattern: model.Pattern, event: Event, binding: Binding) -> Binding | None:
    terms = _terms(pattern)
    values: tuple[str, ...] = event.args
    if event.name != pattern.name or len(event.args) != len(pattern.arguments):
        return None
    if (event.new is None) != (pattern.change is None):
        return None
    if event.new is not None:
        old = event.old or "unknown"
        if old == event.new:
            return None
        values = (*values, old, event.new)
    extended = dict(binding)
    for term, value in zip(terms, values, strict=True):
        if isinstance(term, model.Literal) and term.text != value:
            return None
        if isinstance(term, model.Variable) and extended.setdefault(term.name, value) != value:
            return None
    return extended


def _terms(pattern: model.Pattern | model.Fluent) -> tuple[model.Term, ...]:
    if isinstance(pattern, model.Fluent):
        return (*pattern.arguments, pattern.value)
    return (*pattern.arguments, *(pattern.change or ()))


def _variables(terms: Iterable[model.Term]) -> set[str]:
    return {term.name for term in terms if isinstance(term, model.Variable)}


def _text(term: model.Term, binding: Binding) -> str:
    if isinstance(term, model.Anything):
        return "?"
    return binding[term.name] if isinstance(term, model.Variable) else term.text


def _signed(bound: model.Bound | None) -> int:
    if bound is None or bound.duration is None:
        return 0
    return -bound.duration.us if bound.negative else bound.duration.us


def _start(one: Any, times: Times) -> int:
    return times[one.interval.start.point.name] + _signed(one.interval.start.offset)


def _end(one: Any, times: Times) -> int:
    return times[one.interval.end.point.name] + _signed(one.interval.end.offset)


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
    )
