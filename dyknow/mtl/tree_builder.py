"""How does a parse tree become a formula, and does the formula mean something?

One short method per rule of `formula.lark`. What the grammar cannot say is checked here, where the places are known:
variables bound once, windows in order, durations in whole microseconds, names and numbers of arguments as declared, and
by `kind_checks` that what is compared goes together.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any, cast  # Any: lark leaves the children of a tree untyped

from lark import Token

from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import LARGEST_US, US_PER_UNIT, format_duration, to_us
from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier, Term
from dyknow.mtl.kind_checks import KindChecker, suggest_name
from dyknow.mtl.nesting import MOST_CHANGES, window_changes
from dyknow.mtl.places import Node, operands, span_of
from dyknow.mtl.signature import Signature
from dyknow.mtl.structure import free_variables

Scope = Mapping[str, "str | None"]
_QUANTITY = re.compile(r"([0-9.]+)[ \t]*(.*)")


def check_nesting(formula: Formula, tree: Node, reporter: Reporter) -> None:
    """Refuse windows that change between always and eventually too often: nobody could pay for their progression."""
    found = window_changes(formula)
    if found > MOST_CHANGES:
        message = f"expected windows that are always and eventually in turn at most {MOST_CHANGES} deep, got {found}"
        hint = "make the inner part a feature or a monitor of its own; tolerate counts twice"
        reporter.error("F0105", message, span_of(tree), hint)


class TreeBuilder:
    """Builds the formulas of one text; remembers the names of its monitors."""

    def __init__(self, reporter: Reporter, signature: Signature | None) -> None:
        self._reporter = reporter
        self._signature = signature
        self._kinds = KindChecker(reporter, signature if signature is not None else Signature({}))
        self._monitors: set[str] = set()
        self._builders: dict[str, Callable[[list[Any], Scope], Formula]] = {
            "true": lambda _parts, _scope: model.Truth(True),
            "false": lambda _parts, _scope: model.Truth(False),
            "proposition": self._proposition,
            "negation": lambda parts, scope: model.Not(self.formula(parts[0], scope)),
            "conjunction": lambda parts, scope: model.And(self._formulas(parts, scope)),
            "disjunction": lambda parts, scope: model.Or(self._formulas(parts, scope)),
            "implies": lambda parts, scope: model.Implies(*self._formulas(operands(parts), scope)),
            "iff": lambda parts, scope: model.Iff(*self._formulas(operands(parts), scope)),
            "always": lambda parts, scope: model.Always(self.formula(parts[1], scope), self._window(parts[0])),
            "eventually": lambda parts, scope: model.Eventually(self.formula(parts[1], scope), self._window(parts[0])),
            "next": lambda parts, scope: model.Next(self.formula(parts[0], scope)),
            "until": self._until,
            "tolerate": self._tolerate,
            "quantified": self._quantified,
        }

    def monitor(self, tree: Node) -> model.Monitor | None:
        """Build a monitor from the tree of rule `monitor`; None if its subjects are no variables of its formula."""
        name, subjects, body = tree.children
        if str(name) in self._monitors:
            self._reporter.error("F0206", f"expected a new name of a monitor, got {str(name)!r} again", span_of(name))
        self._monitors.add(str(name))
        parts = subjects.children if subjects is not None else []
        scope: dict[str, str | None] = {}
        for part in parts:
            self._check_sort(part.children[-1])
            if part.data == "subject":
                self._bind(part.children[0], scope, str(part.children[1]))
        unnamed = [part for part in parts if part.data == "sort"]
        if not unnamed:
            formula = self.formula(body, scope)
            check_nesting(formula, body, self._reporter)
            found = (model.Subject(model.Variable(name), str(sort)) for name, sort in scope.items())
            return model.Monitor(str(name), tuple(found), formula)
        return self._monitor_per_sort(str(name), parts, body)

    def formula(self, tree: Node, scope: Scope) -> Formula:
        """Build a formula in which the variables of `scope` are bound."""
        if tree.data == "comparison":
            return self._comparison(tree, scope)
        return self._builders[tree.data](tree.children, scope)

    # ---- monitors

    def _monitor_per_sort(self, name: str, parts: list[Node], body: Node) -> model.Monitor | None:
        """``per Car`` means the one variable that the formula leaves free."""
        sort = parts[0].children[0]
        if len(parts) > 1:
            hint = "write per ?a in Car, ?b in Car"
            message = f"expected variables for several sorts, got {str(sort)!r}"
            self._reporter.error("F0207", message, span_of(sort), hint)
            return None
        every = dict.fromkeys((str(word)[1:] for word in body.scan_values(_is_variable)), None)
        formula = self.formula(body, _Lenient(every))
        check_nesting(formula, body, self._reporter)
        free = free_variables(formula)
        if len(free) != 1:
            came = " and ".join("?" + one for one in free) or "none"
            hint = f"write per ?x in {sort}"
            message = f"expected one variable without a quantifier for {str(sort)!r}, got {came}"
            self._reporter.error("F0207", message, span_of(sort), hint)
            return None
        return model.Monitor(name, (model.Subject(model.Variable(free[0]), str(sort)),), formula)

    # ---- formulas

    def _formulas(self, parts: list[Any], scope: Scope) -> tuple[Formula, ...]:
        return tuple(self.formula(part, scope) for part in parts)

    def _until(self, parts: list[Any], scope: Scope) -> Formula:
        left, window, right = parts
        return model.Until(self.formula(left, scope), self.formula(right, scope), self._window(window))

    def _tolerate(self, parts: list[Any], scope: Scope) -> Formula:
        body, returns, stays = parts
        return model.Tolerate(self.formula(body, scope), self._duration(returns), self._duration(stays))

    def _quantified(self, parts: list[Any], scope: Scope) -> Formula:
        some = isinstance(parts[0], Token)
        *bindings, body = parts[1:] if some else parts
        inner = dict(scope) if not isinstance(scope, _Lenient) else _Lenient(scope)
        for binding in bindings:
            variable, sort = binding.children
            self._check_sort(sort)
            self._bind(variable, inner, str(sort))
        formula = self.formula(body, inner)
        quantifier = Quantifier.EXISTS if some else Quantifier.FORALL
        for binding in reversed(bindings):
            variable, sort = binding.children
            formula = model.Quantified(quantifier, model.Variable(str(variable)[1:]), str(sort), formula)
        return formula

    def _proposition(self, parts: list[Any], scope: Scope) -> Formula:
        feature = self._feature(parts[0], scope)
        self._kinds.check_proposition(feature, parts[0])
        return model.Proposition(feature)

    def _comparison(self, tree: Node, scope: Scope) -> Formula:
        left, comparator, right = tree.children
        sign = cast(model.Comparator, str(comparator.children[0]))
        comparison = model.Comparison(self._term(left, scope), sign, self._term(right, scope))
        self._kinds.check_comparison(comparison, tree)
        return comparison

    # ---- terms

    def _term(self, tree: Node, scope: Scope) -> Term:
        parts = tree.children
        match tree.data:
            case "feature":
                return self._feature(tree, scope)
            case "variable":
                return self._variable(parts[0], scope)
            case "text":
                return model.Text(_unquoted(parts[0]))
            case "number":
                amount, unit = _quantity(parts[1])
                return model.Number(-amount if parts[0] is not None else amount, unit)
            case "scaled":
                return model.Scaled(Decimal(str(parts[0])), self._feature(parts[1], scope))
            case _:
                left, right = (self._term(part, scope) for part in operands(parts))
                assert not isinstance(right, model.Sum)
                return model.Sum(left, "+" if tree.data == "sum" else "-", right)

    def _feature(self, tree: Node, scope: Scope) -> model.Feature:
        name, *rest = tree.children
        arguments = [part for part in rest if part is not None]
        self._check_feature(name, len(arguments))
        return model.Feature(str(name), tuple(self._argument(part, scope) for part in arguments))

    def _argument(self, tree: Node, scope: Scope) -> model.Argument:
        token = tree.children[0]
        if tree.data == "variable":
            return self._variable(token, scope)
        return model.Object(_unquoted(token) if token.type == "STRING" else str(token))

    def _variable(self, token: Token, scope: Scope) -> model.Variable:
        name = str(token)[1:]
        if name not in scope:
            hint = suggest_name(name, scope) or "bind it: forall ?x in Sort: ..."
            self._reporter.error("F0204", f"expected a bound variable, got {str(token)!r}", span_of(token), hint)
        return model.Variable(name)

    # ---- windows

    def _window(self, tree: Node | None) -> model.Window:
        if tree is None:
            return model.ALWAYS_OPEN
        start, end = tree.children
        start_us = self._duration(start)
        if isinstance(end, Token):
            return model.Window(start_us)
        end_us = self._duration(end)
        if end_us < start_us:
            expected = f"an end that is not before the start {format_duration(start_us)}"
            self._reporter.error("F0301", f"expected {expected}, got {format_duration(end_us)}", span_of(end))
        return model.Window(start_us, end_us)

    def _duration(self, tree: Node) -> int:
        token = tree.children[0]
        amount, unit = _quantity(token)
        if unit not in US_PER_UNIT and (unit or amount):
            came = f"got {str(token)!r}"
            hint = "minutes are written min" if unit == "m" else "units are " + ", ".join(US_PER_UNIT)
            self._reporter.error("F0302", f"expected a duration with a unit of time, {came}", span_of(token), hint)
            return 0
        us = to_us(amount, unit or "us")
        if us is None or us > LARGEST_US:
            expected = "a whole number of microseconds" if us is None else "a duration of at most 35 years"
            self._reporter.error("F0303", f"expected {expected}, got {str(token)!r}", span_of(token))
        return us or 0

    # ---- names

    def _bind(self, token: Token, scope: dict[str, str | None], sort: str) -> None:
        name = str(token)[1:]
        if name in scope and not (isinstance(scope, _Lenient) and scope[name] is None):
            hint = "variables in each other's reach need different names"
            self._reporter.error("F0205", f"expected a new variable, got {str(token)!r} again", span_of(token), hint)
        scope[name] = sort

    def _check_feature(self, token: Token, count: int) -> None:
        if self._signature is None:
            return
        name, known = str(token), self._signature.features
        if name not in known:
            hint = suggest_name(name, known)
            self._reporter.error("F0201", f"expected a known feature, got {name!r}", span_of(token), hint)
        elif known[name] != count:
            plural = "" if known[name] == 1 else "s"
            message = f"expected {known[name]} argument{plural} of {name!r}, got {count}"
            self._reporter.error("F0202", message, span_of(token))

    def _check_sort(self, token: Token) -> None:
        if self._signature is not None and str(token) not in self._signature.sorts:
            hint = suggest_name(str(token), self._signature.sorts)
            self._reporter.error("F0203", f"expected a known sort, got {str(token)!r}", span_of(token), hint)


class _Lenient(dict[str, "str | None"]):
    """A scope where any variable of the text may stay free, so that the free ones can be counted afterwards."""


def _is_variable(value: object) -> bool:
    return isinstance(value, Token) and value.type == "VARIABLE"


def _quantity(token: Token) -> tuple[Decimal, str]:
    found = _QUANTITY.fullmatch(str(token))
    assert found is not None
    return Decimal(found.group(1)), found.group(2)


def _unquoted(token: Token) -> str:
    return re.sub(r"\\(.)", r"\1", str(token)[1:-1])
