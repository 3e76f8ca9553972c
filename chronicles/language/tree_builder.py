"""How does a parse tree become the tree of `model.py`?

One short method per rule of `chronicle.lark`. Numbers and durations become integer microseconds here, exactly: a
duration that is no whole number of microseconds is an error, never rounded.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any, cast  # Any: lark leaves the children of a tree untyped

from lark import Token, Tree

from chronicles.language import model
from chronicles.language.diagnostics import Reporter, Span, suggest
from chronicles.language.syntax_errors import TIME_UNITS

_US_PER_UNIT = {"us": 1, "ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000}
_LARGEST_US = 2**50  # 35 years: sums of bounds stay far inside 64 bits
_DURATION = re.compile(r"([0-9.]+)([A-Za-z]*)")
_Node = Tree[Any]


def _parts(tree: _Node) -> list[Any]:
    return tree.children


class TreeBuilder:
    """Builds declarations of one text; keeps the unit of bare numbers once a `timeunit` was built."""

    def __init__(self, file: str, reporter: Reporter) -> None:
        self._file = file
        self._reporter = reporter
        self._unit_us: int | None = None

    def declaration(self, tree: _Node) -> model.Declaration:
        """Build a declaration from the tree of rule `declaration`."""
        builders: dict[str, Callable[[_Node], model.Declaration]] = {
            "timeunit": self._timeunit,
            "constant": self._constant,
            "domain": self._domain,
            "attribute": self._attribute,
            "message": self._message,
            "chronicle": self._chronicle,
        }
        return builders[tree.data](tree)

    # ---- declarations

    def _timeunit(self, tree: _Node) -> model.TimeUnit:
        if self._unit_us is not None:
            self._reporter.error("C0203", "expected one timeunit in a text, got a second", self._span(tree))
        us = self._microseconds(_parts(_parts(tree)[0])[0], 1)
        if us == 0:
            self._reporter.error("C0401", "expected a timeunit above zero, got 0", self._span(tree))
        self._unit_us = us
        return model.TimeUnit(us, self._span(tree))

    def _constant(self, tree: _Node) -> model.Constant:
        name, value = _parts(tree)
        if isinstance(value, Token):
            kept: model.Literal | model.Duration = model.Duration(self._microseconds(value, 1), "", self._span(value))
        else:
            kept = self._literal(value)
        return model.Constant(str(name), kept, self._span(name), self._span(tree))

    def _domain(self, tree: _Node) -> model.Domain:
        name, expression = _parts(tree)
        return model.Domain(str(name), self._domain_expression(expression), self._span(name), self._span(tree))

    def _attribute(self, tree: _Node) -> model.Attribute:
        name, parameters, *items = _parts(tree)
        by_rule: dict[str, list[_Node]] = {"parameter_domain": [], "value_domain": [], "default": []}
        for item in items:
            if item is not None:
                by_rule[item.data].append(item)
        for doubled in by_rule["value_domain"][1:] + by_rule["default"][1:]:
            self._reporter.error("C0203", "expected it once in a declaration, got it twice", self._span(doubled))
        values, defaults = by_rule["value_domain"], by_rule["default"]
        return model.Attribute(
            str(name),
            self._parameters(parameters),
            tuple(map(self._parameter_domain, by_rule["parameter_domain"])),
            self._domain_expression(_parts(values[0])[0]) if values else None,
            self._literal(_parts(defaults[0])[0]) if defaults else None,
            self._span(name),
            self._span(tree),
        )

    def _message(self, tree: _Node) -> model.Message:
        name, parameters, *items = _parts(tree)
        domains = tuple(self._parameter_domain(item) for item in items if item is not None)
        return model.Message(str(name), self._parameters(parameters), domains, self._span(name), self._span(tree))

    def _chronicle(self, tree: _Node) -> model.Chronicle:
        name, parameters, points, *rest = _parts(tree)
        bodies = [child for child in rest if child is not None]
        reactions = [child for child in bodies if child.data == "reaction"]
        return model.Chronicle(
            str(name),
            self._parameters(parameters) if parameters is not None else (),
            tuple(map(self._point, _parts(points))) if points is not None else (),
            tuple(self._statement(child) for child in bodies if child.data != "reaction"),
            tuple(self._action(child) for reaction in reactions for child in _parts(reaction)),
            self._span(name),
            self._span(tree),
        )

    def _parameters(self, tree: _Node) -> tuple[model.Variable, ...]:
        return tuple(self._variable(token) for token in _parts(tree) if token is not None)

    def _parameter_domain(self, tree: _Node) -> model.ParameterDomain:
        variable, domain = _parts(tree)
        return model.ParameterDomain(self._variable(variable), self._domain_expression(domain), self._span(tree))

    # ---- domains

    def _domain_expression(self, tree: _Node) -> model.DomainExpression:
        span, children = self._span(tree), _parts(tree)
        match tree.data:
            case "domain_values":
                return model.DomainValues(tuple(map(self._literal, children)), span)
            case "domain_range":
                return model.DomainRange(self._integer(children[0]), self._integer(children[2]), span)
            case "domain_symbol":
                return model.DomainSymbol(span)
            case "domain_name":
                return model.DomainName(str(children[0]), span)
            case _:
                left, right = map(self._domain_expression, children)
                return model.DomainOperation(left, "|" if tree.data == "union" else "~", right, span)

    # ---- statements

    def _statement(self, tree: _Node) -> model.Statement:
        builders: dict[str, Callable[[_Node], model.Statement]] = {
            "event": self._event,
            "noevent": self._noevent,
            "occurs": self._occurs,
            "hold": self._hold,
            "assertion": self._assertion,
            "comparison": self._comparison,
            "range": self._range,
            "chain_range": self._chain_range,
            "equal": self._equality,
            "different": self._equality,
            "membership": self._membership,
            "allowance": self._allowance,
        }
        return builders[tree.data](tree)

    def _event(self, tree: _Node) -> model.EventStatement:
        pattern, point = _parts(tree)
        return model.EventStatement(self._pattern(pattern), self._point(point), self._span(tree))

    def _noevent(self, tree: _Node) -> model.NoEventStatement:
        pattern, interval = _parts(tree)
        return model.NoEventStatement(self._pattern(pattern), self._interval(interval), self._span(tree))

    def _occurs(self, tree: _Node) -> model.OccursStatement:
        count, pattern, interval = _parts(tree)
        least, most = _parts(count)
        return model.OccursStatement(
            self._whole(least),
            None if most.type == "INFINITE" else self._whole(most),
            self._pattern(pattern),
            self._interval(interval),
            self._span(tree),
        )

    def _hold(self, tree: _Node) -> model.HoldStatement:
        fluent, interval = _parts(tree)
        return model.HoldStatement(self._fluent(fluent), self._interval(interval), self._span(tree))

    def _assertion(self, tree: _Node) -> model.AssertStatement:
        fluent, interval = _parts(tree)
        return model.AssertStatement(self._fluent(fluent), self._interval(interval), self._span(tree))

    def _comparison(self, tree: _Node) -> model.Comparison:
        left, comparator, right, offset = _parts(tree)
        sign = cast(model.Comparator, str(_parts(comparator)[0]))
        return model.Comparison(self._point(left), sign, self._point(right), self._offset(offset), self._span(tree))

    def _range(self, tree: _Node) -> model.Range:
        later, _, earlier, opening, low, high, closing = _parts(tree)
        return model.Range(
            self._point(later),
            self._point(earlier),
            self._bound(low),
            str(_parts(opening)[0]) == "]",
            self._bound(high),
            str(_parts(closing)[0]) == "[",
            False,
            self._span(tree),
        )

    def _chain_range(self, tree: _Node) -> model.Range:
        low, low_chain, later, _, earlier, high_chain, high = _parts(tree)
        return model.Range(
            self._point(later),
            self._point(earlier),
            self._bound(low),
            str(_parts(low_chain)[0]) == "<",
            self._bound(high),
            str(_parts(high_chain)[0]) == "<",
            True,
            self._span(tree),
        )

    def _equality(self, tree: _Node) -> model.Equality:
        variable, _, term = _parts(tree)
        return model.Equality(self._variable(variable), tree.data == "equal", self._term(term), self._span(tree))

    def _membership(self, tree: _Node) -> model.Membership:
        variable, domain = _parts(tree)
        return model.Membership(self._variable(variable), self._domain_expression(domain), self._span(tree))

    def _allowance(self, tree: _Node) -> model.Allowance:
        left, _, right = _parts(tree)
        return model.Allowance(self._variable(left), self._variable(right), self._span(tree))

    # ---- actions

    def _action(self, tree: _Node) -> model.Action:
        span = self._span(tree)
        if tree.data == "report":
            return model.Report(self._unquoted(_parts(tree)[0]), span)
        if tree.data == "assert_action":
            return model.AssertAction(self._fluent(_parts(tree)[0]), self._time(_parts(tree)[1]), span)
        pattern, time = _parts(tree)
        return model.Emit(self._pattern(pattern), None if time is None else self._time(time), span)

    # ---- parts of statements

    def _pattern(self, tree: _Node) -> model.Pattern:
        name, arguments, old, new = _parts(tree)
        change = None if old is None else (self._term(old), self._term(new))
        return model.Pattern(str(name), self._arguments(arguments), change, self._span(name), self._span(tree))

    def _fluent(self, tree: _Node) -> model.Fluent:
        name, arguments, value = _parts(tree)
        return model.Fluent(
            str(name), self._arguments(arguments), self._term(value), self._span(name), self._span(tree)
        )

    def _arguments(self, tree: _Node | None) -> tuple[model.Term, ...]:
        if tree is None:
            return ()
        return tuple(self._term(child) for child in _parts(tree) if child is not None)

    def _term(self, tree: _Node) -> model.Term:
        if tree.data == "variable":
            return self._variable(_parts(tree)[0])
        return model.Anything(self._span(tree)) if tree.data == "anything" else self._literal(tree)

    def _variable(self, token: Token) -> model.Variable:
        return model.Variable(str(token)[1:], self._span(token))

    def _literal(self, tree: _Node) -> model.Literal:
        token = _parts(tree)[-1]
        quoted = token.type == "STRING"
        text = self._unquoted(token) if quoted else "".join(map(str, _parts(tree)))
        return model.Literal(text, quoted, self._span(tree))

    def _unquoted(self, token: Token) -> str:
        return re.sub(r"\\(.)", r"\1", str(token)[1:-1])

    def _point(self, token: Token) -> model.TimePoint:
        return model.TimePoint(str(token), self._span(token))

    def _interval(self, tree: _Node) -> model.Interval:
        start, end = map(self._time, _parts(tree))
        return model.Interval(start, end, self._span(tree))

    def _time(self, tree: _Node) -> model.TimeExpression:
        point, offset = _parts(tree)
        return model.TimeExpression(self._point(point), self._offset(offset), self._span(tree))

    def _offset(self, tree: _Node | None) -> model.Bound | None:
        return None if tree is None else self._bound(tree)

    def _bound(self, tree: _Node) -> model.Bound:
        sign, length = _parts(tree)
        negative = sign is not None and str(_parts(sign)[0]) == "-"
        span = self._span(tree)
        if isinstance(length, Token):
            named = length.type == "NAME"
            return model.Bound(negative, model.Duration(0, str(length), self._span(length)) if named else None, span)
        token = _parts(length)[0]
        us = self._microseconds(token, self._unit_us or 1)
        return model.Bound(negative, model.Duration(us, "", self._span(token)), span)

    # ---- numbers

    def _microseconds(self, token: Token, bare_us: int) -> int:
        digits, unit = cast(re.Match[str], _DURATION.fullmatch(str(token))).groups()
        if unit and unit not in _US_PER_UNIT:
            hint = suggest(unit, TIME_UNITS)
            self._reporter.error("C0104", f"expected a unit of time, got {unit!r}", self._span(token), hint)
            return 0
        us = Fraction(digits) * (_US_PER_UNIT[unit] if unit else bare_us)
        if us.denominator != 1 or us > _LARGEST_US:
            wanted = "a whole number of microseconds" if us.denominator != 1 else "at most 35 years"
            self._reporter.error("C0105", f"expected {wanted}, got {str(token)!r}", self._span(token))
            return 0
        return int(us)

    def _integer(self, tree: _Node) -> int:
        sign, digits = _parts(tree)
        return self._whole(digits) * (1 if sign is None else -1)

    def _whole(self, token: Token) -> int:
        if not str(token).isdigit():
            self._reporter.error("C0105", f"expected a whole number, got {str(token)!r}", self._span(token))
            return 0
        return int(str(token))

    def _span(self, part: Token | _Node) -> Span:
        place: Any = part if isinstance(part, Token) else part.meta  # Any: both have the same place attributes
        if isinstance(part, Tree) and part.meta.empty:
            return Span(self._file, 1, 1, 1, 2)
        return Span(self._file, place.line, place.column, place.end_line, place.end_column)
