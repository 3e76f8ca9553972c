"""How are the parts of a checked chronicle numbered?

Events, variables and time points are sorted by what they are, so that the plan does not depend on the order in which
the text lists them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from chronicles.compilation.names.patterns import Cell, Cells
from chronicles.compilation.names.symbols import Symbols
from chronicles.compilation.names.usage import VARIABLE
from chronicles.compilation.names.variables import Variables
from chronicles.compilation.obligations import ObligationBuilder, event_test
from chronicles.compilation.plan import Anchor, Emission, EventTest, Filling, Plan, Position, ReportPart, Selection
from chronicles.compilation.times.timing import Timing, moved
from chronicles.language import model
from chronicles.language.printer import print_pattern
from dyknow.language.diagnostics import Reporter


@dataclass(frozen=True, slots=True)
class Resolved:
    """A chronicle and its statements with their patterns looked up."""

    chronicle: model.Chronicle
    events: Sequence[tuple[model.EventStatement, Cells]]
    counts: Sequence[tuple[model.CountStatement, Cells]]
    holds: Sequence[tuple[model.HoldStatement, Cells]]
    asserts: Sequence[tuple[model.AssertStatement, Cells]]
    emits: Sequence[tuple[model.Emit | model.AssertAction, Cells]]
    selection: model.SelectStatement | None


class Assembly:
    """Numbers the parts of one chronicle that has no errors so far."""

    def __init__(
        self, resolved: Resolved, variables: Variables, timing: Timing, symbols: Symbols, reporter: Reporter
    ) -> None:
        self._resolved = resolved
        self._chronicle = resolved.chronicle
        self._variables = variables
        self._timing = timing
        self._symbols = symbols
        self._reporter = reporter
        by_event = sorted(_free_classes(resolved.events, variables))
        by_hold = sorted(_free_classes(resolved.holds, variables) - set(by_event))
        self._event_slot_count = len(by_event)
        self._slots = tuple(by_event + by_hold)
        self._slot_of = {name: slot for slot, name in enumerate(self._slots)}
        self._events = sorted(resolved.events, key=lambda pair: (print_pattern(pair[0].pattern), pair[0].point.name))
        self._position_of = {one.point.name: index for index, (one, _) in reversed([*enumerate(self._events)])}
        names = [one.point.name for one, _ in self._events]
        self._distance_us = tuple(tuple(timing.most_us(name, other) for other in names) for name in names)
        self._build_obligations()

    def _build_obligations(self) -> None:
        resolved = self._resolved
        builder = ObligationBuilder(self._variables, self._slots, self._event_slot_count, self._reporter)
        counts = [builder.count(one, cells, self._window(one.interval)) for one, cells in resolved.counts]
        holds = builder.holds((one, cells, self._window(one.interval)) for one, cells in resolved.holds)
        asserts = [builder.assumption(one, cells, self._window(one.interval)) for one, cells in resolved.asserts]
        asserts += [
            builder.reading(one, cells, self._moved(one.time))
            for one, cells in resolved.emits
            if isinstance(one, model.AssertAction)
        ]
        builder.check_differences(self._chronicle, [cells for _, cells in resolved.counts])
        self._counts = tuple(sorted(counts, key=lambda count: count.text))
        self._persistences = holds + tuple(sorted(asserts, key=lambda one: one.text))
        self._ends = [Anchor(index, 0) for index in range(len(self._events))]
        self._ends += [one.end for one in self._counts] + [one.end for one in self._persistences]
        is_ordered = resolved.selection is not None and resolved.selection.kind != "all"
        self._settling_us = int(is_ordered or any(isinstance(one, model.AssertAction) for one, _ in resolved.emits))

    def plan(self, version: str) -> Plan:
        """Put the plan together; an emission without a time, or a count that can never be right, is an error."""
        chronicle, timing = self._chronicle, self._timing
        self._check_counts()
        self._check_holds()
        positions = tuple(self._position(one, cells) for one, cells in self._events)
        header = [self._anchor(timing.anchors[point.name]) for point in chronicle.points]
        starts = [one.start for one in self._counts] + [one.start for one in self._persistences]
        return Plan(
            name=chronicle.name,
            version=version,
            positions=positions,
            distance_us=self._distance_us,
            slots=self._slots,
            event_slot_count=self._event_slot_count,
            different=self._different_slots(),
            counts=self._counts,
            persistences=tuple(replace(one, lag_us=self._after_us(one.end)) for one in self._persistences),
            points=tuple((name, self._anchor(timing.anchors[name])) for name in timing.points),
            start=header[0] if header else None,
            end=header[-1] if header else None,
            roles=tuple((one.name, self._filling(one.name)) for one in chronicle.parameters),
            emissions=tuple(self._emission(one, cells) for one, cells in self._resolved.emits),
            reports=tuple(self._report(one) for one in chronicle.actions if isinstance(one, model.Report)),
            is_symmetric=_is_symmetric([position.test for position in positions]),
            tail_us=max(self._after_us(Anchor(index, 0)) for index in range(len(positions))),
            delay_us=max(0, min(map(self._after_us, header or [Anchor(index, 0) for index in range(len(positions))]))),
            memory_us=max(map(self._after_us, starts), default=0),
            selection=self._selection(header),
            settling_us=self._settling_us,
            floor=max((one.least for one in chronicle.of(model.ConfidenceStatement)), default=0.0),
        )

    def _check_counts(self) -> None:
        """Refuse a noevent or occurs that forbids events which the chronicle itself needs."""
        for one, cells in self._resolved.counts:
            start, end = self._window(one.interval)
            own = [
                event.point.name
                for index, (event, event_cells) in enumerate(self._events)
                if self._between_us(Anchor(index, 0), start) <= 0
                and self._between_us(end, Anchor(index, 0)) < 0
                and _covers(cells, event_cells, self._variables)
            ]
            if one.most is not None and len(own) > one.most:
                word = "a noevent" if isinstance(one, model.NoEventStatement) else "an occurs"
                events = f"the event at {own[0]}" if len(own) == 1 else f"the events at {' and '.join(sorted(own))}"
                message = f"expected {word} that can be true, got one that forbids {events} itself"
                hint = f"let its interval start after that event: ({own[-1]} + 1us, ...)"
                self._reporter.error("C0502", message, one.span, hint)

    def _check_holds(self) -> None:
        """Refuse a hold of a value that an event of the chronicle changes at its start, in it or at its end."""
        for one, cells in self._resolved.holds:
            for index, (event, event_cells) in enumerate(self._events):
                if event_cells.name != cells.name or len(event_cells.values) != 2:
                    continue
                start, end, at = *self._window(one.interval), Anchor(index, 0)
                after = at == start or (self._between_us(at, start) <= 0 and self._between_us(end, at) < 0)
                before = at == end or (self._between_us(at, start) < 0 and self._between_us(end, at) <= 0)
                sides = [value for value, is_asked in zip((0, 1), (before, after), strict=True) if is_asked]
                held = self._contradicted(cells, event_cells, sides)
                if held:
                    message = f"expected a hold that can be true, got {held[0]!r} where the event at {event.point.name}"
                    said = f" {'leaves' if held[2] else 'starts from'} {held[1]!r}"
                    hint = f"hold the value {held[1]!r}, or an interval without that event"
                    related = [(event.span, f"the event: {print_pattern(event.pattern)}")]
                    self._reporter.error("C0503", message + said, one.span, hint, related=related)

    def _contradicted(self, hold: Cells, event: Cells, sides: Sequence[int]) -> tuple[str, str, int] | None:
        """Give the value of a hold, another one that a change has on a side, and that side: 0 before, 1 after."""
        content = self._variables.content
        if [*map(content, hold.arguments)] != [*map(content, event.arguments)]:
            return None
        held = content(hold.values[0])
        for side in sides:
            given = content(event.values[side])
            if held[0] == given[0] == "constant" and held != given:
                return held[1], given[1], side
        return None

    def _selection(self, header: Sequence[Anchor]) -> Selection:
        one = self._resolved.selection
        if one is None or one.kind == "all":
            return Selection()
        if one.anchor is not None:
            return Selection(one.kind, self._position_of[one.anchor.name])
        extremes = header or [Anchor(index, 0) for index in range(len(self._events))]
        return Selection(one.kind, reach_us=max(0, *map(self._after_us, extremes)))

    def _position(self, one: model.EventStatement, cells: Cells) -> Position:
        return Position(one.point.name, event_test(cells, self._variables, self._slot_of), print_pattern(one.pattern))

    def _different_slots(self) -> tuple[tuple[int, int], ...]:
        slots = combinations(enumerate(self._slots[: self._event_slot_count]), 2)
        return tuple((one, two) for (one, left), (two, right) in slots if self._variables.must_differ(left, right))

    def _window(self, interval: model.Interval) -> tuple[Anchor, Anchor]:
        return self._moved(interval.start), self._moved(interval.end)

    def _moved(self, time: model.TimeExpression) -> Anchor:
        name, offset_us = moved(time, self._symbols, self._reporter)
        point, fixed_us = self._timing.anchors[name]
        return self._anchor((point, fixed_us + offset_us))

    def _anchor(self, anchor: tuple[str, int]) -> Anchor:
        return Anchor(self._position_of[anchor[0]], anchor[1])

    def _filling(self, variable: str) -> Filling:
        name = self._variables.class_of[variable]
        if name in self._variables.constants:
            return Filling(-1, self._variables.constants[name])
        return Filling(self._slot_of[name])

    def _emission(self, one: model.Emit | model.AssertAction, cells: Cells) -> Emission:
        arguments, values = ([self._cell_filling(cell) for cell in part] for part in (cells.arguments, cells.values))
        time = self._emission_time(one)
        is_assertion = isinstance(one, model.AssertAction)
        if is_assertion:
            values.insert(0, Filling(-1))
        change = (values[0], values[1]) if values else None
        delay_us = max(0, self._after_us(time))
        return Emission(cells.name, tuple(arguments), change, time, delay_us, is_assertion)

    def _cell_filling(self, cell: Cell) -> Filling:
        return self._filling(cell.variable) if cell.variable else Filling(-1, cell.constant or "")

    def _emission_time(self, one: model.Emit | model.AssertAction) -> Anchor:
        if one.time is not None:
            return self._moved(one.time)
        if self._chronicle.points:
            return self._anchor(self._timing.anchors[self._chronicle.points[-1].name])
        message = "expected a time for the emitted event, got none and no time point in the head of"
        self._reporter.error("C0407", f"{message} {self._chronicle.name!r}", one.span, "write emit event(..., t1)")
        return Anchor(0, 0)

    def _after_us(self, start: Anchor) -> int:
        """Bound how long after a time of an instance the instance can still be concluded."""
        return max(self._between_us(start, end) for end in self._ends) + self._settling_us

    def _between_us(self, start: Anchor, end: Anchor) -> int:
        return self._distance_us[start.position][end.position] + end.offset_us - start.offset_us

    def _report(self, one: model.Report) -> tuple[ReportPart, ...]:
        known = {*self._slot_of, *self._variables.constants}
        names = [name for name, root in self._variables.class_of.items() if root in known]
        return _report_parts(one.text, {name: self._filling(name) for name in names})


def _covers(cells: Cells, event: Cells, variables: Variables) -> bool:
    """Say whether every event that fits one pattern of an instance fits the other too."""
    if (cells.name, len(cells.arguments), len(cells.values)) != (event.name, len(event.arguments), len(event.values)):
        return False
    pairs = zip(cells.all, event.all, strict=True)
    return all(variables.content(one) in (("anything", ""), variables.content(other)) for one, other in pairs)


def _free_classes(pairs: Iterable[tuple[object, Cells]], variables: Variables) -> set[str]:
    found = {variables.class_of[cell.variable] for _, cells in pairs for cell in cells.all if cell.variable}
    return found - variables.constants.keys()


def _report_parts(text: str, fillings: Mapping[str, Filling]) -> tuple[ReportPart, ...]:
    """Cut a text at its ?variables; what is no variable stays as it is."""
    pieces = enumerate(VARIABLE.split(text))
    parts = [piece if index % 2 == 0 else fillings.get(piece, f"?{piece}") for index, piece in pieces]
    return tuple(part for part in parts if part != "")


def _is_symmetric(tests: Sequence[EventTest]) -> bool:
    """Say whether one event could pass two of the tests."""
    for first, second in combinations(tests, 2):
        same = (first.name, first.arity, first.is_change) == (second.name, second.arity, second.is_change)
        values = dict(first.constants)
        if same and all(values.get(field, text) == text for field, text in second.constants):
            return True
    return False
