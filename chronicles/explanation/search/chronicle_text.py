"""What does the text of a chronicle say about time, and how does it read with one bound changed?

The plan keeps only the minimal network. What people wrote is read from the canonical text that `ChronicleSet` keeps; it
has the same statements in the same order as the text that was loaded, in which lines count.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.names.symbols import collect_symbols
from chronicles.compilation.plan import Plan, Position
from chronicles.compilation.times.timing import closed_bounds_us, difference, offset_us
from chronicles.language import model
from chronicles.language.parser import parse
from chronicles.language.printer import print_file, print_pattern, print_statement
from dyknow.language.diagnostics import Reporter
from dyknow.language.places import Span

End = Literal["low", "high"]


@dataclass(frozen=True, slots=True)
class WrittenConstraint:
    """A time constraint at `place` among the statements: `later - earlier` in [low_us, high_us], None is unbounded."""

    place: int
    line: int
    text: str
    later: str
    earlier: str
    low_us: int | None
    high_us: int | None

    @property
    def ends(self) -> list[End]:
        """The ends at which it has a bound."""
        both: dict[End, int | None] = {"low": self.low_us, "high": self.high_us}
        return [end for end, bound_us in both.items() if bound_us is not None]

    def bound_us(self, end: End) -> int:
        """Give a bound that the constraint has."""
        bound_us = self.low_us if end == "low" else self.high_us
        assert bound_us is not None, f"{self.text!r} has no {end} bound"
        return bound_us

    def value_us(self, plan: Plan, times: Sequence[int | None]) -> int | None:
        """Give what `later - earlier` is with these times of the positions, None where an event is missing."""
        points = dict(plan.points)
        later, earlier = points[self.later], points[self.earlier]
        later_us, earlier_us = times[later.position], times[earlier.position]
        if later_us is None or earlier_us is None:
            return None
        return later_us + later.offset_us - earlier_us - earlier.offset_us


class ChronicleText:
    """The canonical text of one chronicle as a tree.

    Attributes
    ----------
    file : the name of the text that was loaded.
    chronicle : its tree.
    constraints : its time constraints in the order of the text.
    """

    def __init__(self, chronicles: ChronicleSet, name: str) -> None:
        text = dict(chronicles.texts)[name]
        self._reporter = Reporter({name: text})
        self._file = parse(text, name, self._reporter)
        self._symbols = collect_symbols([self._file], self._reporter)
        places = dict(chronicles.statement_places)[name]
        self.file, self._lines = places[0][0], [line for _, line in places]
        last = self._file.declarations[-1]
        assert isinstance(last, model.Chronicle), "the canonical text ends with its chronicle"
        self.chronicle = last
        self.constraints = tuple(self._constraints())
        assert not self._reporter.errors, "the canonical text of an accepted chronicle has no errors"

    def place_of(self, text: str) -> int:
        """Find a statement by its canonical text."""
        return next(place for place, one in enumerate(self.chronicle.statements) if print_statement(one) == text)

    def line_of(self, place: int) -> int:
        """Give the line of a statement in the text that was loaded."""
        return self._lines[place]

    def pattern_of(self, position: Position) -> model.Pattern:
        """Find the pattern of an event by its canonical text."""
        patterns = (one.pattern for one in self.chronicle.statements if isinstance(one, model.EventStatement))
        return next(one for one in patterns if print_pattern(one) == position.pattern)

    def with_statement(self, place: int, statement: model.Statement) -> str:
        """Write the whole text with another statement at a place."""
        statements = self.chronicle.statements
        changed = replace(self.chronicle, statements=(*statements[:place], statement, *statements[place + 1 :]))
        return print_file(replace(self._file, declarations=(*self._file.declarations[:-1], changed)))

    def loosened(self, constraint: WrittenConstraint, end: End, by_us: int) -> model.Statement:
        """Write a constraint with one bound further out; an equation gets room on both sides."""
        one = self._bounded(constraint)
        if isinstance(one, model.Comparison) and one.comparator == "=":
            middle = offset_us(one.offset, self._symbols, self._reporter)
            low, high = (_bound(middle + shift, one.span) for shift in (-by_us, by_us))
            return model.Range(one.left, one.right, low, False, high, False, False, span=one.span)
        return self.with_bound(constraint, end, constraint.bound_us(end) + (by_us if end == "high" else -by_us))

    def with_bound(self, constraint: WrittenConstraint, end: End, bound_us: int) -> model.Statement:
        """Write a constraint with another bound; `bound_us` is closed, the brackets stay as they are."""
        one = self._bounded(constraint)
        if isinstance(one, model.Comparison):
            written_us = bound_us + {"<": 1, ">": -1}.get(one.comparator, 0)
            return replace(one, offset=_bound(written_us, one.span) if written_us else None)
        if end == "low":
            return replace(one, low=_bound(bound_us - one.low_open, one.span))
        return replace(one, high=_bound(bound_us + one.high_open, one.span))

    def with_shift(self, place: int, *, is_start: bool, by_us: int) -> model.Statement:
        """Write an obligation with one end of its interval moved."""
        one = self.chronicle.statements[place]
        assert isinstance(one, model.Obligation)
        time = one.interval.start if is_start else one.interval.end
        offset = offset_us(time.offset, self._symbols, self._reporter) + by_us
        moved = replace(time, offset=_bound(offset, time.span) if offset else None)
        interval = replace(one.interval, start=moved) if is_start else replace(one.interval, end=moved)
        return replace(one, interval=interval)

    def is_about_one_point(self, place: int) -> bool:
        """Say whether both ends of an obligation's interval hang on one time point."""
        one = self.chronicle.statements[place]
        assert isinstance(one, model.Obligation)
        return one.interval.start.point == one.interval.end.point

    def _bounded(self, constraint: WrittenConstraint) -> model.TimeConstraint:
        one = self.chronicle.statements[constraint.place]
        assert isinstance(one, model.TimeConstraint)
        return one

    def _constraints(self) -> Iterator[WrittenConstraint]:
        for place, one in enumerate(self.chronicle.statements):
            if isinstance(one, model.TimeConstraint):
                bounds = closed_bounds_us(one, self._symbols, self._reporter)
                yield WrittenConstraint(place, self._lines[place], print_statement(one), *difference(one), *bounds)


def _bound(us: int, span: Span) -> model.Bound:
    return model.Bound(us < 0, model.Duration(abs(us), "", span=span), span=span)
