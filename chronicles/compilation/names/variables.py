"""Which variables of a chronicle are the same, which must differ, and which values may they take?

Equal variables (`?x == ?y`) form one class, named by its first member; a class may be a constant. Two variables that
stand in fields of one sort differ unless `allow ?x == ?y` or `?x == ?y` says otherwise.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from chronicles.compilation.names.domains import ANY_VALUE, ValueSet, one_of
from chronicles.compilation.names.patterns import Cell, Cells
from chronicles.compilation.names.symbols import UNKNOWN, Symbols, resolve_domain
from chronicles.compilation.names.usage import warn_single_uses
from chronicles.language import model
from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.places import Span


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


def resolve_variables(
    chronicle: model.Chronicle, binding: Sequence[Cells], testing: Sequence[Cells], symbols: Symbols, reporter: Reporter
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
    cells = [cell for group in (*binding, *testing) for cell in group.all if cell.variable]
    resolver = _Resolver(chronicle, cells, symbols, reporter)
    return resolver.variables({cell.variable for group in binding for cell in group.all if cell.variable})


class _Resolver:
    """Works out the classes of one chronicle; `cells` are the fields of its patterns that hold variables."""

    def __init__(self, chronicle: model.Chronicle, cells: Sequence[Cell], symbols: Symbols, reporter: Reporter) -> None:
        self._chronicle = chronicle
        self._cells = cells
        self._symbols = symbols
        self._reporter = reporter
        self._equal = [one for one in chronicle.of(model.Equality) if one.equal]
        self._different = [one for one in chronicle.of(model.Equality) if not one.equal]
        self._members = chronicle.of(model.Membership)
        self._allowances = chronicle.of(model.Allowance)
        self._class_of = {name: name for name in sorted({cell.variable for cell in cells})}
        for one in self._equal:
            kept, gone = self._pair(one.variable, one.term) or ("", "")
            self._class_of = {name: kept if root == gone else root for name, root in self._class_of.items()}

    def variables(self, bound: Collection[str]) -> Variables:
        """Give the classes; `bound` are the variables that events and holds give values to."""
        self._check_known()
        constants = self._constants()
        pairs = self._different_pairs(self._sorts())
        declared = self._declared()
        allowed = self._allowed(declared)
        if not self._reporter.has_error_in(self._chronicle.span):
            warn_single_uses(self._chronicle, self._cells, {name for pair in pairs for name in pair}, self._reporter)
        classes = frozenset(self._class_of[name] for name in bound)
        found = Variables(self._class_of, constants, allowed, frozenset(pairs), classes)
        return self._without_constants(found, declared)

    def _pair(self, left: model.Variable, right: model.Term) -> tuple[str, str] | None:
        """Give the classes of two variables, sorted; None where one is unknown, or a value."""
        if not isinstance(right, model.Variable) or not {left.name, right.name} <= self._class_of.keys():
            return None
        classes = self._class_of[left.name], self._class_of[right.name]
        return min(classes), max(classes)

    def _check_known(self) -> None:
        mentioned: list[model.Term] = [one.variable for one in self._members]
        mentioned += [term for one in (*self._equal, *self._different) for term in (one.variable, one.term)]
        mentioned += [variable for one in self._allowances for variable in (one.left, one.right)]
        for variable in mentioned:
            if isinstance(variable, model.Variable) and variable.name not in self._class_of:
                message = f"expected a variable that stands in an event, a noevent or a hold, got ?{variable.name}"
                near = suggest(f"?{variable.name}", [f"?{name}" for name in self._class_of])
                self._reporter.error("C0803", message, variable.span, near)

    def _constants(self) -> dict[str, str]:
        constants: dict[str, str] = {}
        places: dict[str, Span] = {}
        for one in self._equal:
            if isinstance(one.term, model.Anything):
                self._report_anything(one)
            if not isinstance(one.term, model.Literal) or one.variable.name not in self._class_of:
                continue
            text = self._symbols.value_of(one.term, self._reporter)
            name = self._class_of[one.variable.name]
            first, place = constants.setdefault(name, text), places.setdefault(name, one.span)
            if first != text:
                message = f"expected one value for ?{one.variable.name}, got {first!r} and {text!r}"
                related = [(place, f"{first!r} here")]
                self._reporter.error("C0307", message, one.span, "keep one of them", related=related)
        return constants

    def _report_anything(self, one: model.Equality) -> None:
        message = f"expected a variable or a value after '{'==' if one.equal else '!='}', got '?'"
        self._reporter.error("C0803", message, one.term.span, "leave the constraint out: everything fits '?'")

    def _sorts(self) -> dict[str, set[str]]:
        """Give the sorts of each class; a class no value can satisfy is an error."""
        sorts: dict[str, set[str]] = {name: set() for name in self._class_of.values()}
        seen: dict[str, Cell] = {}
        for cell in self._cells:
            name = self._class_of[cell.variable]
            if cell.field.sort:
                self._check_sorts(seen.setdefault(name, cell), cell)
                sorts[name].add(cell.field.sort)
        return {name: found or {""} for name, found in sorts.items()}

    def _check_sorts(self, first: Cell, cell: Cell) -> None:
        """Two named domains without listed values are different kinds of things; listed values must meet."""
        both_open = first.field.values.complement and cell.field.values.complement
        disjoint = first.field.values.intersection(cell.field.values).is_empty
        if first.field.sort != cell.field.sort and (both_open or disjoint):
            message = f"expected ?{cell.variable} to be a {first.field.sort} as in line {first.span.line}"
            message, related = f"{message}, got a {cell.field.sort}", [(first.span, f"a {first.field.sort} here")]
            self._reporter.error("C0304", message, cell.span, "use two variables", related=related)

    def _declared(self) -> dict[str, ValueSet]:
        """Give the values that the declarations leave to each class with a constraint; `unknown` is always one."""
        limited = {one.variable.name for one in self._members}
        limited |= {one.variable.name for one in (*self._equal, *self._different)}
        names = {self._class_of.get(name) for name in limited}
        declared = dict.fromkeys(self._class_of.values(), ANY_VALUE)
        for cell in self._cells:
            name = self._class_of[cell.variable]
            if name in names:
                declared[name] = declared[name].intersection(cell.field.values.union(one_of(UNKNOWN)))
        return declared

    def _different_pairs(self, sorts: Mapping[str, set[str]]) -> set[tuple[str, str]]:
        allowed = {self._pair(one.left, one.right) for one in self._allowances}
        alike = [(left, right) for left, right in combinations(sorted(sorts), 2) if sorts[left] & sorts[right]]
        pairs = {pair for pair in alike if pair not in allowed}
        for one in self._different:
            pair = self._pair(one.variable, one.term)
            if pair is None or not isinstance(one.term, model.Variable):
                continue
            if one.variable.name == one.term.name:
                message = f"expected two variables that can differ, got ?{one.term.name} twice"
                self._reporter.error("C0307", message, one.span, "name the other variable, or leave the constraint out")
            elif pair[0] == pair[1]:
                message = f"expected ?{one.variable.name} and ?{one.term.name} to differ, got them equal by '=='"
                self._reporter.error("C0307", message, one.span, "keep one of the two constraints")
            pairs.add(pair)
        return pairs

    def _allowed(self, declared: Mapping[str, ValueSet]) -> dict[str, ValueSet]:
        allowed = dict.fromkeys(self._class_of.values(), ANY_VALUE)

        def restrict(variable: model.Variable, values: ValueSet, span: Span) -> None:
            """Narrow what a variable may be; report when nothing is left."""
            if variable.name not in self._class_of:
                return
            name = self._class_of[variable.name]
            allowed[name] = allowed[name].intersection(values)
            if allowed[name].is_empty:
                message = f"expected a value that ?{variable.name} can take, got constraints without any"
                self._reporter.error("C0307", message, span, "widen this one, or one before it")
            elif allowed[name].intersection(declared[name]).is_empty:
                message = f"expected a value that the declarations give to ?{variable.name}"
                near = suggest("", sorted(declared[name].texts - {UNKNOWN}))
                self._reporter.error("C0307", f"{message}, got constraints that allow none", span, near)

        for member in self._members:
            values = resolve_domain(member.domain, self._symbols.domains, self._symbols, self._reporter)
            restrict(member.variable, values, member.span)
        for one in self._different:
            if isinstance(one.term, model.Literal):
                restrict(one.variable, one_of(self._symbols.value_of(one.term, self._reporter)).inverse(), one.span)
            elif isinstance(one.term, model.Anything):
                self._report_anything(one)
        return allowed

    def _without_constants(self, classes: Variables, declared: Mapping[str, ValueSet]) -> Variables:
        """Turn "differs from a constant class" into a filter, and check the constants themselves."""
        kept: set[tuple[str, str]] = set()
        allowed, place = dict(classes.allowed), self._chronicle.name_span
        for left, right in sorted(classes.different):
            values = [classes.constants[one] for one in (left, right) if classes.is_fixed(one)]
            if not values:
                kept.add((left, right))
            elif len(values) == 1:
                free = left if classes.is_fixed(right) else right
                allowed[free] = allowed[free].intersection(one_of(values[0]).inverse())
            elif values[0] == values[1]:
                message = f"expected ?{left} and ?{right} to differ, got {values[0]!r} for both"
                self._reporter.error("C0307", message, place, f"write `allow ?{left} == ?{right}`")
        for name, text in classes.constants.items():
            if text not in allowed[name]:
                message = f"expected a value that ?{name} can take, got {text!r}"
                self._reporter.error("C0307", message, place, "the constraints on the variable rule this value out")
            elif text not in declared[name]:
                message = f"expected a value that the declarations give to ?{name}, got {text!r}"
                near = suggest(text, sorted(declared[name].texts - {UNKNOWN}))
                self._reporter.error("C0307", message, place, near.text)
        return replace(classes, allowed=allowed, different=frozenset(kept))
