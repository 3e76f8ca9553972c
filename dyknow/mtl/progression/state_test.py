"""Does a formula without tense hold in one state? Such formulas become functions that answer in three values.

The logic is Kleene's: what is not known stays unknown unless the rest decides alone.
"""

import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias  # Any: features have values of any type

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier, Term
from dyknow.mtl.kinds import value_of
from dyknow.mtl.printer import print_formula, print_term
from dyknow.mtl.progression.states import State, StateError

Bound: TypeAlias = tuple[str, ...]
"""The objects that the variables stand for, each at the slot of its variable."""
StateTest: TypeAlias = Callable[[State, Bound], "bool | None"]
Reader: TypeAlias = Callable[[State, Bound], Any]
Slots: TypeAlias = Mapping[str, int]

_OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    "=": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    ">": operator.gt,
}


def state_test(formula: Formula, slots: Mapping[str, int] = {}) -> StateTest:  # noqa: PLR0911 - one per kind
    """Make the function that says whether a formula without tense holds in a state.

    Parameters
    ----------
    formula : without tense.
    slots : where the objects of its free variables stand in the tuple of bound objects.

    Returns
    -------
    A function of a state and the bound objects; None where the answer is not known. It raises `StateError` where a
    value is of the wrong type.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.progression.states import DictState
    >>> fast = state_test(parse_formula("speed[?c] > 36 km/h", variables=["c"]), {"c": 0})
    >>> state = DictState({("speed", ("car7",)): 12.5})
    >>> fast(state, ("car7",)), fast(state, ("car8",))
    (True, None)
    """
    match formula:
        case model.Truth(value):
            return lambda _state, _bound: value
        case model.Proposition(feature):
            return _proposition(feature, slots)
        case model.Comparison():
            return _comparison(formula, slots)
        case model.Not(body):
            return _negation(state_test(body, slots))
        case model.And(parts):
            return _joined(tuple(state_test(part, slots) for part in parts), decisive=False)
        case model.Or(parts):
            return _joined(tuple(state_test(part, slots) for part in parts), decisive=True)
        case model.Implies(left, right):
            return _joined((_negation(state_test(left, slots)), state_test(right, slots)), decisive=True)
        case model.Iff(left, right):
            return _equivalence(state_test(left, slots), state_test(right, slots))
        case model.Quantified(quantifier, variable, sort, body):
            inner = state_test(body, {**slots, variable.name: max(slots.values(), default=-1) + 1})
            return _quantified(inner, sort, decisive=quantifier is Quantifier.EXISTS)
    raise AssertionError(f"expected a formula without tense, got {formula!r}")


def _proposition(feature: model.Feature, slots: Slots) -> StateTest:
    if any(isinstance(one, model.Variable) for one in feature.arguments):
        read = _feature(feature, slots)

        def test_of_variables(state: State, bound: Bound) -> bool | None:
            value = read(state, bound)
            return value if value is True or value is False else _truth(value, feature)

        return test_of_variables
    name, objects = feature.name, tuple(one.name for one in feature.arguments)

    def test(state: State, _bound: Bound) -> bool | None:
        value = state.value(name, objects)
        return value if value is True or value is False else _truth(value, feature)

    return test


def _truth(value: Any, feature: model.Feature) -> bool | None:  # Any: what a state gave
    if value is True or value is False or value is None:
        return value
    where = f"state: feature {print_term(feature)!r}, which is not compared"
    raise StateError(f"{where}: expected True, False or None, got {value!r}")


def _comparison(comparison: model.Comparison, slots: Slots) -> StateTest:
    left, right = _term(comparison.left, slots), _term(comparison.right, slots)
    compare = _OPERATORS[comparison.comparator]

    def test(state: State, bound: Bound) -> bool | None:
        """Compare both sides; unknown if one of them is."""
        one = other = None
        try:
            one, other = left(state, bound), right(state, bound)
            if one is None or other is None:
                return None
            return True if compare(one, other) else False  # noqa: SIM210 - bool() costs a call, values may be numpy's
        except TypeError as error:
            raise StateError(
                f"state: formula {print_formula(comparison)!r}: expected values that can be compared, "
                f"got {one!r} and {other!r}"
            ) from error

    return test


def _negation(body: StateTest) -> StateTest:
    def test(state: State, bound: Bound) -> bool | None:
        value = body(state, bound)
        return None if value is None else not value

    return test


def _joined(parts: tuple[StateTest, ...], *, decisive: bool) -> StateTest:
    """One part with the decisive value decides: False for a conjunction, True for a disjunction."""

    def test(state: State, bound: Bound) -> bool | None:
        """Ask the parts up to the first that decides."""
        result: bool | None = not decisive
        for part in parts:
            value = part(state, bound)
            if value is decisive:
                return decisive
            if value is None:
                result = None
        return result

    return test


def _equivalence(left: StateTest, right: StateTest) -> StateTest:
    def test(state: State, bound: Bound) -> bool | None:
        one, other = left(state, bound), right(state, bound)
        return None if one is None or other is None else one is other

    return test


def _quantified(body: StateTest, sort: str, *, decisive: bool) -> StateTest:
    def test(state: State, bound: Bound) -> bool | None:
        """Ask for each member up to the first that decides."""
        result: bool | None = not decisive
        for member in state.members(sort):
            value = body(state, (*bound, member))
            if value is decisive:
                return decisive
            if value is None:
                result = None
        return result

    return test


def _term(term: Term, slots: Slots) -> Reader:
    match term:
        case model.Variable(name):
            slot = slots[name]
            return lambda _state, bound: bound[slot]
        case model.Number():
            number = value_of(term)
            return lambda _state, _bound: number
        case model.Text(text):
            return lambda _state, _bound: text
        case model.Feature():
            return _feature(term, slots)
        case model.Scaled(factor, feature):
            return _arithmetic(operator.mul, _term(model.Number(factor), slots), _feature(feature, slots))
        case model.Sum(left, sign, right):
            return _arithmetic(operator.add if sign == "+" else operator.sub, _term(left, slots), _term(right, slots))


def _arithmetic(combine: Callable[[Any, Any], Any], left: Reader, right: Reader) -> Reader:
    def read(state: State, bound: Bound) -> Any:  # Any: a number
        one, other = left(state, bound), right(state, bound)
        return None if one is None or other is None else combine(one, other)

    return read


def _feature(feature: model.Feature, slots: Slots) -> Reader:
    name, arguments = feature.name, feature.arguments
    variables = [slots[one.name] for one in arguments if isinstance(one, model.Variable)]
    if not variables:
        objects = tuple(one.name for one in arguments)
        return lambda state, _bound: state.value(name, objects)
    if len(arguments) == 1:
        only = variables[0]
        return lambda state, bound: state.value(name, (bound[only],))
    if len(variables) == len(arguments):
        objects_of = operator.itemgetter(*variables)
        return lambda state, bound: state.value(name, objects_of(bound))
    places = tuple(slots[one.name] if isinstance(one, model.Variable) else one.name for one in arguments)
    return lambda state, bound: state.value(
        name, tuple([bound[place] if isinstance(place, int) else place for place in places])
    )
