"""The slow and obvious meaning of formulas: look at all states of a sequence, for every operator as it is defined.

Three-valued after Kleene: None is unknown, min and max over false < unknown < true.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier, Term
from dyknow.mtl.kinds import value_of
from dyknow.mtl.progression.states import DictState

F, U, T = 0, 1, 2
Objects = dict[str, tuple[str, str]]  # variable: (sort, object)
COMPARE = {">=": operator.ge, "!=": operator.ne}


@dataclass(frozen=True)
class Sequences:
    """States at increasing times; more may follow unless the sequence has ended, none before `least_us`."""

    states: Sequence[tuple[int, DictState]]
    has_ended: bool
    least_us: int = 0

    def holds(self, formula: Formula, i: int, objects: Objects) -> int:  # noqa: PLR0911, PLR0912 - one case a line
        """Say whether a formula holds in state i: F, U or T."""
        state = self.states[i][1]
        match formula:
            case model.Truth(value):
                return T if value else F
            case model.Proposition(feature):
                return known(value_in(feature, state, objects))
            case model.Comparison(left, comparator, right):
                one, other = value_in(left, state, objects), value_in(right, state, objects)
                return U if one is None or other is None else known(COMPARE[comparator](one, other))
            case model.Not(body):
                return T - self.holds(body, i, objects)
            case model.And(parts):
                return min(self.holds(part, i, objects) for part in parts)
            case model.Or(parts):
                return max(self.holds(part, i, objects) for part in parts)
            case model.Implies(left, right):
                return max(T - self.holds(left, i, objects), self.holds(right, i, objects))
            case model.Iff(left, right):
                one, other = self.holds(left, i, objects), self.holds(right, i, objects)
                return min(max(T - one, other), max(T - other, one))
            case model.Quantified(quantifier, variable, sort, body):
                every = [self.holds(body, i, objects | {variable.name: (sort, one)}) for one in state.members(sort)]
                return min(every, default=T) if quantifier is Quantifier.FORALL else max(every, default=F)
            case model.Next(body):
                if i + 1 == len(self.states):
                    return F if self.has_ended else U
                return self.holds(body, i + 1, objects) if self.are_there(i + 1, objects) else U
            case model.Until(left, right, window):
                return self.until(left, right, window, i, objects)
            case model.Eventually(body, window):
                return self.until(model.Truth(True), body, window, i, objects)
            case model.Always(body, window):
                return T - self.until(model.Truth(True), model.Not(body), window, i, objects)
            case model.Tolerate(body, return_us, stay_us):
                stays = model.Always(body, model.Window(0, stay_us))
                comes_back = self.until(model.Truth(True), stays, model.Window(0, return_us), i, objects)
                return max(self.holds(body, i, objects), comes_back)
        raise AssertionError(formula)

    def until(self, left: Formula, right: Formula, window: model.Window, i: int, objects: Objects) -> int:
        """Some state of the window has `right`, and all before it, from i on, have `left`."""
        start_us = self.states[i][0]
        so_far, found = T, F
        for j in range(i, len(self.states)):
            passed_us = self.states[j][0] - start_us
            if window.end_us is not None and passed_us > window.end_us:
                return found
            if j > i and not self.are_there(j, objects):
                return max(found, min(so_far, U))
            if passed_us >= window.start_us:
                found = max(found, min(so_far, self.holds(right, j, objects)))
            so_far = min(so_far, self.holds(left, j, objects))
        # All states up to this time are known: those after the last one, or after a promise, are not.
        passed_us = max(self.states[-1][0], self.least_us - 1) - start_us
        if self.has_ended or (window.end_us is not None and passed_us >= window.end_us):
            return found
        return max(found, min(so_far, U))

    def are_there(self, i: int, objects: Objects) -> bool:
        return all(one in self.states[i][1].members(sort) for sort, one in objects.values())


def known(value: object) -> int:
    return U if value is None else T if value else F


def value_in(term: Term, state: DictState, objects: Objects) -> object:
    match term:
        case model.Variable(name):
            return objects[name][1]
        case model.Text(text):
            return text
        case model.Number():
            return value_of(term)
        case model.Feature(name, arguments):
            found = tuple(objects[one.name][1] if isinstance(one, model.Variable) else one.name for one in arguments)
            return state.value(name, found)
    raise AssertionError(term)
