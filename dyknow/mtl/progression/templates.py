"""What must be asked in each state? A formula in the form that progression runs.

Negation is pushed down to what a single state decides, so that an operator either wants its body everywhere in a window
(universal) or somewhere (existential); `always` and `eventually` are release and until without a left side. Templates
speak of time relative to the state where they are asked. Equal templates made by one `TemplateMaker` are one object.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar, cast  # Any: templates and shapes

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier
from dyknow.mtl.progression.state_test import StateTest, state_test
from dyknow.mtl.structure import has_tense

_Made = TypeVar("_Made")
NEVER_US = 2**62  # "oo": later than every time stamp plus every window


@dataclass(frozen=True, slots=True, eq=False)
class Test:
    """What one state decides."""

    holds: StateTest


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """All of the parts, or at least one of them."""

    is_conjunction: bool
    parts: tuple[Template, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """An operator without its window.

    Existential: `body` in some state of the window and, if there is an `other`, that one in every state before.
    Universal, the dual: `body` in every state of the window up to and with the first where `other` holds.
    """

    is_universal: bool
    body: Template
    other: Template | None


@dataclass(frozen=True, slots=True, eq=False)
class Operator:
    """A shape in a window, microseconds from the state where it is asked, both ends in."""

    shape: Shape
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """The body in the next state; if there is none, the answer is not `is_strong`."""

    is_strong: bool
    body: Template


@dataclass(frozen=True, slots=True, eq=False)
class ForEach:
    """The body with each member of a sort bound to the next slot: all of them, or at least one."""

    is_universal: bool
    sort: str
    body: Template


Template: TypeAlias = Test | Joined | Operator | Following | ForEach


@dataclass(frozen=True, slots=True)
class Source:
    """What a template was made of: a formula, or its negation; `scope` names the variable of each slot."""

    formula: Formula
    scope: tuple[str, ...]
    is_negated: bool


def operands(template: Template) -> tuple[Template, ...]:
    """Give the templates directly inside a template."""
    match template:
        case Joined(parts=parts):
            return parts
        case Operator(shape):
            return (shape.body,) if shape.other is None else (shape.body, shape.other)
        case Following(body=body) | ForEach(body=body):
            return (body,)
        case _:
            return ()


def every(template: Template) -> Iterator[Template]:
    """Give a template and all inside it, outer ones first, and each once: templates share what is inside them."""
    seen: dict[Template, None] = {}
    waiting = [template]
    while waiting:
        one = waiting.pop()
        if one not in seen:
            seen[one] = None
            yield one
            waiting += reversed(operands(one))


def size_of(template: Template) -> int:
    """Count the nodes of a template as a tree."""
    return _size_of(template, {})


def _size_of(template: Template, memo: dict[Template, int]) -> int:
    if template not in memo:
        memo[template] = 1 + sum(_size_of(part, memo) for part in operands(template))
    return memo[template]


class TemplateMaker:
    """Makes templates; invariant: equal ones are the same object, so that they can be compared by identity.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> maker = TemplateMaker()
    >>> always_p = parse_formula("always[0s, 1s] p"), parse_formula("not eventually[0s, 1s] not p")
    >>> maker.make(always_p[0], ()) is maker.make(always_p[1], ())
    True
    """

    def __init__(self) -> None:
        self._made: dict[tuple[object, ...], Any] = {}  # by type and parts
        self._of_formulas: dict[tuple[Formula, tuple[str, ...], bool], Template] = {}
        self._sources: dict[Template, Source] = {}

    def make(self, formula: Formula, variables: tuple[str, ...]) -> Template:
        """Make the template of a formula whose free variables have the slots 0, 1, ... in the given order."""
        return self._make(formula, variables, is_negated=False)

    def _make(self, formula: Formula, scope: tuple[str, ...], *, is_negated: bool) -> Template:
        # Remembered, since `iff` and `tolerate` speak of their parts more than once: inside each other they would
        # double the work with each level.
        key = (formula, scope, is_negated)
        found = self._of_formulas.get(key)
        if found is None:
            found = self._of_formulas[key] = self._made_of(formula, scope, is_negated=is_negated)
            # After what is inside was made: what `tolerate` or `implies` stands for is shown in its author's words.
            self._sources[found] = Source(formula, scope, is_negated)
        return found

    def source_of(self, template: Template) -> Source:
        """Give a formula that a template of this maker was made of, the last one if there were several."""
        return self._sources[template]

    def _made_of(self, formula: Formula, scope: tuple[str, ...], *, is_negated: bool) -> Template:  # noqa: PLR0911 - one case per kind
        if isinstance(formula, model.Not):
            return self._make(formula.body, scope, is_negated=not is_negated)
        if not has_tense(formula):
            return self._test(formula, scope, is_negated=is_negated)
        match formula:
            case model.And(parts) | model.Or(parts):
                made = tuple(self._make(part, scope, is_negated=is_negated) for part in parts)
                return self._once(Joined, isinstance(formula, model.And) is not is_negated, made)
            case model.Implies(left, right):
                return self._make(model.Or((model.Not(left), right)), scope, is_negated=is_negated)
            case model.Iff(left, right):
                both = model.And((left, right))
                neither = model.And((model.Not(left), model.Not(right)))
                return self._make(model.Or((both, neither)), scope, is_negated=is_negated)
            case model.Tolerate():
                return self._make(formula.meaning, scope, is_negated=is_negated)
            case model.Quantified(quantifier, variable, sort, body):
                made_body = self._make(body, (*scope, variable.name), is_negated=is_negated)
                is_universal = (quantifier is Quantifier.FORALL) is not is_negated
                return self._once(ForEach, is_universal, sort, made_body)
            case model.Next(body):
                made_body = self._make(body, scope, is_negated=is_negated)
                return self._once(Following, not is_negated, made_body)
            case model.Always(body, window):
                return self._operator(not is_negated, self._make(body, scope, is_negated=is_negated), None, window)
            case model.Eventually(body, window):
                return self._operator(is_negated, self._make(body, scope, is_negated=is_negated), None, window)
            case model.Until(left, right, window):
                other = self._make(left, scope, is_negated=is_negated)
                return self._operator(is_negated, self._make(right, scope, is_negated=is_negated), other, window)
        raise AssertionError(f"expected a formula, got {formula!r}")

    def _operator(self, is_universal: bool, body: Template, other: Template | None, window: model.Window) -> Operator:
        shape = self._once(Shape, is_universal, body, other)
        return self._once(Operator, shape, window.start_us, NEVER_US if window.end_us is None else window.end_us)

    def _test(self, formula: Formula, scope: tuple[str, ...], *, is_negated: bool) -> Template:
        key = (Test, formula, scope, is_negated)
        found = self._made.get(key)
        if found is None:
            asked = model.Not(formula) if is_negated else formula
            found = self._made[key] = Test(state_test(asked, {name: slot for slot, name in enumerate(scope)}))
        return cast(Test, found)

    def _once(self, kind: Callable[..., _Made], *parts: object) -> _Made:
        key = (kind, *parts)
        if key not in self._made:
            self._made[key] = kind(*parts)
        return cast(_Made, self._made[key])
