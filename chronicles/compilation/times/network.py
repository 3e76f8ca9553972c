"""Which time differences do the constraints of a chronicle leave, and do they contradict each other?

A simple temporal network (Dechter, Meiri, Pearl 1991, *Temporal constraint networks*): `distance[i, j]` bounds
`t_j - t_i` from above. All-pairs shortest paths give the minimal network: every pair of values it allows can be
extended to all other points, so a recogniser only intersects windows and never propagates again.
All numbers are integer microseconds; bounds are closed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chronicles.compilation.components import connected_components
from chronicles.language import model
from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import format_duration
from dyknow.language.places import Span

IntArray = NDArray[np.int64]

# Twice this still fits into 64 bits; anything at or above it means "no bound".
UNBOUNDED_US = 2**61


@dataclass(frozen=True, slots=True)
class Edge:
    """`t_target - t_source <= weight_us`, and the statement that says so."""

    source: int
    target: int
    weight_us: int
    span: Span


def distances(point_count: int, edges: Sequence[Edge]) -> IntArray:
    """Make the distance matrix that the edges state, before minimising.

    Returns
    -------
    (n, n); `UNBOUNDED_US` where no edge says anything, 0 on the diagonal.
    """
    matrix = np.full((point_count, point_count), UNBOUNDED_US, dtype=np.int64)
    np.fill_diagonal(matrix, 0)
    for edge in edges:
        matrix[edge.source, edge.target] = min(matrix[edge.source, edge.target], edge.weight_us)
    return matrix


def minimise(matrix: IntArray) -> IntArray | None:
    """Tighten every bound to what all constraints together leave (Floyd-Warshall).

    Parameters
    ----------
    matrix : (n, n), as made by `distances`.

    Returns
    -------
    The minimal network, (n, n), or None if the constraints contradict each other.

    Examples
    --------
    >>> minimise(np.array([[0, 5, UNBOUNDED_US], [-1, 0, 5], [UNBOUNDED_US, -1, 0]])).tolist()
    [[0, 5, 10], [-1, 0, 5], [-2, -1, 0]]
    >>> minimise(np.array([[0, 5], [-6, 0]])) is None
    True
    """
    least = matrix.copy()
    for middle in range(len(least)):
        into, out_of = least[:, middle, None], least[None, middle, :]
        # Saturating sum: no bound plus anything is no bound, also when the anything is negative.
        through = np.where((into >= UNBOUNDED_US) | (out_of >= UNBOUNDED_US), UNBOUNDED_US, into + out_of)
        np.minimum(least, through, out=least)
        if (np.diagonal(least) < 0).any():
            return None
    return least


def shortest_path(point_count: int, edges: Sequence[Edge], source: int, target: int) -> tuple[Edge, ...]:
    """Find the edges that bound `t_target - t_source` best; empty if nothing bounds it.

    The edges must not contradict each other.
    """
    reach = [UNBOUNDED_US] * point_count
    reach[source] = 0
    before, _ = _relaxed(reach, edges)
    path: list[Edge] = []
    while target != source and (edge_in := before[target]) is not None:
        path.append(edge_in)
        target = edge_in.source
    return tuple(reversed(path))


def negative_cycle(point_count: int, edges: Sequence[Edge]) -> tuple[Edge, ...]:
    """Find constraints that contradict each other.

    Returns
    -------
    Edges in order, each starting where the one before ends, with a negative sum of weights; empty if there are none.
    """
    before, last = _relaxed([0] * point_count, edges)  # as from a point from which every other one is reached
    return () if last is None else _walk_back(last.target, before)


def _relaxed(reach: list[int], edges: Sequence[Edge]) -> tuple[Sequence[Edge | None], Edge | None]:
    """Shorten the ways to all points along edges (Bellman-Ford).

    Returns
    -------
    The last edge on the way to each point; and an edge that could still shorten one after a round for each point.
    """
    before: list[Edge | None] = [None] * len(reach)
    changed: Edge | None = None
    for _ in range(len(reach) + 1):
        changed = None
        for edge in edges:
            if reach[edge.source] < UNBOUNDED_US and reach[edge.source] + edge.weight_us < reach[edge.target]:
                reach[edge.target] = reach[edge.source] + edge.weight_us
                before[edge.target] = changed = edge
        if changed is None:
            break
    return before, changed


def _walk_back(point: int, before: Sequence[Edge | None]) -> tuple[Edge, ...]:
    for _ in before:  # n steps back always end inside the cycle
        edge = before[point]
        assert edge is not None
        point = edge.source
    cycle: list[Edge] = []
    start = point
    while not cycle or point != start:
        edge = before[point]
        assert edge is not None
        cycle.append(edge)
        point = edge.source
    return tuple(reversed(cycle))


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
    ends = [{own[0].source, own[0].target} for own in constraints]
    return len(set[int]().union(*ends)) == len(ends) + len(connected_components(ends))


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
