"""When can the time points of a chronicle be, relative to each other?

Collects the constraints of a body as edges of a temporal network, minimises it, and refuses what cannot be recognised:
contradictions, points that no event fixes, and chronicles that could wait for ever.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from chronicles.compilation.network import UNBOUNDED_US, Edge, IntArray, distances, minimise, negative_cycle
from chronicles.compilation.symbols import Symbols
from chronicles.language import model
from chronicles.language.diagnostics import Reporter, Span, suggest
from chronicles.language.printer import format_duration


@dataclass(frozen=True, slots=True)
class Timing:
    """The minimal network over `points` (sorted names); `anchors` ties each point to the point of an event, plus us."""

    points: tuple[str, ...]
    least_us: IntArray
    anchors: Mapping[str, tuple[str, int]]

    def most_us(self, start: str, end: str) -> int:
        """Bound `end - start` from above; `UNBOUNDED_US` or more means no bound."""
        return int(self.least_us[self.points.index(start), self.points.index(end)])

    def most_between_us(self, start: tuple[str, int], end: tuple[str, int]) -> int:
        """Bound the difference of two moved points from above."""
        return self.most_us(start[0], end[0]) + end[1] - start[1]


def resolve_timing(chronicle: model.Chronicle, symbols: Symbols, reporter: Reporter) -> Timing | None:
    """Make the minimal network of a chronicle, or report why there is none.

    Returns
    -------
    None if something was reported.
    """
    before = len(reporter.errors)
    event_points = {one.point.name: one for one in chronicle.statements if isinstance(one, model.EventStatement)}
    mentioned = _mentioned(chronicle)
    points = tuple(sorted(mentioned))
    edges = _EdgeBuilder(points, symbols, reporter).edges(chronicle)
    if len(reporter.errors) > before:
        return None
    least = minimise(distances(len(points), edges))
    if least is None:
        _report_cycle(chronicle, points, edges, reporter)
        return None
    anchors = _anchors(points, least, event_points)
    for name, point in mentioned.items():
        if name not in anchors:
            _report_free(point, sorted(event_points), reporter)
    _check_bounded(chronicle, points, least, event_points, reporter)
    if len(reporter.errors) > before:
        return None
    timing = Timing(points, least, anchors)
    _warn_order(chronicle, timing, reporter)
    return timing


def moved(time: model.TimeExpression, symbols: Symbols, reporter: Reporter) -> tuple[str, int]:
    """Give the point and the offset in microseconds of a time expression."""
    return time.point.name, offset_us(time.offset, symbols, reporter)


def offset_us(offset: model.Bound | None, symbols: Symbols, reporter: Reporter) -> int:
    """Give an offset in microseconds, 0 for none."""
    if offset is None or offset.duration is None:
        return 0
    return symbols.duration_of(offset.duration, reporter) * (-1 if offset.negative else 1)


def _mentioned(chronicle: model.Chronicle) -> dict[str, model.TimePoint]:
    found: list[model.TimePoint] = []
    for one in chronicle.statements:
        match one:
            case model.EventStatement():
                found.append(one.point)
            case model.NoEventStatement() | model.OccursStatement() | model.HoldStatement() | model.AssertStatement():
                found += [one.interval.start.point, one.interval.end.point]
            case model.Comparison():
                found += [one.left, one.right]
            case model.Range():
                found += [one.later, one.earlier]
            case _:
                pass
    found += chronicle.points
    found += [one.time.point for one in chronicle.actions if isinstance(one, model.Emit) and one.time is not None]
    return {point.name: point for point in reversed(found)}


class _EdgeBuilder:
    """Turns statements into edges of the network, by index into `points`."""

    def __init__(self, points: Sequence[str], symbols: Symbols, reporter: Reporter) -> None:
        self._index = {name: index for index, name in enumerate(points)}
        self._symbols = symbols
        self._reporter = reporter
        self._edges: list[Edge] = []

    def edges(self, chronicle: model.Chronicle) -> list[Edge]:
        """Collect the edges of all statements, in the order of the text."""
        for one in chronicle.statements:
            match one:
                case model.Comparison():
                    self._comparison(one)
                case model.Range():
                    self._range(one)
                case model.HoldStatement(_, interval, span):
                    self._interval(interval, span, is_hold=True)
                case model.NoEventStatement(_, interval, span):
                    self._interval(interval, span, is_hold=False)
                case _:
                    pass
        return self._edges

    def _comparison(self, one: model.Comparison) -> None:
        if self._is_same(one.left, one.right, one.span):
            return
        offset = offset_us(one.offset, self._symbols, self._reporter)
        if one.comparator in ("<", "<=", "="):
            self._at_most(one.right.name, one.left.name, offset - (one.comparator == "<"), one.span)
        if one.comparator in (">", ">=", "="):
            self._at_most(one.left.name, one.right.name, -offset - (one.comparator == ">"), one.span)

    def _range(self, one: model.Range) -> None:
        if self._is_same(one.later, one.earlier, one.span):
            return
        low, high = self._bound(one.low, is_low=True), self._bound(one.high, is_low=False)
        # Open ends move inwards by the one tick that time has.
        low = low if low is None else low + one.low_open
        high = high if high is None else high - one.high_open
        if low is not None and high is not None and low > high:
            message = f"expected bounds with a time between them, got {format_duration(low)} to {format_duration(high)}"
            self._reporter.error("C0401", message, one.low.span.to(one.high.span), "the smaller bound comes first")
            return
        if high is not None:
            self._at_most(one.earlier.name, one.later.name, high, one.span)
        if low is not None:
            self._at_most(one.later.name, one.earlier.name, -low, one.span)

    def _interval(self, interval: model.Interval, span: Span, *, is_hold: bool) -> None:
        start = moved(interval.start, self._symbols, self._reporter)
        end = moved(interval.end, self._symbols, self._reporter)
        if start[0] == end[0]:
            if start[1] >= end[1]:
                message = "expected an interval whose start is before its end, got one that is always empty"
                self._reporter.error("C0405", message, interval.span)
        elif is_hold:
            # Nothing holds "throughout" no time at all: a hold puts its start before its end.
            self._at_most(end[0], start[0], end[1] - start[1] - 1, span)

    def _bound(self, bound: model.Bound, *, is_low: bool) -> int | None:
        if bound.duration is not None:
            return self._symbols.duration_of(bound.duration, self._reporter) * (-1 if bound.negative else 1)
        if bound.negative != is_low:
            wanted = "-oo or a duration as the lower bound" if is_low else "oo or a duration as the upper bound"
            self._reporter.error("C0401", f"expected {wanted}, got {'-oo' if bound.negative else 'oo'}", bound.span)
        return None

    def _is_same(self, left: model.TimePoint, right: model.TimePoint, span: Span) -> bool:
        if left.name == right.name:
            self._reporter.error("C0404", f"expected two time points, got {left.name} twice", span)
        return left.name == right.name

    def _at_most(self, source: str, target: str, weight_us: int, span: Span) -> None:
        self._edges.append(Edge(self._index[source], self._index[target], weight_us, span))


def _report_cycle(chronicle: model.Chronicle, points: Sequence[str], edges: Sequence[Edge], reporter: Reporter) -> None:
    cycle = negative_cycle(len(points), edges)
    sentences = [_sentence(edge, points) for edge in cycle]
    short_us = -sum(edge.weight_us for edge in cycle)
    message = f"the time constraints of {chronicle.name!r} contradict each other: " + "; ".join(sentences)
    first = min(cycle, key=lambda edge: (edge.span.line, edge.span.column))
    hint = f"together they miss by {format_duration(short_us)}; relax one of them"
    reporter.error("C0501", message, first.span, hint)


def _sentence(edge: Edge, points: Sequence[str]) -> str:
    source, target, weight_us = points[edge.source], points[edge.target], edge.weight_us
    if weight_us < 0:
        return f"{source} is at least {format_duration(-weight_us)} after {target} (line {edge.span.line})"
    return f"{target} is at most {format_duration(weight_us)} after {source} (line {edge.span.line})"


def _anchors(points: Sequence[str], least: IntArray, event_points: Mapping[str, object]) -> dict[str, tuple[str, int]]:
    """Tie each point to an event's point at a fixed distance; points that float are left out."""
    anchors = {name: (name, 0) for name in points if name in event_points}
    for index, name in enumerate(points):
        for other, event_point in enumerate(points):
            fixed = least[other, index] == -least[index, other]
            if name not in anchors and event_point in event_points and fixed:
                anchors[name] = (event_point, int(least[other, index]))
    return anchors


def _report_free(point: model.TimePoint, event_points: Sequence[str], reporter: Reporter) -> None:
    message = f"expected {point.name} to be the time of an event or at a fixed distance from one, got neither"
    near = suggest(point.name, event_points) if event_points else ""
    example = f"add an event at {point.name}, or a constraint such as t1 - {point.name} in [1s, 1s]"
    reporter.error("C0403", message, point.span, near if near.startswith("did") else example)


def _check_bounded(
    chronicle: model.Chronicle,
    points: Sequence[str],
    least: IntArray,
    event_points: Mapping[str, model.EventStatement],
    reporter: Reporter,
) -> None:
    """Refuse a chronicle in which one event may come any time after another."""
    places = [(points.index(name), name) for name in event_points]
    for start, start_name in places:
        for end, end_name in places:
            if least[start, end] >= UNBOUNDED_US:
                message = (
                    f"an instance of {chronicle.name!r} could wait for ever: "
                    f"expected a bound on how long after {start_name} the event at {end_name} may come, got none"
                )
                hint = f"add a constraint such as {end_name} - {start_name} in [0s, 1min]"
                reporter.error("C0701", message, event_points[end_name].point.span, hint)
                return


def _warn_order(chronicle: model.Chronicle, timing: Timing, reporter: Reporter) -> None:
    if len(chronicle.points) < 2:
        return
    start, end = chronicle.points[0], chronicle.points[-1]
    if timing.most_us(end.name, start.name) > 0:
        message = f"the end {end.name} of {chronicle.name!r} may be before its start {start.name}"
        reporter.warning("C0406", message, end.span, f"add {start.name} <= {end.name}")
