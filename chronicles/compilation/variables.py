"""Which variables of a chronicle are the same, which must differ, and which values may they take?

Equal variables (`?x == ?y`) form one class, named by its first member; a class may be a constant. Two variables that
stand in fields of one sort differ unless `allow ?x == ?y` or `?x == ?y` says otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from chronicles.compilation.domains import ANY_VALUE, ValueSet, one_of
from chronicles.compilation.patterns import Cell, Cells
from chronicles.compilation.symbols import UNKNOWN, Symbols, domain_of
from chronicles.compilation.usage import warn_single_uses
from chronicles.language import model
from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.places import Span

_NO_ANYTHING = "leave the constraint out: everything fits '?'"


@dataclass(frozen=True, slots=True)
class Variables:
    """The classes of a chronicle's variables.

    `class_of` maps each variable to its class, `constants` a class to its value, `allowed` a class to its values;
    `different` holds sorted pairs of classes that must differ; where a class with a constant is bound, the constant is
    excluded from the values of the other class instead. `bound` are the classes that events or holds give values to;
    the others live inside a `noevent` or `occurs`.
    """

    class_of: Mapping[str, str]
    constants: Mapping[str, str]
    allowed: Mapping[str, ValueSet]
    different: frozenset[tuple[str, str]]
    bound: frozenset[str]

    def is_fixed(self, name: str) -> bool:
        """Say whether a class is nothing but a constant everywhere."""
        return name in self.constants and name in self.bound

    def content(self, cell: Cell) -> tuple[str, str]:
        """Say what a field holds: ("constant", text), ("variable", class) or ("anything", "")."""
        if not cell.variable:
            return ("anything", "") if cell.constant is None else ("constant", cell.constant)
        name = self.class_of[cell.variable]
        return ("constant", self.constants[name]) if name in self.constants else ("variable", name)

    def must_differ(self, left: str, right: str) -> bool:
        """Say whether two classes must have different values."""
        return (min(left, right), max(left, right)) in self.different


@dataclass(frozen=True, slots=True)
class _Constraints:
    equal: tuple[model.Equality, ...]
    different: tuple[model.Equality, ...]
    member: tuple[model.Membership, ...]
    allowances: tuple[model.Allowance, ...]


def resolve_variables(
    chronicle: model.Chronicle,
    binding: Iterable[Cells],
    testing: Iterable[Cells],
    symbols: Symbols,
    reporter: Reporter,
) -> Variables:
    """Work out the classes of a chronicle's variables; contradictions go to the reporter.

    Parameters
    ----------
    chronicle : its constraints on values are read.
    binding : the fields of its events and holds, which give variables their values.
    testing : the fields of its noevents, occurs and asserts, which give none.
    symbols : the name space, for constants and domains.
    reporter : receives what is wrong.
    """
    binding = list(binding)
    flat = [cell for group in [*binding, *testing] for cell in group.all if cell.variable]
    constraints = _constraints(chronicle)
    names = sorted({cell.variable for cell in flat})
    _check_known(constraints, names, reporter)
    class_of = _classes(names, constraints)
    constants = _constants(constraints, class_of, symbols, reporter)
    sorts = _sorts(flat, class_of, reporter)
    pairs = _different_pairs(constraints, class_of, sorts, reporter)
    declared = _declared(constraints, flat, class_of)
    allowed = _allowed(constraints, class_of, declared, symbols, reporter)
    bound = frozenset(class_of[cell.variable] for group in binding for cell in group.all if cell.variable)
    if not reporter.has_error_in(chronicle.span):
        warn_single_uses(chronicle, flat, {name for pair in pairs for name in pair}, reporter)
    classes = Variables(class_of, constants, allowed, frozenset(pairs), bound)
    return _without_constants(classes, declared, chronicle.name_span, reporter)


def _constraints(chronicle: model.Chronicle) -> _Constraints:
    equalities = [one for one in chronicle.statements if isinstance(one, model.Equality)]
    return _Constraints(
        tuple(one for one in equalities if one.equal),
        tuple(one for one in equalities if not one.equal),
        tuple(one for one in chronicle.statements if isinstance(one, model.Membership)),
        tuple(one for one in chronicle.statements if isinstance(one, model.Allowance)),
    )


def _check_known(constraints: _Constraints, names: list[str], reporter: Reporter) -> None:
    mentioned = [one.variable for one in constraints.equal + constraints.different]
    mentioned += [one.variable for one in constraints.member]
    mentioned += [one.term for one in constraints.equal + constraints.different if isinstance(one.term, model.Variable)]
    mentioned += [variable for one in constraints.allowances for variable in (one.left, one.right)]
    for variable in mentioned:
        if variable.name not in names:
            message = f"expected a variable that stands in an event, a noevent or a hold, got ?{variable.name}"
            reporter.error(
                "C0803", message, variable.span, suggest(f"?{variable.name}", [f"?{name}" for name in names])
            )


def _classes(names: Iterable[str], constraints: _Constraints) -> dict[str, str]:
    class_of = {name: name for name in names}
    for one in constraints.equal:
        if isinstance(one.term, model.Variable) and {one.variable.name, one.term.name} <= class_of.keys():
            joined = sorted((class_of[one.variable.name], class_of[one.term.name]))
            class_of = {name: joined[0] if root == joined[1] else root for name, root in class_of.items()}
    return class_of


def _constants(
    constraints: _Constraints, class_of: Mapping[str, str], symbols: Symbols, reporter: Reporter
) -> dict[str, str]:
    constants: dict[str, str] = {}
    places: dict[str, Span] = {}
    for one in constraints.equal:
        if isinstance(one.term, model.Anything):
            reporter.error("C0803", "expected a variable or a value after '==', got '?'", one.term.span, _NO_ANYTHING)
        if not isinstance(one.term, model.Literal) or one.variable.name not in class_of:
            continue
        text = symbols.value_of(one.term, reporter)
        name = class_of[one.variable.name]
        first, place = constants.setdefault(name, text), places.setdefault(name, one.span)
        if first != text:
            message = f"expected one value for ?{one.variable.name}, got {first!r} and {text!r}"
            reporter.error("C0307", message, one.span, "keep one of them", related=[(place, f"{first!r} here")])
    return constants


def _sorts(cells: Iterable[Cell], class_of: Mapping[str, str], reporter: Reporter) -> dict[str, set[str]]:
    """Give the sorts of each class; a class no value can satisfy is an error."""
    sorts: dict[str, set[str]] = {name: set() for name in class_of.values()}
    seen: dict[str, Cell] = {}
    for cell in cells:
        name = class_of[cell.variable]
        if cell.field.sort:
            first = seen.setdefault(name, cell)
            _check_sorts(first, cell, reporter)
            sorts[name].add(cell.field.sort)
    return {name: found or {""} for name, found in sorts.items()}


def _declared(constraints: _Constraints, cells: Iterable[Cell], class_of: Mapping[str, str]) -> dict[str, ValueSet]:
    """Give the values that the declarations leave to each class with a constraint; `unknown` is always one."""
    limited = [one.variable.name for one in constraints.equal + constraints.different]
    limited += [one.variable.name for one in constraints.member]
    names = {class_of.get(name) for name in limited}
    declared = dict.fromkeys(class_of.values(), ANY_VALUE)
    for cell in cells:
        name = class_of[cell.variable]
        if name in names:
            declared[name] = declared[name].intersection(cell.field.values.union(one_of(UNKNOWN)))
    return declared


def _check_sorts(first: Cell, cell: Cell, reporter: Reporter) -> None:
    """Two named domains without listed values are different kinds of things; listed values must meet."""
    both_open = first.field.values.complement and cell.field.values.complement
    disjoint = first.field.values.intersection(cell.field.values).is_empty
    if first.field.sort != cell.field.sort and (both_open or disjoint):
        message = f"expected ?{cell.variable} to be a {first.field.sort} as in line {first.span.line}"
        related = [(first.span, f"a {first.field.sort} here")]
        reporter.error("C0304", f"{message}, got a {cell.field.sort}", cell.span, "use two variables", related=related)


def _different_pairs(
    constraints: _Constraints, class_of: Mapping[str, str], sorts: Mapping[str, set[str]], reporter: Reporter
) -> set[tuple[str, str]]:
    classes = sorted(sorts)
    allowances = [
        {class_of[one.left.name], class_of[one.right.name]}
        for one in constraints.allowances
        if {one.left.name, one.right.name} <= class_of.keys()
    ]
    pairs = {
        (left, right)
        for index, left in enumerate(classes)
        for right in classes[index + 1 :]
        if sorts[left] & sorts[right] and {left, right} not in allowances
    }
    for one in constraints.different:
        if isinstance(one.term, model.Variable) and {one.variable.name, one.term.name} <= class_of.keys():
            left, right = sorted((class_of[one.variable.name], class_of[one.term.name]))
            if one.variable.name == one.term.name:
                message = f"expected two variables that can differ, got ?{one.term.name} twice"
                reporter.error("C0307", message, one.span, "name the other variable, or leave the constraint out")
            elif left == right:
                message = f"expected ?{one.variable.name} and ?{one.term.name} to differ, got them equal by '=='"
                reporter.error("C0307", message, one.span, "keep one of the two constraints")
            pairs.add((left, right))
    return pairs


def _allowed(
    constraints: _Constraints,
    class_of: Mapping[str, str],
    declared: Mapping[str, ValueSet],
    symbols: Symbols,
    reporter: Reporter,
) -> dict[str, ValueSet]:
    allowed = dict.fromkeys(class_of.values(), ANY_VALUE)

    def restrict(variable: model.Variable, values: ValueSet, span: Span) -> None:
        """Narrow what a variable may be; report when nothing is left."""
        if variable.name not in class_of:
            return
        left = allowed[class_of[variable.name]].intersection(values)
        allowed[class_of[variable.name]] = left
        if left.is_empty:
            reporter.error(
                "C0307",
                f"expected a value that ?{variable.name} can take, got constraints without any",
                span,
                "widen this one, or one before it",
            )
        elif left.intersection(declared[class_of[variable.name]]).is_empty:
            message = (
                f"expected a value that the declarations give to ?{variable.name}, got constraints that allow none"
            )
            known = sorted(declared[class_of[variable.name]].texts - {UNKNOWN})
            reporter.error("C0307", message, span, suggest("", known))

    for member in constraints.member:
        restrict(member.variable, domain_of(member.domain, symbols, reporter), member.span)
    for one in constraints.different:
        if isinstance(one.term, model.Literal):
            restrict(one.variable, one_of(symbols.value_of(one.term, reporter)).inverse(), one.span)
        elif isinstance(one.term, model.Anything):
            reporter.error("C0803", "expected a variable or a value after '!=', got '?'", one.term.span, _NO_ANYTHING)
    return allowed


def _without_constants(
    classes: Variables, declared: Mapping[str, ValueSet], place: Span, reporter: Reporter
) -> Variables:
    """Turn "differs from a constant class" into a filter, and check the constants themselves."""
    kept: set[tuple[str, str]] = set()
    constants, allowed = classes.constants, dict(classes.allowed)
    for left, right in sorted(classes.different):
        values = [constants[one] for one in (left, right) if classes.is_fixed(one)]
        if not values:
            kept.add((left, right))
        elif len(values) == 1:
            free = left if classes.is_fixed(right) else right
            allowed[free] = allowed[free].intersection(one_of(values[0]).inverse())
        elif values[0] == values[1]:
            message = f"expected ?{left} and ?{right} to differ, got {values[0]!r} for both"
            reporter.error("C0307", message, place, f"write `allow ?{left} == ?{right}`")
    for name, text in constants.items():
        if text not in allowed[name]:
            message = f"expected a value that ?{name} can take, got {text!r}"
            reporter.error("C0307", message, place, "the constraints on the variable rule this value out")
        elif text not in declared[name]:
            message = f"expected a value that the declarations give to ?{name}, got {text!r}"
            reporter.error(
                "C0307", message, place, suggest(text, sorted(declared[name].texts - {UNKNOWN}))._replace(edit=None)
            )
    return Variables(classes.class_of, constants, allowed, frozenset(kept), classes.bound)
