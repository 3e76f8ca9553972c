"""Which values were seen where a chronicle asks for one, and how far was it from enough?

Where a `hold` may give a variable its value, every value is read.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import Persistence
from chronicles.events import Event
from chronicles.explanation.explanations import HoldReading, Outcome, Shift, ValueSpan
from chronicles.explanation.readings.intervals import Place, Times, Window, cost_of, least, smallest_first, window_of
from chronicles.explanation.search.assignments import Values
from chronicles.explanation.search.event_log import Args, EventLog


class HoldReader:
    """Reads one `hold` or `assert`; slots from `event_slot_count` on are bound by holds."""

    def __init__(self, one: Persistence, event_slot_count: int, place: Place, log: EventLog) -> None:
        self._one = one
        self._event_slot_count = event_slot_count
        self._place = place
        self._log = log
        self._needed = [slot for _, slot in one.bound]
        self._not_asked = HoldReading(kind="assert" if one.is_assumed else "hold", text=one.text, line=place.line)

    def readings(self, times: Times, values: Values) -> Iterator[tuple[Values, HoldReading]]:
        """Give every way to read the statement with the values it binds, the cheapest first."""
        window = window_of(self._one.start, self._one.end, times)
        if window is None or any(values[slot] is None for slot in self._needed):
            yield values, self._not_asked
            return
        found = [
            (extended, reading)
            for args in self._candidates(values)
            for extended, reading in self._of_fluent(args, values, window)
        ]
        if not found:
            args = tuple("?" if text is None else text for text in self._known(values))
            found = list(self._of_fluent(args, values, window))
        if len(found) > 1:
            found.sort(key=lambda pair: (cost_of(pair[1]), pair[1].subject))
        yield from found

    def with_alternatives(self, reading: HoldReading, times: Times, values: Values) -> HoldReading:
        """Add what held with other values of the variables that holds bind."""
        window = window_of(self._one.start, self._one.end, times)
        if reading.outcome != "failed" or window is None:
            return reading
        known = {place: text for place, text in enumerate(self._known(values)) if text is not None}
        for place, slot in (*self._one.bound, *self._one.binds):
            if slot >= self._event_slot_count:
                known.pop(place, None)
        if len(known) == self._one.arity:
            return reading
        found = [
            f"{self._one.attribute}[{', '.join(args)}]"
            for args in self._log.fluents(self._one.attribute, known, self._one.arity)
            if all(
                self._fits(span.value, reading.wanted)
                for span in self._log.timeline(self._one.attribute, args).spans(*window)
            )
        ]
        return replace(reading, alternatives=tuple(sorted(found)))

    def evidence(self, values: Values) -> list[Event]:
        """Give all changes of the fluents that the statement may be about."""
        return [event for args in self._candidates(values) for event in self._log.changes(self._one.attribute, args)]

    def _known(self, values: Values) -> list[str | None]:
        one = self._one
        args: list[str | None] = [None] * one.arity
        for place, text in one.constants:
            args[place] = text
        for place, slot in (*one.bound, *one.binds):
            args[place] = values[slot]
        return args

    def _candidates(self, values: Values) -> Iterable[Args]:
        one = self._one
        args = self._known(values)
        known = {place: text for place, text in enumerate(args) if text is not None}
        if len(known) == one.arity:
            return [tuple(known[place] for place in range(one.arity))]
        fluents = self._log.fluents(one.attribute, known, one.arity)
        return [args for args in fluents if all(args[first] == args[second] for first, second in one.equal)]

    def _of_fluent(self, args: Args, values: Values, window: Window) -> Iterator[tuple[Values, HoldReading]]:
        one = self._one
        bound = list(values)
        for place, slot in one.binds:
            bound[slot] = args[place] if args[place] != "?" else None
        spans = self._log.timeline(one.attribute, args).spans(window[0], min(window[1], self._log.until_us + 1))
        for wanted in self._wanted(spans, values):
            if one.value_binds >= 0:
                bound[one.value_binds] = wanted
            if self._is_allowed(bound):
                yield tuple(bound), self._read(args, wanted, spans, window)

    def _wanted(self, spans: Sequence[ValueSpan], values: Values) -> list[str | None]:
        one = self._one
        fixed = one.value
        for slot in (one.value_slot, one.value_binds):
            fixed = values[slot] if fixed is None and slot >= 0 else fixed
        if fixed is not None:
            return [fixed]
        seen = dict.fromkeys(span.value for span in spans if span.value != UNKNOWN or not one.needs_known)
        return list(seen) or [None]

    def _is_allowed(self, values: Sequence[str | None]) -> bool:
        one = self._one
        return all((value := values[slot]) is None or value in allowed for slot, allowed in one.filters) and all(
            values[slot] is None or values[slot] != values[other] for slot, other in one.different
        )

    def _fits(self, value: str, wanted: str | None) -> bool:
        if value == UNKNOWN and self._one.is_assumed:
            return True
        return value == wanted and not (value == UNKNOWN and self._one.needs_known)

    def _read(self, args: Args, wanted: str | None, spans: Sequence[ValueSpan], window: Window) -> HoldReading:
        one, (start_us, end_us) = self._one, window
        may_be_empty = one.is_assumed and start_us >= end_us
        bad = [] if may_be_empty else [span for span in spans if not self._fits(span.value, wanted)]
        reported_us = self._log.timeline(one.attribute, args).reported_us
        is_reported = not one.needs_report or (reported_us is not None and reported_us <= start_us)
        outcome: Outcome = "open" if end_us > self._log.until_us else "met"
        outcome = "failed" if bad or not is_reported else outcome
        first_us = start_us if is_reported else reported_us
        shifts = () if outcome == "met" else self._shifts(bad, first_us, window)
        slack_us = least([_minus(start_us, spans[0].start_us), _minus(spans[-1].end_us, end_us)])
        return replace(
            self._not_asked,
            outcome=outcome,
            start_us=start_us,
            end_us=end_us,
            subject=f"{one.attribute}[{', '.join(args)}]",
            wanted=wanted,
            spans=tuple(spans),
            slack_us=slack_us if outcome == "met" else None,
            shifts=shifts,
        )

    def _shifts(self, bad: Sequence[ValueSpan], first_us: int | None, window: Window) -> tuple[Shift, ...]:
        """List the moves of one end after which only fitting values are left; `first_us`: when it was reported."""
        (start_us, end_us), until_us = window, self._log.until_us
        found = []
        # Only an assert is content with an empty interval.
        least_us = 0 if self._one.is_assumed and not self._place.is_one_point else 1
        if first_us is not None and end_us <= until_us:
            later_us = max([first_us, *(end_us if one.end_us is None else one.end_us for one in bad[-1:])])
            later_us = min(later_us, end_us) if least_us == 0 else later_us
            if start_us < later_us <= end_us - least_us:
                found.append(Shift("start", later_us - start_us))
        if first_us == start_us:
            earlier_us = min([until_us, *(start_us if one.start_us is None else one.start_us for one in bad[:1])])
            earlier_us = max(earlier_us, min(start_us, until_us)) if least_us == 0 else earlier_us
            if earlier_us < end_us and (least_us == 0 or start_us < earlier_us):
                found.append(Shift("end", earlier_us - end_us))
        return smallest_first(found)


def _minus(left_us: int | None, right_us: int | None) -> int | None:
    return None if left_us is None or right_us is None else left_us - right_us
