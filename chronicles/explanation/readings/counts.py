"""How many events were seen where a chronicle asks for none or for some, and how far was it from enough?"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

from chronicles.compilation.plan import Count
from chronicles.events import Event, by_time
from chronicles.explanation.explanations import CountReading, ObligationKind, Outcome, Shift
from chronicles.explanation.readings.intervals import Place, Times, Window, least, smallest_first, window_of
from chronicles.explanation.search.assignments import Values
from chronicles.explanation.search.event_log import EventLog


class CountReader:
    """Reads one `noevent` or `occurs`."""

    def __init__(self, one: Count, place: Place, log: EventLog) -> None:
        self._one = one
        self._place = place
        self._until_us = log.until_us
        self._events = log.counted(one)
        kind: ObligationKind = "noevent" if one.text.startswith("noevent") else "occurs"
        self._not_asked = CountReading(kind=kind, text=one.text, line=place.line, least=one.least, most=one.most)

    def read(self, times: Times, values: Values) -> CountReading:
        """Count the events in the interval that the times give."""
        window = window_of(self._one.start, self._one.end, times)
        if window is None or any(values[slot] is None for slot in self._events.slots):
            return self._not_asked
        start_us, end_us = window
        events = self.evidence(values)
        first = bisect_left(events, start_us, key=by_time)
        last = max(first, bisect_left(events, end_us, key=by_time))
        before, inside, after = events[:first], events[first:last], events[last:]
        outcome = self._outcome(len(inside), end_us)
        return replace(
            self._not_asked,
            outcome=outcome,
            start_us=start_us,
            end_us=end_us,
            counted=tuple(inside),
            before=before[-1] if before else None,
            after=after[0] if after else None,
            slack_us=self._slack_us(before, inside, after, window) if outcome == "met" else None,
            shifts=() if outcome == "met" else self._shifts(before, inside, after, window),
        )

    def evidence(self, values: Values) -> list[Event]:
        """Give all events that the statement counts, at any time."""
        return self._events.fitting(tuple(["" if text is None else text for text in values]))

    def _outcome(self, count: int, end_us: int) -> Outcome:
        if self._one.most is not None and count > self._one.most:
            return "failed"
        if end_us > self._until_us:
            return "open"
        return "failed" if count < self._one.least else "met"

    def _slack_us(
        self, before: Sequence[Event], inside: Sequence[Event], after: Sequence[Event], window: Window
    ) -> int | None:
        """How far one end could move before there are too few or too many."""
        one, (start_us, end_us), slacks = self._one, window, list[int | None]()
        if one.most is not None:
            spare = one.most - len(inside)
            slacks += [start_us - 1 - before[-1 - spare].t_us] if len(before) > spare else []
            slacks += [after[spare].t_us - end_us] if len(after) > spare else []
        if one.least:
            spare = len(inside) - one.least
            slacks += [inside[spare].t_us - start_us, end_us - 1 - inside[-1 - spare].t_us]
        return least(slacks)

    def _shifts(
        self, before: Sequence[Event], inside: Sequence[Event], after: Sequence[Event], window: Window
    ) -> tuple[Shift, ...]:
        """List the moves of one end that make the count right; ties may spoil one, so each is counted again."""
        one, (start_us, end_us), until_us = self._one, window, self._until_us
        starts, ends = list[int](), list[int]()
        lack, excess = one.least - len(inside), 0 if one.most is None else len(inside) - one.most
        if excess > 0:
            starts.append(inside[excess - 1].t_us + 1)
            ends.append(inside[-excess].t_us)
        elif end_us > until_us:
            ends.append(until_us)
        elif lack > 0:
            starts += [before[-lack].t_us] if len(before) >= lack else []
            ends += [after[lack - 1].t_us + 1] if len(after) >= lack else []
        events = [*before, *inside, *after]
        moves = [Shift("start", t_us - start_us) for t_us in starts] + [Shift("end", t_us - end_us) for t_us in ends]
        return smallest_first([one for one in moves if self._is_right(events, _moved(window, one))])

    def _is_right(self, events: Sequence[Event], window: Window) -> bool:
        start_us, end_us = window
        if end_us > self._until_us or (start_us >= end_us and self._place.is_one_point):
            return False
        count = bisect_left(events, end_us, key=by_time) - bisect_left(events, start_us, key=by_time)
        return self._one.least <= max(count, 0) and (self._one.most is None or count <= self._one.most)


def _moved(window: Window, shift: Shift) -> Window:
    start_us, end_us = window
    return (start_us + shift.by_us, end_us) if shift.side == "start" else (start_us, end_us + shift.by_us)
