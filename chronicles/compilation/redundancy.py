"""Which statements of a chronicle say nothing that others do not say already?

A time constraint is redundant where the other time constraints imply it: the shortest path between its two points,
without its own edges, is as tight. An obligation or a constraint on values is redundant where it stands twice.
"""

from __future__ import annotations

from collections.abc import Sequence

from chronicles.compilation.network import Edge, shortest_path
from chronicles.language import model
from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import format_duration
from dyknow.language.places import Span

# Events are left out: two alike ask for two events.
_ONCE_IS_ENOUGH = model.Obligation | model.Equality | model.Membership | model.Allowance


def warn_repeated(chronicle: model.Chronicle, reporter: Reporter) -> None:
    """Warn about statements that stand twice."""
    first: dict[model.Statement, Span] = {}
    for one in chronicle.statements:
        if isinstance(one, _ONCE_IS_ENOUGH) and first.setdefault(one, one.span) != one.span:
            message = f"expected each statement once, got again what line {first[one].line} says"
            reporter.warning("C0602", message, one.span, "leave one of them out", related=[(first[one], "the first")])


def warn_implied(chronicle: model.Chronicle, points: Sequence[str], edges: Sequence[Edge], reporter: Reporter) -> None:
    """Warn about time constraints that the other ones imply.

    Parameters
    ----------
    chronicle : its constraints are judged from the last to the first, so that of two equal ones the first is kept.
    points : the names of the network's points.
    edges : what all statements say, without contradiction. Only those of time constraints count: an order that a
        `hold` implies may well be written out.
    reporter : receives the warnings.
    """
    constraints = [one for one in chronicle.statements if isinstance(one, model.TimeConstraint)]
    stated = {one.span: [edge for edge in edges if edge.span == one.span] for one in constraints}
    if _is_forest([own for own in stated.values() if own]) and all(stated.values()):
        return
    for one in reversed(constraints):
        own = stated.pop(one.span)
        others = [edge for kept in stated.values() for edge in kept]
        paths = [shortest_path(len(points), others, edge.source, edge.target) for edge in own]
        lengths = [sum(edge.weight_us for edge in path) for path in paths]
        if all(path and length <= edge.weight_us for path, length, edge in zip(paths, lengths, own, strict=True)):
            _report(one, points, [edge for path in paths for edge in path], reporter)
        else:
            stated[one.span] = own


def _is_forest(constraints: Sequence[Sequence[Edge]]) -> bool:
    """Say whether there is one way at most from any point to any other, as in most chronicles: then none is implied."""
    tree: dict[int, int] = {}

    def root(point: int) -> int:
        """Give the point that stands for all that are connected with a point."""
        while point in tree:
            point = tree[point]
        return point

    for own in constraints:
        left, right = root(own[0].source), root(own[0].target)
        if left == right:
            return False
        tree[left] = right
    return True


def _report(one: model.TimeConstraint, points: Sequence[str], reasons: Sequence[Edge], reporter: Reporter) -> None:
    if not reasons:
        message = "expected a constraint that bounds a time, got one that leaves it open on both sides"
        reporter.warning("C0601", message, one.span, "leave it out")
        return
    related = {edge.span: sentence(edge, points) for edge in reasons}
    lines = sorted({span.line for span in related})
    listed = f"line {lines[0]}" if len(lines) == 1 else f"lines {', '.join(map(str, lines[:-1]))} and {lines[-1]}"
    message = f"expected constraints that each say something new, got one that {listed} imply"
    message = message.removesuffix("imply") + ("implies" if len(lines) == 1 else "imply")
    reporter.warning("C0601", message, one.span, "leave it out, or tighten it", related=related.items())


def sentence(edge: Edge, points: Sequence[str]) -> str:
    """Say in words what an edge says about two points."""
    source, target, weight_us = points[edge.source], points[edge.target], edge.weight_us
    if weight_us < 0:
        return f"{source} is at least {format_duration(-weight_us)} after {target}"
    return f"{target} is at most {format_duration(weight_us)} after {source}"
