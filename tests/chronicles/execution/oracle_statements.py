"""What do the parts of a statement say about an event, a binding and some times? For the oracle only."""

from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from chronicles.events import Event
from chronicles.language import model

Binding = dict[str, str]
Times = dict[str, int]


def names_of_equals(chronicle: model.Chronicle) -> dict[str, str]:
    names: dict[str, str] = {}
    for one in chronicle.statements:
        if isinstance(one, model.Equality) and one.equal and isinstance(one.term, model.Variable):
            left = names.setdefault(one.variable.name, one.variable.name)
            right = names.setdefault(one.term.name, one.term.name)
            names = {name: min(left, right) if root in (left, right) else root for name, root in names.items()}
    return names


def renamed(node: Any, names: dict[str, str]) -> Any:
    """Replace the names of variables everywhere below a node of the tree."""
    if isinstance(node, tuple):
        return tuple(renamed(one, names) for one in node)
    if isinstance(node, model.Variable):
        return replace(node, name=names.get(node.name, node.name))
    if is_dataclass(node) and not isinstance(node, type):
        return replace(node, **{one.name: renamed(getattr(node, one.name), names) for one in fields(node)})
    return node


def unify(pattern: model.Pattern, event: Event, binding: Binding) -> Binding | None:
    values: tuple[str, ...] = event.args
    if event.name != pattern.name or len(event.args) != len(pattern.arguments):
        return None
    if (event.new is not None) != bool(pattern.values):
        return None
    if event.new is not None:
        old = event.old or "unknown"
        if old == event.new:
            return None
        values = (*values, old, event.new)
    extended = dict(binding)
    for term, value in zip(pattern.terms, values, strict=True):
        if isinstance(term, model.Literal) and term.text != value:
            return None
        if isinstance(term, model.Variable) and extended.setdefault(term.name, value) != value:
            return None
    return extended


def variables_of(terms: Iterable[model.Term]) -> set[str]:
    return {term.name for term in terms if isinstance(term, model.Variable)}


def text_of(term: model.Term, binding: Binding) -> str:
    if isinstance(term, model.Anything):
        return "?"
    return binding[term.name] if isinstance(term, model.Variable) else term.text


def signed(bound: model.Bound | None) -> int:
    if bound is None or bound.duration is None:
        return 0
    return -bound.duration.us if bound.negative else bound.duration.us


def start_of(one: Any, times: Times) -> int:
    return times[one.interval.start.point.name] + signed(one.interval.start.offset)


def end_of(one: Any, times: Times) -> int:
    return times[one.interval.end.point.name] + signed(one.interval.end.offset)
