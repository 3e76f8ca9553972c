"""What does each rule of `chronicle.lark` build of the tree in `model.py`?

A class of the model, or one short method named as the rule; the parts are words, and what was built of its parts.
Numbers and durations become integer microseconds here, exactly: a duration that is no whole number of microseconds is
an error, never rounded.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast  # Any: the parts of a rule are words, or what other rules built

from chronicles.language import model
from chronicles.language.syntax_errors import SELECTIONS
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.durations import (
    LARGEST_US,
    LONGEST_NUMBER,
    US_PER_UNIT,
    format_duration,
    meant,
    split_quantity,
    to_us,
)
from dyknow.language.places import Span
from dyknow.language.reading import Parts
from dyknow.language.words import Word

_EXPONENT = re.compile(r"[eE][-+]?[0-9]")


class _Item(NamedTuple):
    """Something that may stand once in a declaration."""

    kind: Literal["value", "default", "until"]
    content: Any
    span: Span


# Rules whose parts are those of their node; the others have a method each.
_PLAIN: Mapping[str, Callable[..., object]] = MappingProxyType(
    {
        "event": model.EventStatement,
        "noevent": model.NoEventStatement,
        "hold": model.HoldStatement,
        "assertion": model.AssertStatement,
        "interval": model.Interval,
        "time": model.TimeExpression,
        "comparison": model.Comparison,
        "membership": model.Membership,
        "parameter_domain": model.Membership,
        "emit": model.Emit,  # `emit event(pattern, t1)`
        "emit_short": model.Emit,  # `emit pattern`, with a time or without
        "assert_action": model.AssertAction,
        "domain_symbol": model.DomainSymbol,
        "anything": model.Anything,
        **{rule: partial(_Item, rule) for rule in ("value", "default", "until")},
    }
)


class Methods(dict[str, Callable[[Parts, Span], Any]]):
    """What builds each rule, found once: the loop that asks for it runs thousands of times in a text."""

    def __init__(self, builder: TreeBuilder) -> None:
        super().__init__()
        self._builder = builder

    def __missing__(self, rule: str) -> Callable[[Parts, Span], Any]:
        plain = _PLAIN.get(rule)
        made = (lambda parts, span: plain(*parts, span=span)) if plain is not None else getattr(self._builder, rule)
        self[rule] = made
        return made


class TreeBuilder:
    """Builds declarations of one text; keeps the unit of bare numbers once a `timeunit` was built."""

    def __init__(self, file: str, reporter: Reporter) -> None:
        self._file = file
        self._reporter = reporter
        self._unit_us: int | None = None
        self._is_bare_told = False
        self._unit_span: Span | None = None

    # ---- declarations

    def timeunit(self, parts: Parts, span: Span) -> model.TimeUnit:
        """Build `timeunit 1ms`."""
        if self._unit_span is not None:
            related = [(self._unit_span, "the first")]
            message = "expected one timeunit in a text, got a second"
            self._reporter.error("C0203", message, span, "keep one", related=related)
        us = cast(model.Duration, parts[0]).us
        if us == 0:
            self._reporter.error("C0401", "expected a timeunit above zero, got 0", span)
            us = model.UNREAD_US
        self._unit_us, self._unit_span = us, span
        return model.TimeUnit(us, span=span)

    def constant(self, parts: Parts, span: Span) -> model.Constant:
        """Build `constant name = value`."""
        name, value = parts
        if isinstance(value, Word):
            value = model.Duration(self._microseconds(value), "", span=self._span(value))
        return model.Constant(name.text, value, name_span=self._span(name), span=span)

    def domain(self, parts: Parts, span: Span) -> model.Domain:
        """Build `domain name = expression`."""
        name, expression = parts
        return model.Domain(name.text, expression, name_span=self._span(name), span=span)

    def attribute(self, parts: Parts, span: Span) -> model.Attribute:
        """Build `attribute name[parameters] { ... }`."""
        name, parameters, *items = parts
        domains = tuple(item for item in items if isinstance(item, model.Membership))
        value, default = self._once(items, "value"), self._once(items, "default")
        return model.Attribute(name.text, parameters, domains, value, default, name_span=self._span(name), span=span)

    def _once(self, items: Parts, kind: str) -> Any:
        """Give what stands behind a word that may come once, None without."""
        found = [item for item in items if isinstance(item, _Item) and item.kind == kind]
        for doubled in found[1:]:
            message = f"expected one {kind!r} in a declaration, got a second"
            self._reporter.error("C0203", message, doubled.span, "keep one", related=[(found[0].span, "the first")])
        return found[0].content if found else None

    def message(self, parts: Parts, span: Span) -> model.Message:
        """Build `message name[parameters] { ... }`."""
        name, parameters, *items = parts
        return model.Message(name.text, parameters, _there(items), name_span=self._span(name), span=span)

    def chronicle(self, parts: Parts, span: Span) -> model.Chronicle:
        """Build `chronicle name[parameters](points) { ... }`."""
        name, parameters, points, *statements, actions = parts
        head = name.text, parameters or (), points or ()
        return model.Chronicle(*head, _there(statements), actions or (), name_span=self._span(name), span=span)

    # ---- domains

    def domain_values(self, parts: Parts, span: Span) -> model.DomainValues:
        """Build `{a, b}`."""
        return model.DomainValues(tuple(parts), span=span)

    def domain_range(self, parts: Parts, span: Span) -> model.DomainRange:
        """Build `[1..5]`; the word between the numbers is the second part."""
        return model.DomainRange(parts[0], parts[2], span=span)

    def domain_name(self, parts: Parts, span: Span) -> model.DomainName:
        """Build the name of a domain."""
        return model.DomainName(parts[0].text, span=span)

    def union(self, parts: Parts, span: Span) -> model.DomainOperation:
        """Build `left | right`."""
        return self._operation(parts[0], "|", parts[1], span)

    def difference(self, parts: Parts, span: Span) -> model.DomainOperation:
        """Build `left ~ right`."""
        return self._operation(parts[0], "~", parts[1], span)

    def _operation(
        self, left: model.DomainExpression, operator: Literal["|", "~"], right: model.DomainExpression, span: Span
    ) -> model.DomainOperation:
        """Build a union or difference; one that is too deep is reported once, and counts as any value."""
        depth = 1 + max(one.depth if isinstance(one, model.DomainOperation) else 0 for one in (left, right))
        if depth <= model.DEEPEST_DOMAIN:
            return model.DomainOperation(left, operator, right, depth, span=span)
        if depth == model.DEEPEST_DOMAIN + 1:
            wanted = f"a domain of at most {model.DEEPEST_DOMAIN} operations in one another"
            message = f"expected {wanted}, got at least {depth}"
            hint = "write the values in one set {a, b, ...}, or give parts of the domain names of their own"
            self._reporter.error("C0109", message, span, hint)
        anything = model.DomainSymbol(span=span)
        return model.DomainOperation(anything, "|", anything, depth, span=span)

    # ---- statements

    def occurs(self, parts: Parts, span: Span) -> model.OccursStatement:
        """Build `occurs((1, 2), pattern, (t1, t2))`."""
        (least, most), pattern, interval = parts
        return model.OccursStatement(pattern, interval, least, most, span=span)

    def count(self, parts: Parts, _: Span) -> tuple[int, int | None]:
        """Read the least and the most number of events."""
        least, most = parts
        return self._whole(least), None if most.kind == "INFINITE" else self._whole(most)

    def comparator(self, parts: Parts, _: Span) -> str:
        """Read the sign between two time points."""
        return cast(Word, parts[0]).text

    def range(self, parts: Parts, span: Span) -> model.Range:
        """Build `t2 - t1 in [1s, 5s]`; outward brackets leave the bound out."""
        later, _, earlier, opening, low, high, closing = parts
        return model.Range(later, earlier, low, opening == "]", high, closing == "[", False, span=span)

    def chain_range(self, parts: Parts, span: Span) -> model.Range:
        """Build `1s <= t2 - t1 < 5s`."""
        low, left, later, _, earlier, right, high = parts
        return model.Range(later, earlier, low, left == "<", high, right == "<", True, span=span)

    # Both are one sign.
    chain = bracket = comparator

    def equal(self, parts: Parts, span: Span) -> model.Equality:
        """Build `?x == term` or `?x != term`."""
        variable, sign, term = parts
        return model.Equality(variable, sign.kind == "SAME", term, span=span)

    different = equal

    def allowance(self, parts: Parts, span: Span) -> model.Allowance:
        """Build `allow ?x == ?y`."""
        return model.Allowance(parts[0], parts[2], span=span)

    def selection(self, parts: Parts, span: Span) -> model.SelectStatement:
        """Build `select first(t1)` and its kin; one that is none of them counts as `select all`."""
        kind, anchor = parts
        if kind.text in SELECTIONS and (kind.text == "first") == (anchor is not None):
            return model.SelectStatement(kind.text, anchor, span=span)
        came, place, hint = kind.text, self._span(kind), suggest(kind.text, SELECTIONS)
        if kind.text in SELECTIONS:
            came, place = came if anchor is None else f"{came}({anchor.name})", span
            hint = Hint("'first' needs the time point of an event, the others take none")
        self._reporter.error("C0107", f"expected all, first(t1) or non_overlapping, got {came!r}", place, hint)
        return model.SelectStatement("all", None, span=span)

    def floor(self, parts: Parts, span: Span) -> model.ConfidenceStatement:
        """Build `confidence >= 0.8`; a number that is no probability counts as 0."""
        least = float(parts[-1].text)
        if least > 1:
            message = f"expected a confidence of 0 to 1, got {parts[-1].text}"
            self._reporter.error("C0110", message, self._span(parts[-1]), "write 0.8 for 80 %")
            least = 0.0
        return model.ConfidenceStatement(least, span=span)

    # ---- actions

    def report(self, parts: Parts, span: Span) -> model.Report:
        """Build `report "text"`."""
        return model.Report(parts[0].unquoted, span=span)

    # ---- parts of statements

    def pattern(self, parts: Parts, span: Span) -> model.Pattern:
        """Build the pattern of an event, or an attribute with the value it must have."""
        name, arguments, *values = parts
        return model.Pattern(name.text, arguments or (), _there(values), name_span=self._span(name), span=span)

    fluent = pattern

    def arguments(self, parts: Parts, _: Span) -> tuple[Any, ...]:
        """Collect arguments, what stands in a head, or what is done when an instance is recognised."""
        return _there(parts)

    parameters = time_points = reaction = arguments

    def variable(self, parts: Parts, span: Span) -> model.Variable:
        """Build a variable."""
        return model.Variable(parts[0].text[1:], span=span)

    def point(self, parts: Parts, span: Span) -> model.TimePoint:
        """Build a time point."""
        return model.TimePoint(parts[0].text, span=span)

    def literal(self, parts: Parts, span: Span) -> model.Literal:
        """Build a value; the sign of a negative number is a part of its own."""
        if parts[-1].kind == "STRING":
            return model.Literal(parts[-1].unquoted, True, span=span)
        return model.Literal("".join(word.text for word in parts), False, span=span)

    def bound(self, parts: Parts, span: Span) -> model.Bound:
        """Build a duration, a constant or `oo`, with a sign or none."""
        sign, length = parts
        if isinstance(length, Word):
            length = model.Duration(0, length.text, span=self._span(length)) if length.kind == "NAME" else None
        return model.Bound(sign == "-", length, span=span)

    offset = bound

    # ---- examples

    def example(self, parts: Parts, span: Span) -> model.Example:
        """Build `example "title" { ... }`."""
        title, *items = parts
        until = self._once(items, "until")
        return model.Example(
            title.unquoted,
            tuple(item for item in items if isinstance(item, model.ExampleEvent)),
            None if until is None else until.us,
            tuple(item for item in items if isinstance(item, model.ExpectedOccurrence)),
            span=span,
        )

    def example_event(self, parts: Parts, span: Span) -> model.ExampleEvent:
        """Build `1s pattern`, which has values only."""
        time, pattern = parts
        for term in pattern.terms:
            if not isinstance(term, model.Literal):
                came = f"?{term.name}" if isinstance(term, model.Variable) else "?"
                message = f"expected a value in an event of an example, got {came!r}"
                self._reporter.error("C0108", message, term.span, f"write a value such as {came[1:] or 'car1'}")
        return model.ExampleEvent(time.us, pattern, span=span)

    def expectation(self, parts: Parts, span: Span) -> model.ExpectedOccurrence:
        """Build `expect chronicle[role=value] 2s..4s`."""
        name, *roles, start, _, end = parts
        if start.is_read and end.is_read and start.us > end.us:
            message = "expected an end that is not before the start, got the later time first"
            edit = f"{format_duration(end.us)}..{format_duration(start.us)}"
            hint = Hint("the earlier time comes first", edit)
            self._reporter.error("C0401", message, start.span.to(end.span), hint)
        return model.ExpectedOccurrence(name.text, _there(roles), start.us, end.us, self._span(name), span=span)

    def role(self, parts: Parts, span: Span) -> model.Role:
        """Build `name=value`."""
        return model.Role(parts[0].text.removeprefix("?"), parts[2], span=span)

    # ---- numbers

    def duration(self, parts: Parts, span: Span) -> model.Duration:
        """Read a length of time; a bare number counts the unit of the text."""
        return model.Duration(self._microseconds(parts[0]), "", span=span)

    def integer(self, parts: Parts, _: Span) -> int:
        """Read a whole number."""
        sign, digits = parts
        return self._whole(digits) * (1 if sign is None else -1)

    sign = comparator

    def _microseconds(self, word: Word) -> int:
        """Read a number with its unit; `UNREAD_US` after a report, also an earlier one of the unit of the text."""
        digits, unit = split_quantity(word.text)
        if _EXPONENT.match(unit):
            message = f"expected a number without an exponent, got {word.text!r}"
            self._reporter.error("C0105", message, self._span(word), "write it out, such as 0.00001s or 10us")
            return model.UNREAD_US
        if unit and unit not in US_PER_UNIT:
            message = f"expected a unit of time, got {unit!r}"
            self._reporter.error("C0104", message, self._span(word), meant(digits, unit))
            return model.UNREAD_US
        unit_us = US_PER_UNIT[unit] if unit else self._unit_us
        if unit_us is None and digits.strip("0."):
            self._tell_bare(word)
            return model.UNREAD_US
        if self._is_too_long(word) or unit_us == model.UNREAD_US:
            return model.UNREAD_US
        us = to_us(digits, unit_us or 0)
        if us is None or us > LARGEST_US:
            wanted = "a whole number of microseconds" if us is None else "at most 35 years"
            hint = "time counts in whole microseconds"
            self._reporter.error("C0105", f"expected {wanted}, got {word.text!r}", self._span(word), hint)
            return model.UNREAD_US
        return us

    def _tell_bare(self, word: Word) -> None:
        """Report the first number without a unit of a text that does not say what numbers count; one line mends all."""
        if not self._is_bare_told:
            message = f"expected a duration with a unit of time, got {word.text!r}"
            hint = f"write {word.text}s, or say what all numbers of the text count: timeunit 1s"
            self._reporter.error("C0106", message, self._span(word), hint)
        self._is_bare_told = True

    def _whole(self, word: Word) -> int:
        if not word.text.isdigit():
            self._reporter.error("C0105", f"expected a whole number, got {word.text!r}", self._span(word))
            return 0
        return 0 if self._is_too_long(word) else int(word.text)

    def _is_too_long(self, word: Word) -> bool:
        length = len(word.text)
        if length > LONGEST_NUMBER:
            message = f"expected a number of at most {LONGEST_NUMBER} characters, got one of {length}"
            self._reporter.error("C0105", message, self._span(word))
        return length > LONGEST_NUMBER

    # ---- words

    def _span(self, word: Word) -> Span:
        return word.span(self._file)


def _there(parts: Parts) -> tuple[Any, ...]:
    """Leave out the places of optional parts that do not stand in the text."""
    return tuple(one for one in parts if one is not None)
