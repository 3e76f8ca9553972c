"""When can the time points of a chronicle be, relative to each other?

Collects the constraints of a body as edges of a temporal network, minimises it, and refuses what cannot be recognised:
contradictions, points that no event fixes, and chronicles that could wait for ever.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from chronicles.compilation.names.symbols import Symbols
from chronicles.compilation.times.network import (
    UNBOUNDED_US,
    Edge,
    distances,
    minimise,
    negative_cycle,
    sentence,
    warn_implied,
    warn_repeated,
)
from chronicles.language import model
from chronicles.language.printer import print_bound, print_statement
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.durations import format_duration
from dyknow.language.places import Span

Distances = Sequence[Sequence[int]]  # plain integers: single numbers are read far more often than rows


@dataclass(frozen=True, slots=True)
class Timing:
    """The minimal network over `points` (sorted names); `anchors` ties each point to the point of an event, plus us."""

    points: tuple[str, ...]
    least_us: Distances
    anchors: Mapping[str, tuple[str, int]]

    def most_us(self, start: str, end: str) -> int:
        """Bound `end - start` from above; `UNBOUNDED_US` or more means no bound."""
        return self.least_us[self.points.index(start)][self.points.index(end)]


def resolve_timing(chronicle: model.Chronicle, symbols: Symbols, reporter: Reporter) -> Timing | None:
    """Make the minimal network of a chronicle, or report why there is none.

    Returns
    -------
    None if something was reported.
    """
    before = reporter.error_count
    mentioned = _mentioned(chronicle)
    points = tuple(sorted(mentioned))
    edges = _EdgeBuilder(points, symbols, reporter).edges(chronicle)
    if reporter.error_count > before:
        return None
    minimal = minimise(distances(len(points), edges))
    if minimal is None:
        _report_cycle(chronicle, points, edges, reporter)
        return None
    event_points = {one.point.name: one.point for one in chronicle.of(model.EventStatement)}
    timing = _timing(points, minimal.tolist(), event_points)
    for name, point in mentioned.items():
        if name not in timing.anchors:
            _report_free(point, sorted(event_points), reporter)
    _check_bounded(chronicle, timing, event_points, reporter)
    if reporter.error_count > before:
        return None
    _warn_order(chronicle, timing, reporter)
    _warn_turned(chronicle, timing, symbols, reporter)
    warn_implied(chronicle, points, edges, reporter)
    warn_repeated(chronicle, reporter)
    return timing


def moved(time: model.TimeExpression, symbols: Symbols, reporter: Reporter) -> tuple[str, int]:
    """Give the point and the offset in microseconds of a time expression."""
    return time.point.name, offset_us(time.offset, symbols, reporter)


def offset_us(offset: model.Bound | None, symbols: Symbols, reporter: Reporter) -> int:
    """Give an offset in microseconds, 0 for none."""
    if offset is None or offset.duration is None:
        return 0
    return symbols.duration_of(offset.duration, reporter) * (-1 if offset.negative else 1)


def difference(one: model.TimeConstraint) -> tuple[str, str]:
    """Give the names of the later and the earlier time point, whose difference a constraint bounds."""
    points = (one.later, one.earlier) if isinstance(one, model.Range) else (one.left, one.right)
    return points[0].name, points[1].name


def closed_bounds_us(one: model.TimeConstraint, symbols: Symbols, reporter: Reporter) -> tuple[int | None, int | None]:
    """Give the least and the greatest difference that a constraint allows, None where it is unbounded.

    Open ends move inwards by the one tick that time has.
    """
    if isinstance(one, model.Range):
        low = None if one.low.duration is None else offset_us(one.low, symbols, reporter) + one.low_open
        high = None if one.high.duration is None else offset_us(one.high, symbols, reporter) - one.high_open
        return low, high
    offset = offset_us(one.offset, symbols, reporter)
    low = offset + (one.comparator == ">") if one.comparator in (">", ">=", "=") else None
    high = offset - (one.comparator == "<") if one.comparator in ("<", "<=", "=") else None
    return low, high


def _mentioned(chronicle: model.Chronicle) -> dict[str, model.TimePoint]:
    found: list[model.TimePoint] = []
    for one in chronicle.statements:
        match one:
            case model.EventStatement():
                found.append(one.point)
            case model.Obligation():
                found += [one.interval.start.point, one.interval.end.point]
            case model.Comparison():
                found += [one.left, one.right]
            case model.Range():
                found += [one.later, one.earlier]
            case _:
                pass
    found += chronicle.points
    found += [one.time.point for one in chronicle.actions if not isinstance(one, model.Report) and one.time is not None]
    return {point.name: point for point in reversed(found)}


class _EdgeBuilder:
    """Turns statements into edges of the network, by index into `points`."""

    def __init__(self, points: Sequence[str], symbols: Symbols, reporter: Reporter) -> None:
        self._points = points
        self._symbols = symbols
        self._reporter = reporter
        self._edges: list[Edge] = []

    def edges(self, chronicle: model.Chronicle) -> list[Edge]:
        """Collect the edges of all statements, in the order of the text."""
        for one in chronicle.statements:
            match one:
                case model.Comparison() | model.Range():
                    self._constraint(one)
                case model.Obligation():
                    least = one.least if isinstance(one, model.CountStatement) else 0
                    self._interval(one, needs_time=least > 0 or isinstance(one, model.HoldStatement))
                case _:
                    pass
        return self._edges

    def _constraint(self, one: model.TimeConstraint) -> None:
        later, earlier = difference(one)
        if later == earlier:
            message = f"expected two time points, got {later} twice"
            self._reporter.error("C0404", message, one.span, "name the other time point, or leave the constraint out")
            return
        before = self._reporter.error_count
        if isinstance(one, model.Range):
            self._check_infinity(one.low, is_low=True)
            self._check_infinity(one.high, is_low=False)
        low, high = closed_bounds_us(one, self._symbols, self._reporter)
        if self._reporter.error_count > before:
            return
        if isinstance(one, model.Range) and low is not None and high is not None and low > high:
            is_narrow = low - one.low_open <= high + one.high_open
            came = print_statement(one) if is_narrow else f"{format_duration(low)} to {format_duration(high)}"
            message = f"expected bounds with a time between them, got {came}"
            hint = Hint("a bound is left out here, and no time is left: let both bounds in")
            hint = hint if is_narrow else _swapped(one)
            self._reporter.error("C0401", message, one.low.span.to(one.high.span), hint)
            return
        if high is not None:
            self._at_most(earlier, later, high, one.span)
        if low is not None:
            self._at_most(later, earlier, -low, one.span)

    def _interval(self, one: model.Obligation, *, needs_time: bool) -> None:
        before = self._reporter.error_count
        start = moved(one.interval.start, self._symbols, self._reporter)
        end = moved(one.interval.end, self._symbols, self._reporter)
        if self._reporter.error_count > before:
            return
        if start[0] == end[0]:
            if start[1] >= end[1]:
                message = "expected an interval whose start is before its end, got one that is always empty"
                self._reporter.error("C0405", message, one.interval.span, "the earlier end comes first")
        elif needs_time:
            # Nothing holds "throughout" no time at all, and nothing happens in it: the start is before the end.
            self._at_most(end[0], start[0], end[1] - start[1] - 1, one.span)

    def _check_infinity(self, bound: model.Bound, *, is_low: bool) -> None:
        if bound.duration is None and bound.negative != is_low:
            wanted = "-oo or a duration as the lower bound" if is_low else "oo or a duration as the upper bound"
            came, mended = ("-oo", "oo") if bound.negative else ("oo", "-oo")
            hint = Hint(f"no bound on this side is written {mended}", mended)
            self._reporter.error("C0401", f"expected {wanted}, got {came}", bound.span, hint)

    def _at_most(self, source: str, target: str, weight_us: int, span: Span) -> None:
        self._edges.append(Edge(self._points.index(source), self._points.index(target), weight_us, span))


def _swapped(one: model.Range) -> Hint:
    """Suggest the bounds the other way round, with their brackets or signs where they stand."""
    between = f" <= {one.later.name} - {one.earlier.name} <= " if one.chained else ", "
    edit = print_bound(one.high) + between + print_bound(one.low)
    is_certain = not (one.low_open or one.high_open)
    return Hint("the smaller bound comes first", edit if is_certain else None)


def _report_cycle(chronicle: model.Chronicle, points: Sequence[str], edges: Sequence[Edge], reporter: Reporter) -> None:
    cycle = negative_cycle(len(points), edges)
    sentences = [f"{sentence(edge, points)} (line {edge.span.line})" for edge in cycle]
    message = f"the time constraints of {chronicle.name!r} contradict each other: " + "; ".join(sentences)
    first, *others = sorted(cycle, key=lambda edge: (edge.span.line, edge.span.column))
    related = [(edge.span, sentence(edge, points)) for edge in others if edge.span != first.span]
    reporter.error("C0501", message, first.span, _relaxation(cycle, points), related=related)


def _relaxation(cycle: Sequence[Edge], points: Sequence[str]) -> str:
    """Say by how much a contradiction misses, and mend the widest of its upper bounds, else its widest lower bound."""
    miss_us = -sum(edge.weight_us for edge in cycle)
    least_us = -sum(edge.weight_us for edge in cycle if edge.weight_us < 0)
    chosen = max(cycle, key=lambda edge: (edge.weight_us > 0, abs(edge.weight_us)))
    mended = replace(chosen, weight_us=chosen.weight_us + miss_us)
    return (
        f"the lower bounds sum up to {format_duration(least_us)}, the upper bounds to "
        f"{format_duration(least_us - miss_us)}: together they miss by {format_duration(miss_us)}; "
        f"relax one of them, for example line {chosen.span.line} to '{sentence(mended, points)}'"
    )


def _timing(points: tuple[str, ...], least: Distances, event_points: Collection[str]) -> Timing:
    """Tie each point to an event's point at a fixed distance; points that float are left out."""
    anchors = {name: (name, 0) for name in points if name in event_points}
    for index, name in enumerate(points):
        for other, event_point in enumerate(points):
            fixed = least[other][index] == -least[index][other]
            if name not in anchors and event_point in event_points and fixed:
                anchors[name] = (event_point, least[other][index])
    return Timing(points, least, anchors)


def _report_free(point: model.TimePoint, event_points: Sequence[str], reporter: Reporter) -> None:
    message = f"expected {point.name} to be the time of an event or at a fixed distance from one, got neither"
    near = suggest(point.name, event_points)
    example = Hint(f"add an event at {point.name}, or a constraint such as t1 - {point.name} in [1s, 1s]")
    reporter.error("C0403", message, point.span, example if near.edit is None else near)


def _check_bounded(
    chronicle: model.Chronicle, timing: Timing, event_points: Mapping[str, model.TimePoint], reporter: Reporter
) -> None:
    """Refuse a chronicle in which one event may come any time after another."""
    for start, end in product(event_points, event_points):
        if timing.most_us(start, end) >= UNBOUNDED_US:
            wanted = f"a bound on how long after {start} the event at {end} may come"
            message = f"an instance of {chronicle.name!r} could wait for ever: expected {wanted}, got none"
            hint = f"add a constraint such as {end} - {start} in [0s, 1min]"
            reporter.error("C0701", message, event_points[end].span, hint)
            return


def _warn_order(chronicle: model.Chronicle, timing: Timing, reporter: Reporter) -> None:
    if len(chronicle.points) < 2:
        return
    start, end = chronicle.points[0], chronicle.points[-1]
    if timing.most_us(end.name, start.name) > 0:
        message = f"the end {end.name} of {chronicle.name!r} may be before its start {start.name}"
        reporter.warning("C0406", message, end.span, f"add {start.name} <= {end.name}")


def _warn_turned(chronicle: model.Chronicle, timing: Timing, symbols: Symbols, reporter: Reporter) -> None:
    """Warn about intervals whose end may come before their start: they are empty then, and ask for nothing."""
    for one in chronicle.statements:
        if isinstance(one, model.NoEventStatement | model.AssertStatement):
            start, end = (moved(time, symbols, reporter) for time in (one.interval.start, one.interval.end))
            # (t1 + 1us, t2) leaves the first event out, and is meant to be empty where both come at once.
            most_us = timing.most_us(end[0], start[0])
            if most_us > 0 and most_us + start[1] - end[1] > 0:
                message = "expected an interval whose start is before its end, got one that may be turned round"
                hint = f"it is empty then and forbids nothing; add {start[0]} <= {end[0]}"
                reporter.warning("C0409", message, one.interval.span, hint)
