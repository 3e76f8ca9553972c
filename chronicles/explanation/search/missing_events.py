"""Which event would have been needed where one is missing, and what came instead?"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import replace

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.plan import EventTest
from chronicles.events import Event, by_time
from chronicles.explanation.case import Case
from chronicles.explanation.explanations import Mismatch, MissingEvent
from chronicles.explanation.search.assignments import Assignment, AssignmentSearch, Row, Values, rows_within
from chronicles.explanation.search.event_log import fields_of
from chronicles.language import model
from chronicles.language.printer import print_pattern


class MissingEventReader:
    """Describes the events that instances of one case lack."""

    def __init__(self, case: Case, chronicles: ChronicleSet, search: AssignmentSearch, window: tuple[int, int]) -> None:
        self._case = case
        self._chronicles = chronicles
        self._search = search
        self._window = window

    def read(self, assignment: Assignment, values: Values) -> tuple[MissingEvent, ...]:
        """Describe every missing event of an instance, in the order of the latest time it could have come."""
        places = [place for place, row in enumerate(assignment.rows) if row is None]
        found = [self._missing(assignment, values, place) for place in places]
        return tuple(sorted(found, key=lambda one: (one.latest_us is None, one.latest_us or 0, one.label)))

    def _missing(self, assignment: Assignment, values: Values, place: int) -> MissingEvent:
        plan = self._case.plan
        position = plan.positions[place]
        window = self._search.window(assignment, place, plan.distance_us)
        rows = [row for row in self._search.rows[place].having(values) if row.number not in assignment.numbers]
        outside, outside_us = (None, 0) if window is None else _nearest_outside(rows, window)
        other, mismatches = self._other(rows, place, values, window)
        return MissingEvent(
            label=position.label,
            pattern=_with_values(self._case.text.pattern_of(position), position.test, values),
            earliest_us=None if window is None else window[0],
            latest_us=None if window is None else window[1],
            outside=outside,
            outside_us=outside_us,
            other=other,
            mismatches=mismatches,
            emitters=tuple(one.name for one in self._chronicles.plans if position.test.name in one.produces),
        )

    def _other(
        self, rows: Sequence[Row], place: int, values: Values, window: tuple[int, int] | None
    ) -> tuple[Event | None, tuple[Mismatch, ...]]:
        """Find an event inside the window that is wrong in one value, or only equals where it must differ."""
        start_us, end_us = self._window
        if window is not None:
            inside = rows_within(rows, window)
            if inside:
                return inside[0].event, ()
            start_us, end_us = window[0], window[1] + 1
        test = self._case.plan.positions[place].test
        found = [
            (mismatches, event)
            for _, event in self._case.log.within(test.name, start_us, end_us)
            if (mismatches := mismatches_of(event, test, values)) is not None and len(mismatches) <= 1
        ]
        # The right things with another value are told rather than other things with the right value; of other things
        # only those that came when they were needed.
        same_things = [pair for pair in found if not any(one.field.startswith("argument") for one in pair[0])]
        chosen = same_things or ([] if window is None else found)
        return (chosen[0][1], chosen[0][0]) if chosen else (None, ())


def mismatches_of(event: Event, test: EventTest, values: Values) -> tuple[Mismatch, ...] | None:
    """List the fields of an event that have other values than a pattern wants.

    Returns
    -------
    None if the event has another shape, or no field of it is right by value.
    """
    fields = fields_of(event, test)
    if fields is None or (test.is_change and fields[-1] == fields[-2]):
        return None
    wanted = _wanted(test, values)
    wrong = [(field, text) for field, text in wanted.items() if fields[field] != text]
    wrong += [(field, "one of the values allowed") for field, allowed in test.filters if fields[field] not in allowed]
    wrong += [(second, fields[first]) for first, second in test.equal if fields[first] != fields[second]]
    if wrong and len(wrong) == len(wanted) + len(test.filters) + len(test.equal):
        return None
    return tuple(Mismatch(_field_name(field, test), text, fields[field]) for field, text in wrong)


def _wanted(test: EventTest, values: Values) -> dict[int, str]:
    """Give the fields that must have one value: constants, and variables whose value is known."""
    known = {field: value for field, slot in test.variables if (value := values[slot]) is not None}
    return dict(test.constants) | known


def _with_values(pattern: model.Pattern, test: EventTest, values: Values) -> str:
    """Write a pattern with the known values in place of its variables."""
    wanted = _wanted(test, values)
    wanted |= {second: wanted[first] for first, second in test.equal if first in wanted}
    terms = [
        model.Literal(wanted[field], False, span=term.span) if field in wanted else term
        for field, term in enumerate(pattern.terms)
    ]
    return print_pattern(replace(pattern, arguments=tuple(terms[: test.arity]), values=tuple(terms[test.arity :])))


def _field_name(field: int, test: EventTest) -> str:
    if field < test.arity:
        return f"argument {field + 1}"
    return "old value" if field == test.arity else "new value"


def _nearest_outside(rows: Sequence[Row], window: tuple[int, int]) -> tuple[Event | None, int]:
    """Give the row nearest to a window, and how far it is after it (negative: before it)."""
    before = rows[: bisect_left(rows, window[0], key=by_time)]
    after = rows[bisect_right(rows, window[1], key=by_time) :]
    choices = [(before[-1], before[-1].t_us - window[0])] if before else []
    choices += [(after[0], after[0].t_us - window[1])] if after else []
    if not choices:
        return None, 0
    row, by_us = min(choices, key=lambda pair: abs(pair[1]))
    return row.event, by_us
