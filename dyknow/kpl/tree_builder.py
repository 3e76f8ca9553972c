"""How does the tree of a statement become a value of the model? Shape by shape; only durations can be wrong here."""

from __future__ import annotations

from decimal import Decimal
from typing import Any  # lark leaves the children of a tree untyped

from lark import Token, Tree

from dyknow.kpl import model
from dyknow.kpl.findings import shown
from dyknow.kpl.model import Constraint, ConstraintKind
from dyknow.language.diagnostics import Reporter, Span
from dyknow.language.durations import LARGEST_US, US_PER_UNIT, to_us
from dyknow.streams.mediation import MediationKind

_Node = Tree[Any]
_DEEPEST = 20
_MOST_DIGITS = 25  # decimals are exact up to 28
_WRONG = -1  # microseconds of a duration that was reported; none is negative


def span_of(part: _Node | Token) -> Span:
    """Give the place of a word or a tree."""
    at = part.meta if isinstance(part, Tree) else part
    line, column = at.line or 1, at.column or 1
    return Span(line, column, at.end_line or line, at.end_column or column + 1)


class TreeBuilder:
    """Builds the statements of one text; reports durations that are none."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter

    def statement(self, tree: _Node) -> model.Statement:  # noqa: PLR0911 - one form each
        """Build one statement from its tree."""
        [inner] = tree.children
        parts: list[Any] = inner.children  # Any: words, trees, and None for what may be left out
        match inner.data:
            case "sort":
                return model.SortDeclaration(_name(parts[0]), self.type(parts[1]) if parts[1] else None)
            case "object":
                return model.ObjectDeclaration(_name(parts[0]), _names(parts[1:]))
            case "feature":
                return model.FeatureDeclaration(self.type(parts[0]), _name(parts[1]), _names(parts[2:]))
            case "source":
                return model.SourceDeclaration(self.type(parts[0]), _name(parts[1]))
            case "compunit":
                return model.UnitDeclaration(self.type(parts[0]), _name(parts[1]), tuple(map(self.type, parts[2:])))
            case "configuration":
                return model.ConfigurationDeclaration(_name(parts[0]), self.type(parts[1]))
            case "strmgen":
                return self._process(_label(parts[0]), parts[1], parts[2:])
            case "configure":
                label = model.Label(_name(parts[0]), (), span_of(parts[0]))
                return model.ConfigureDeclaration(label, _name(parts[1]), self._term(parts[2]))
            case _:
                return model.StreamDeclaration(_name(parts[0]), self._term(parts[1]))

    def constraints(self, policy: _Node) -> tuple[Constraint, ...]:
        """Build the constraints of a policy in their order, none if one is wrong; `from a to b` becomes two."""
        parts = [part for part in policy.children if isinstance(part, Tree)]  # not the commas
        constraints = [constraint for part in parts for constraint in self._constraint(part)]
        return () if _WRONG in (constraint.us for constraint in constraints) else tuple(constraints)

    def type(self, tree: _Node, depth: int = 0) -> model.Type:
        """Build a type from its tree; ``depth`` counts the types around it."""
        parts: list[Any] = tree.children
        if depth > _DEEPEST:
            message = f"expected at most {_DEEPEST} types inside each other, got more"
            self._reporter.error("K0106", message, span_of(tree), "name the inner ones by 'sort'")
            return model.TupleType(())
        match tree.data:
            case "tuple":
                return model.TupleType(tuple(self.type(part, depth + 1) for part in parts))
            case "set":
                return model.SetType(self.type(parts[0], depth + 1))
            case "collected":
                return model.CollectedType(self.type(parts[0], depth + 1))
            case _:
                return model.NamedType(_name(parts[0]))

    def _process(self, label: model.Label, made_of: _Node | Token, inputs: list[_Node | None]) -> model.Producer:
        if isinstance(made_of, Token):
            return model.GeneratorDeclaration(label, _name(made_of), tuple(self._term(one) for one in inputs if one))
        type_, policy, control = made_of.children
        kind = MediationKind(made_of.data)
        constraints = self.constraints(policy) if policy else ()
        return model.MediationDeclaration(label, kind, self.type(type_), constraints, model.Term(_label(control)))

    def _term(self, tree: _Node) -> model.Term:
        label, policy = tree.children
        return model.Term(_label(label), self.constraints(policy) if policy else ())

    def _constraint(self, tree: _Node) -> list[Constraint]:
        kind = ConstraintKind(tree.data.replace("_", " "))
        values = [self._microseconds(part) for part in tree.children if part]
        span = span_of(tree)
        if kind is ConstraintKind.FROM and len(values) > 1:
            return [Constraint(kind, values[0], span), Constraint(ConstraintKind.TO, values[1], span)]
        return [Constraint(kind, values[0] if values else None, span)]

    def _microseconds(self, part: _Node | Token) -> int | None:
        if isinstance(part, Token):  # now, oo
            return None
        word: Any = part.children[0]
        unit = word.lstrip("0123456789. \t")
        digits = word.removesuffix(unit).strip()
        amount = Decimal(digits if len(digits) <= _MOST_DIGITS else "Infinity")
        if not unit and amount:
            hint = "units are " + ", ".join(US_PER_UNIT)
            self._reporter.error(
                "K0104", f"expected a duration with a unit, got {shown(str(word))}", span_of(word), hint
            )
            return _WRONG
        us = to_us(amount, unit or "us") if amount.is_finite() else None
        if us is None or us > LARGEST_US:
            message = f"expected a whole number of microseconds up to 35 years, got {shown(str(word))}"
            self._reporter.error("K0105", message, span_of(word))
            return _WRONG
        return us


def _name(word: Token) -> model.Name:
    return model.Name(str(word), span_of(word))


def _names(words: list[Token | None]) -> tuple[model.Name, ...]:
    return tuple(_name(word) for word in words if word)


def _label(tree: _Node) -> model.Label:
    words: list[Any] = tree.children
    name, *arguments = words
    return model.Label(_name(name), _names(arguments), span_of(tree))
