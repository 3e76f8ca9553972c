"""How does a parse tree become a formula, and does the formula mean something?

One short method per rule of `formula.lark`. What the grammar cannot say is checked here, where the places are known:
variables bound once, windows in order, durations in whole microseconds, names and numbers of arguments as declared, and
by `kinds.py` that what is compared goes together.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Any, cast  # Any: lark leaves the children of a tree untyped

from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.durations import LARGEST_US, US_PER_UNIT, format_duration, meant, split_quantity, to_us
from dyknow.language.places import Span
from dyknow.language.reading import Node
from dyknow.language.words import Source, Word
from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier, Term
from dyknow.mtl.kinds import KindChecker, Signature
from dyknow.mtl.structure import MOST_CHANGES, free_variables, window_changes

# Variables that are bound, by name: each with its sort, "" if none is said; None if it may stay free or be bound.
Scope = Mapping[str, "str | None"]


def check_nesting(formula: Formula, tree: Node, reporter: Reporter) -> None:
    """Refuse windows that change between always and eventually too often: nobody could pay for their progression."""
    found = window_changes(formula)
    if found > MOST_CHANGES:
        message = f"expected windows that are always and eventually in turn at most {MOST_CHANGES} deep, got {found}"
        hint = "make the inner part a feature or a monitor of its own; tolerate counts twice"
        reporter.error("F0105", message, tree.span, hint)


class TreeBuilder:
    """Builds the formulas of one text; remembers the names of its monitors."""

    def __init__(self, source: Source, signature: Signature | None) -> None:
        reporter = self._reporter = source.reporter
        self._file = source.file
        self._signature = signature
        self._kinds = KindChecker(reporter, signature if signature is not None else Signature({}))
        self._monitors: dict[str, Span] = {}
        self._bound: dict[str, Span] = {}  # where each variable was bound last
        self._builders: dict[str, Callable[[list[Any], Scope], Formula]] = {
            "true": lambda _parts, _scope: model.Truth(True),
            "false": lambda _parts, _scope: model.Truth(False),
            "proposition": self._proposition,
            "negation": lambda parts, scope: model.Not(self.formula(parts[0], scope)),
            "conjunction": lambda parts, scope: model.And(self._formulas(parts, scope)),
            "disjunction": lambda parts, scope: model.Or(self._formulas(parts, scope)),
            "implies": lambda parts, scope: model.Implies(*self._formulas(parts, scope)),
            "iff": lambda parts, scope: model.Iff(*self._formulas(parts, scope)),
            "always": lambda parts, scope: model.Always(self.formula(parts[1], scope), self._window(parts[0])),
            "eventually": lambda parts, scope: model.Eventually(self.formula(parts[1], scope), self._window(parts[0])),
            "next": lambda parts, scope: model.Next(self.formula(parts[0], scope)),
            "until": self._until,
            "tolerate": self._tolerate,
            "quantified": self._quantified,
        }

    def monitor(self, tree: Node) -> model.Monitor | None:
        """Build a monitor from the tree of rule `monitor`; None if its subjects are no variables of its formula."""
        name, subjects, body = tree.parts
        span = name.span(self._file)
        if name.text in self._monitors:
            message = f"expected a new name of a monitor, got {name.text!r} again"
            self._reporter.error("F0206", message, span, related=[(self._monitors[name.text], "the first")])
        self._monitors.setdefault(name.text, span)
        parts = subjects.parts if subjects is not None else []
        scope: dict[str, str | None] = {}
        for part in parts:
            self._check_sort(part.parts[-1])
            if part.rule == "subject":
                self._bind(part.parts[0], scope, part.parts[1].text)
        unnamed = [part for part in parts if part.rule == "sort"]
        if not unnamed:
            formula = self.formula(body, scope)
            check_nesting(formula, body, self._reporter)
            found = (model.Subject(model.Variable(one), str(sort)) for one, sort in scope.items())
            return model.Monitor(name.text, tuple(found), formula, span)
        return self._monitor_per_sort(name, parts, body)

    def formula(self, tree: Node, scope: Scope) -> Formula:
        """Build a formula in which the variables of `scope` are bound."""
        if tree.rule == "comparison":
            return self._comparison(tree, scope)
        return self._builders[tree.rule](tree.parts, scope)

    # ---- monitors

    def _monitor_per_sort(self, name: Word, parts: list[Node], body: Node) -> model.Monitor | None:
        """``per Car`` means the one variable that the formula leaves free."""
        sort = parts[0].parts[0]
        place = sort.span(self._file)
        if len(parts) > 1:
            hint = "write per ?a in Car, ?b in Car"
            message = f"expected variables for several sorts, got {sort.text!r}"
            self._reporter.error("F0207", message, place, hint)
            return None
        every = dict.fromkeys((name[1:] for name in _variables_in(body)), None)
        formula = self.formula(body, every)
        check_nesting(formula, body, self._reporter)
        free = free_variables(formula)
        if len(free) != 1:
            came = " and ".join("?" + one for one in free) or "none"
            hint = f"write per ?x in {sort.text}"
            message = f"expected one variable without a quantifier for {sort.text!r}, got {came}"
            self._reporter.error("F0207", message, place, hint)
            return None
        return model.Monitor(
            name.text, (model.Subject(model.Variable(free[0]), sort.text),), formula, name.span(self._file)
        )

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
        some = isinstance(parts[0], Word)
        *bindings, body = parts[1:] if some else parts
        inner = dict(scope)
        for binding in bindings:
            variable, sort = binding.parts
            self._check_sort(sort)
            self._bind(variable, inner, sort.text)
        formula = self.formula(body, inner)
        quantifier = Quantifier.EXISTS if some else Quantifier.FORALL
        for binding in reversed(bindings):
            variable, sort = binding.parts
            formula = model.Quantified(quantifier, model.Variable(variable.text[1:]), sort.text, formula)
        return formula

    def _proposition(self, parts: list[Any], scope: Scope) -> Formula:
        feature = self._feature(parts[0], scope)
        self._kinds.check_proposition(feature, parts[0])
        return model.Proposition(feature)

    def _comparison(self, tree: Node, scope: Scope) -> Formula:
        left, comparator, right = tree.parts
        sign = cast(model.Comparator, comparator.parts[0].text)
        comparison = model.Comparison(self._term(left, scope), sign, self._term(right, scope))
        self._kinds.check_comparison(comparison, tree)
        return comparison

    # ---- terms

    def _term(self, tree: Node, scope: Scope) -> Term:
        parts = tree.parts
        match tree.rule:
            case "feature":
                return self._feature(tree, scope)
            case "variable":
                return self._variable(parts[0], scope)
            case "text":
                return model.Text(parts[0].unquoted)
            case "number":
                amount, unit = _quantity(parts[1])
                return model.Number(-amount if parts[0] is not None else amount, unit)
            case "scaled":
                return model.Scaled(Decimal(parts[0].text), self._feature(parts[1], scope))
            case _:
                left, right = (self._term(part, scope) for part in parts)
                assert not isinstance(right, model.Sum)
                return model.Sum(left, "+" if tree.rule == "sum" else "-", right)

    def _feature(self, tree: Node, scope: Scope) -> model.Feature:
        name, *rest = tree.parts
        arguments = [part for part in rest if part is not None]
        self._check_feature(name, arguments)
        return model.Feature(name.text, tuple(self._argument(part, scope) for part in arguments))

    def _argument(self, tree: Node, scope: Scope) -> model.Argument:
        word = tree.parts[0]
        if tree.rule == "variable":
            return self._variable(word, scope)
        return model.Object(word.unquoted if word.kind == "STRING" else word.text)

    def _variable(self, word: Word, scope: Scope) -> model.Variable:
        name = word.text[1:]
        if name not in scope:
            hint = suggest(name, scope) or "bind it: forall ?x in Sort: ..."
            self._reporter.error("F0204", f"expected a bound variable, got {word.text!r}", word.span(self._file), hint)
        return model.Variable(name)

    # ---- windows

    def _window(self, tree: Node | None) -> model.Window:
        if tree is None:
            return model.ALWAYS_OPEN
        start, end = tree.parts
        start_us = self._duration(start)
        if isinstance(end, Word):
            return model.Window(start_us)
        end_us = self._duration(end)
        if end_us < start_us:
            expected = f"an end that is not before the start {format_duration(start_us)}"
            message = f"expected {expected}, got {format_duration(end_us)}"
            self._reporter.error("F0301", message, end.span, related=[(start.span, "the start")])
        return model.Window(start_us, end_us)

    def _duration(self, tree: Node) -> int:
        word = tree.parts[0]
        digits, unit = split_quantity(word.text)
        if unit not in US_PER_UNIT and (unit or digits.strip("0.")):
            message = f"expected a duration with a unit of time, got {word.text!r}"
            self._reporter.error("F0302", message, tree.span, meant(digits, unit))
            return 0
        us = to_us(digits, US_PER_UNIT.get(unit, 1))
        if us is None or us > LARGEST_US:
            expected = "a whole number of microseconds" if us is None else "a duration of at most 35 years"
            self._reporter.error("F0303", f"expected {expected}, got {word.text!r}", tree.span)
            return 0
        return us

    # ---- names

    def _bind(self, word: Word, scope: dict[str, str | None], sort: str) -> None:
        name = word.text[1:]
        if scope.get(name) is not None:
            hint = "variables in each other's reach need different names"
            related = [(self._bound[name], "the first")] if name in self._bound else []
            message = f"expected a new variable, got {word.text!r} again"
            self._reporter.error("F0205", message, word.span(self._file), hint, related=related)
        scope[name], self._bound[name] = sort, word.span(self._file)

    def _check_feature(self, word: Word, arguments: Sequence[Node]) -> None:
        if self._signature is None:
            return
        name, known, count, events = word.text, self._signature.features, len(arguments), self._signature.events
        if name not in known:
            hint = suggest(name, known)
            self._reporter.error("F0201", f"expected a known feature, got {name!r}", word.span(self._file), hint)
        elif known[name] != count:
            plural = "" if known[name] == 1 else "s"
            message = f"expected {known[name]} argument{plural} of {name!r}, got {count}"
            form = f"write {events[name]}, with ? for what may be whichever" if name in events else ""
            self._reporter.error("F0202", message, word.span(self._file), form)
        elif name not in events:
            for whichever in (one.parts[0] for one in arguments if one.parts[0].kind == "ANY"):
                message = f"expected an object or a variable in {name!r}, got '?'"
                advice = "only events may be asked of whichever object: write forall ?x in Car: or exists ?x in Car:"
                self._reporter.error("F0208", message, whichever.span(self._file), advice)

    def _check_sort(self, word: Word) -> None:
        if self._signature is not None and word.text not in self._signature.sorts:
            hint = suggest(word.text, self._signature.sorts)
            self._reporter.error("F0203", f"expected a known sort, got {word.text!r}", word.span(self._file), hint)


def _variables_in(tree: Node) -> Iterator[str]:
    for part in tree.parts:
        if isinstance(part, Node):
            yield from _variables_in(part)
        elif isinstance(part, Word) and part.kind == "VARIABLE":
            yield part.text


def _quantity(word: Word) -> tuple[Decimal, str]:
    digits, unit = split_quantity(word.text)
    return Decimal(digits), unit
