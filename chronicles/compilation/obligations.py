"""What must a recogniser test for each event pattern, `noevent`, `occurs`, `hold` and `assert`?

Turns looked-up patterns into the tests of `plan.py`. A `noevent` or `occurs` may have variables of its own, which stand
for "any other"; a `hold` may give variables their values, so holds are put into an order in which each knows as much as
it can. An `assert` only tests, so it comes last.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

from chronicles.compilation.names.domains import ANY_VALUE
from chronicles.compilation.names.patterns import Cell, Cells
from chronicles.compilation.names.variables import Variables
from chronicles.compilation.plan import Anchor, Count, EventTest, Persistence
from chronicles.language import model
from chronicles.language.printer import print_statement
from dyknow.language.diagnostics import Reporter

Window = tuple[Anchor, Anchor]


def event_test(cells: Cells, variables: Variables, slot_of: Mapping[str, int]) -> EventTest:
    """Make the test of a pattern on a single event."""
    first: dict[str, int] = {}
    equal: list[tuple[int, int]] = []
    constants: list[tuple[int, str]] = []
    for index, cell in enumerate(cells.all):
        constant = _constant(cell, variables)
        if constant is not None:
            constants.append((index, constant))
        elif cell.variable:
            name = variables.class_of[cell.variable]
            if first.setdefault(name, index) != index:
                equal.append((first[name], index))
    return EventTest(
        name=cells.name,
        arity=len(cells.arguments),
        is_change=bool(cells.values),
        constants=tuple(constants),
        filters=tuple(
            (index, variables.allowed[name]) for name, index in first.items() if _is_limited(name, variables)
        ),
        equal=tuple(equal),
        different=_different_fields(cells, variables),
        variables=tuple(sorted((index, slot_of[name]) for name, index in first.items() if name in slot_of)),
    )


def _different_fields(cells: Cells, variables: Variables) -> tuple[tuple[int, int], ...]:
    """List the pairs of fields whose variables must differ."""
    pairs = combinations(_first_fields(cells, variables).items(), 2)
    return tuple((one, other) for (left, one), (right, other) in pairs if variables.must_differ(left, right))


class ObligationBuilder:
    """Builds the counts and persistences of one chronicle."""

    def __init__(self, variables: Variables, slots: Sequence[str], event_slot_count: int, reporter: Reporter) -> None:
        self._variables = variables
        self._slots = slots
        self._slot_of = {name: slot for slot, name in enumerate(slots)}
        self._event_slot_count = event_slot_count
        self._reporter = reporter

    def count(self, one: model.CountStatement, cells: Cells, window: Window) -> Count:
        """Make the plan of a `noevent` or an `occurs`."""
        test = event_test(cells, self._variables, self._slot_of)
        different = tuple(
            (field, slot)
            for name, field in _first_fields(cells, self._variables).items()
            for slot, other in enumerate(self._slots)
            if name not in self._slot_of and self._variables.must_differ(name, other)
        )
        return Count(test, *window, different, print_statement(one), one.least, one.most)

    def assumption(self, one: model.AssertStatement, cells: Cells, window: Window) -> Persistence:
        """Make the plan of an `assert` statement, which knows all variables and gives none a value."""
        built = self._persistence(print_statement(one), cells, window, set(range(len(self._slots))))
        return replace(built, needs_report=False, needs_known=False, is_assumed=True)

    def reading(self, one: model.AssertAction, cells: Cells, time: Anchor) -> Persistence:
        """Make what an `assert` action asks the past for: any value at the time at which it sets one."""
        interval = model.Interval(one.time, one.time, span=one.span)
        text = print_statement(model.AssertStatement(one.pattern, interval, span=one.span))
        window = time, replace(time, offset_us=time.offset_us + 1)
        built = self._persistence(text, cells, window, set(range(len(self._slots))))
        return replace(built, needs_report=False, needs_known=False, value=None, value_slot=-1, is_reading=True)

    def holds(self, stated: Iterable[tuple[model.HoldStatement, Cells, Window]]) -> tuple[Persistence, ...]:
        """Make the plans of holds in an order: those that only check come first, then those that search least."""
        known = set(range(self._event_slot_count))
        waiting = sorted(
            ((print_statement(one), cells, window) for one, cells, window in stated), key=lambda parts: parts[0]
        )
        done: list[Persistence] = []
        while waiting:
            built = [self._persistence(*parts, known) for parts in waiting]
            best = min(range(len(built)), key=lambda index: (_search_size(built[index]), index))
            chosen = built[best]
            known.update(slot for _, slot in chosen.binds)
            known.update({chosen.value_binds} - {-1})
            done.append(chosen)
            del waiting[best]
        return tuple(done)

    def check_differences(self, chronicle: model.Chronicle, counted: Sequence[Cells]) -> None:
        """Refuse `?x != ?y` between variables that are never known together."""
        groups = [set(_first_fields(cells, self._variables)) for cells in counted]
        for one in chronicle.statements:
            if not isinstance(one, model.Equality) or one.equal or not isinstance(one.term, model.Variable):
                continue
            pair = {self._variables.class_of[one.variable.name], self._variables.class_of[one.term.name]}
            own = pair - self._slot_of.keys() - self._variables.constants.keys()
            if len(own) == 2 and not any(pair <= group for group in groups):
                message = f"expected variables known together, got ?{one.variable.name} and ?{one.term.name}"
                self._reporter.error("C0803", message, one.span, "each stands in a noevent or occurs of its own")

    def _persistence(self, text: str, cells: Cells, window: Window, known: set[int]) -> Persistence:
        constants: list[tuple[int, str]] = []
        bound: list[tuple[int, int]] = []
        binds: dict[int, int] = {}
        equal: list[tuple[int, int]] = []
        for index, cell in enumerate(cells.arguments):
            constant, slot = _constant(cell, self._variables), self._slot(cell)
            if constant is not None:
                constants.append((index, constant))
            elif slot in known:
                bound.append((index, slot))
            elif slot >= 0 and binds.setdefault(slot, index) != index:
                equal.append((binds[slot], index))
        value_cell = cells.values[0]
        value_slot = self._slot(value_cell)
        value_known = value_slot in known or value_slot in binds
        new = [*binds, *([value_slot] if value_slot >= 0 and not value_known else [])]
        return Persistence(
            attribute=cells.name,
            arity=len(cells.arguments),
            start=window[0],
            end=window[1],
            constants=tuple(constants),
            bound=tuple(bound),
            binds=tuple((index, slot) for slot, index in binds.items()),
            equal=tuple(equal),
            value=_constant(value_cell, self._variables),
            value_slot=value_slot if value_known else -1,
            value_binds=value_slot if not value_known else -1,
            needs_report=any(map(self._is_open, cells.arguments)),
            needs_known=any(map(self._is_open, cells.all)),
            different=self._new_differences(new, known),
            filters=tuple(
                (s, self._variables.allowed[n]) for s in new if _is_limited(n := self._slots[s], self._variables)
            ),
            text=text,
        )

    def _is_open(self, cell: Cell) -> bool:
        """Say whether neither the text nor an event gives a field its value."""
        return _constant(cell, self._variables) is None and not 0 <= self._slot(cell) < self._event_slot_count

    def _new_differences(self, new: Sequence[int], known: set[int]) -> tuple[tuple[int, int], ...]:
        return tuple(
            (slot, other)
            for index, slot in enumerate(new)
            for other in [*sorted(known), *new[:index]]
            if self._variables.must_differ(self._slots[slot], self._slots[other])
        )

    def _slot(self, cell: Cell) -> int:
        if not cell.variable:
            return -1
        return self._slot_of.get(self._variables.class_of[cell.variable], -1)


def _search_size(persistence: Persistence) -> tuple[bool, int, int]:
    unknown = persistence.arity - len(persistence.constants) - len(persistence.bound)
    return not persistence.is_complete, unknown, -len(persistence.bound)


def _constant(cell: Cell, variables: Variables) -> str | None:
    kind, text = variables.content(cell)
    return text if kind == "constant" else None


def _first_fields(cells: Cells, variables: Variables) -> dict[str, int]:
    """Give the first field of each class of variables in a pattern, leaving out those that are plain constants."""
    first: dict[str, int] = {}
    for index, cell in enumerate(cells.all):
        if cell.variable and not variables.is_fixed(variables.class_of[cell.variable]):
            first.setdefault(variables.class_of[cell.variable], index)
    return first


def _is_limited(name: str, variables: Variables) -> bool:
    return variables.allowed[name] != ANY_VALUE
