"""Which instances of many chronicles does each event make, one event at a time?

The algorithm follows Ghallab 1996 (*On chronicles: representation, on-line recognition and learning*, section 3) and
Dousson: an event that an instance expects makes a copy with the event in it, and the original keeps waiting, so all
matches are found and nothing is consumed. We depart from it in three ways. The network is minimised once, when the
chronicle is compiled; an instance only compares times, and its deadline is exact. Chronicles that look at the same
kind of event share the test of it, and, where they can start with it, the row of the instance that has only this event.
And the comparisons are written as Python programs (`live.programs`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Any  # an instance is a heterogeneous list; states are plain data

from chronicles.compilation.plan import EventTest, Plan
from chronicles.compilation.steps import deadline_bounds, known_slots, members, steps_from
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.execution.instances import Instance, Record, no_records, record_builder
from chronicles.execution.limits import USUAL, Limits
from chronicles.execution.live.partial_rows import Row, Rows
from chronicles.execution.live.programs import extend_code, read_code, row_places

# Numbers of chronicles, each with instances that have all their events; a chronicle may come more than once.
Completed = list[tuple[int, Sequence[Instance]]]

_RECENT = 4096
_DROPPED_A_SWEEP = 4096


@dataclass(slots=True, eq=False)
class _State:
    """The instances of one chronicle that have matched the positions in `mask`, some but not all.

    `rows` of a single event are those of the event's reader. `is_open` says that the steps to larger states are there.
    """

    chronicle: _Chronicle
    mask: int
    rows: Rows
    deadline: Callable[[Row], int]
    is_open: bool = False


# What finds the rows that wait for a key, what extends them by an event, the states before and after (None: complete).
_Extension = tuple[Callable[[Hashable], Any], Callable[..., list[Any]], _State, _State | None]


ReadRow = Callable[[Record], Row | None]


class _Reader:
    """One kind of event, and who looks at it.

    `firsts` are the instances that have matched only such an event, those of all states in `starts`. `groups` are the
    possible extensions by the function that gives their key from the row of an event.
    """

    def __init__(self, make_read: Callable[[], ReadRow], record: Callable[..., Record]) -> None:
        self._make_read = make_read
        self.read: ReadRow = self._read_first
        self.record = record
        self.is_open = False
        self.life_us = 0
        self.firsts = Rows(lambda row: row[0] + self.life_us)
        self.starts: list[_State] = []
        self.groups: list[tuple[Callable[[Row], Hashable], list[_Extension]]] = []
        self._groups_at: dict[tuple[int, ...], list[_Extension]] = {}

    def extend_at(self, places: tuple[int, ...], extension: _Extension) -> None:
        """Add an extension whose key are the values at some places of the event's row."""
        if places not in self._groups_at:
            self._groups_at[places] = []
            self.groups.append((itemgetter(*places) if places else _no_key, self._groups_at[places]))
        self._groups_at[places].append(extension)

    def _read_first(self, record: Record) -> Row | None:
        """Make the program for this kind of event when the first one comes."""
        self.read = self._make_read()
        return self.read(record)


@dataclass(slots=True, eq=False)
class _Chronicle:
    """The states of one chronicle, by mask; `readers` by position."""

    number: int
    plan: Plan
    readers: Sequence[_Reader]
    states: dict[int, _State] = field(default_factory=dict)

    @property
    def partial(self) -> list[_State]:
        """The states, by mask."""
        return [state for _, state in sorted(self.states.items())]


class EagerExecutor:
    """The instances of some chronicles that still expect events.

    Parameters
    ----------
    plans : the chronicles; results name them by their keys.
    limits : what they may cost.

    Attributes
    ----------
    names : names of the events that instances expect.
    left_out : how many instances were beyond the limits, by chronicle.
    """

    def __init__(self, plans: Mapping[int, Plan], limits: Limits = USUAL) -> None:
        self._limits = limits
        self.left_out: Counter[str] = Counter()
        self._recent: list[Record] = no_records(_RECENT)
        self._rows: list[Rows] = []
        self._readers: dict[EventTest, _Reader] = {}
        self._chronicles = {number: self._chronicle(number, plan) for number, plan in plans.items()}
        self._readers_of: dict[str, list[_Reader]] = {}
        for test, reader in self._readers.items():
            self._readers_of.setdefault(test.name, []).append(reader)
        self.names = frozenset(self._readers_of)

    def feed(self, record: Record) -> tuple[Completed, int]:
        """Let an event extend every instance that expects it; events come in the order of time.

        Returns
        -------
        The number of a chronicle with its instances that now have all their events, which may come more than once, and
        how many rows are new.
        """
        t_us, sequence, event = record
        extended: list[tuple[_State, _State | None, list[Any]]] = []
        firsts = []
        for reader in self._readers_of[event.name]:
            row = reader.read(record)
            if row is None:
                continue
            for key_of, extensions in reader.groups:
                key = key_of(row)
                for find, extend, before, after in extensions:
                    waiting = find(key)
                    if waiting:
                        made = extend(row, waiting, record)
                        if made:
                            extended.append((before, after, made))
            if reader.starts:
                firsts.append((reader, row))
        if not (extended or firsts):
            return [], 0
        # Only now may the new rows be seen: one event fills at most one position of an instance.
        self._recent[sequence % _RECENT] = record
        for reader, row in firsts:
            if not reader.is_open:
                self._open_starts(reader)
            reader.firsts.add((row,), t_us)
        complete, created = self._keep(extended, t_us) if extended else ([], 0)
        return complete, created + len(firsts)

    def sweep(self, now_us: int) -> int:
        """Drop instances past their deadline, a limited number at a time; give the number of rows left."""
        left = 0
        for rows in self._rows:
            rows.drop(now_us, _DROPPED_A_SWEEP)
            left += len(rows.queue)
        return left

    def waiting(self, number: int, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give a chronicle's instances that may still get all their events, with the positions they have matched."""
        for state in self._chronicles[number].partial:
            for row in state.rows.queue:
                deadline_us = state.deadline(row)
                if deadline_us >= now_us:
                    yield state.mask, _instance(state, row, deadline_us)

    # ---- checkpoints

    def state(self) -> dict[str, Any]:
        """Give everything the executor knows, as plain data."""
        return {
            "firsts": [list(reader.firsts.queue) for reader in self._readers.values()],
            "rows": [
                {state.mask: list(state.rows.queue) for state in one.partial if state.mask.bit_count() > 1}
                for one in self._chronicles.values()
            ],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Forget everything and go on from the state of an executor with the same plans."""
        self._recent[:] = no_records(_RECENT)
        for reader, rows in zip(self._readers.values(), state["firsts"], strict=True):
            if rows:
                self._open_starts(reader)
            reader.firsts.replace(rows)
        for chronicle, states in zip(self._chronicles.values(), state["rows"], strict=True):
            for mask in states:
                self._open(self._state(chronicle, mask))
            for one in chronicle.partial:
                if one.mask.bit_count() > 1:
                    one.rows.replace(states.get(one.mask, ()))

    # ---- an event

    def _keep(self, extended: Sequence[tuple[_State, _State | None, list[Any]]], t_us: int) -> tuple[Completed, int]:
        complete: Completed = []
        created = 0
        for before, after, made in extended:
            room = self._limits.most_matches if after is None else self._limits.most_waiting - len(after.rows.queue)
            kept = made if len(made) <= room else made[: max(room, 0)]
            if len(kept) < len(made):
                self.left_out[before.chronicle.plan.name] += len(made) - len(kept)
            if after is None:
                complete.append((before.chronicle.number, kept))
            else:
                if not after.is_open:
                    self._open(after)
                after.rows.add(kept, t_us)
                created += len(kept)
        return complete, created

    # ---- states are made when the first instance reaches them: most sets of positions never occur

    def _chronicle(self, number: int, plan: Plan) -> _Chronicle:
        chronicle = _Chronicle(number, plan, [self._reader(one.test) for one in plan.positions])
        if len(plan.positions) == 1:
            # The one instance that waits for its first event is always there; elsewhere `starts` stands for it.
            root = _State(chronicle, 0, Rows(lambda row: UNBOUNDED_US), lambda row: UNBOUNDED_US)
            root.rows.add(((),), 0)
            self._open(root)
            return chronicle
        for step in steps_from(plan, 0):
            state, reader = self._state(chronicle, step.target), chronicle.readers[step.position]
            reader.starts.append(state)
            reader.life_us = max(reader.life_us, *(bound for _, bound in deadline_bounds(plan, state.mask)))
        return chronicle

    def _reader(self, test: EventTest) -> _Reader:
        """Give the reader of a kind of event: slots, which are the chronicle's own, do not matter to it."""
        kind = replace(test, variables=tuple((one, 0) for one, _ in test.variables))
        if kind not in self._readers:
            reader = _Reader(lambda: read_code(kind).function(), record_builder(kind, self._recent))
            self._readers[kind] = reader
            self._rows.append(reader.firsts)
        return self._readers[kind]

    def _state(self, chronicle: _Chronicle, mask: int) -> _State:
        if mask not in chronicle.states:
            deadline = _deadline(chronicle.plan, mask)
            if mask.bit_count() == 1:
                rows = chronicle.readers[members(mask)[0]].firsts
            else:
                rows = Rows(deadline)
                self._rows.append(rows)
            chronicle.states[mask] = _State(chronicle, mask, rows, deadline)
        return chronicle.states[mask]

    def _open_starts(self, reader: _Reader) -> None:
        """Make the steps out of the states of a first event."""
        reader.is_open = True
        for state in reader.starts:
            self._open(state)

    def _open(self, state: _State) -> None:
        """Make the steps out of a state, before its first row is there."""
        if state.is_open:
            return
        state.is_open = True
        chronicle, plan = state.chronicle, state.chronicle.plan
        for step in steps_from(plan, state.mask):
            find = state.rows.index_by(row_places(plan, state.mask, step.joined)).get
            extend = extend_code(plan, step, [one.record for one in chronicle.readers]).function()
            is_last = step.target == (1 << len(plan.positions)) - 1
            after = None if is_last else self._state(chronicle, step.target)
            own = row_places(plan, 1 << step.position, step.joined)
            chronicle.readers[step.position].extend_at(own, (find, extend, state, after))


def _no_key(row: Row) -> None:
    return None


def _deadline(plan: Plan, mask: int) -> Callable[[Row], int]:
    """Make the function that gives the deadline of a row."""
    bounds = [(2 * members(mask).index(one), bound_us) for one, bound_us in deadline_bounds(plan, mask)]
    if len(bounds) == 1:
        [(place, bound_us)] = bounds
        return lambda row: row[place] + bound_us
    return lambda row: min([row[place] + bound_us for place, bound_us in bounds])


def _instance(state: _State, row: Row, deadline_us: int) -> Instance:
    """Put a row into the form of `Layout`."""
    plan, matched = state.chronicle.plan, members(state.mask)
    values = dict(zip(known_slots(plan, state.mask), row[2 * len(matched) :], strict=True))
    times: list[int | None] = [None] * len(plan.positions)
    records: list[Record | None] = [None] * len(plan.positions)
    for place, position in enumerate(matched):
        times[position], held = row[2 * place : 2 * place + 2]
        own = [values[slot] for _, slot in plan.positions[position].test.variables]
        records[position] = state.chronicle.readers[position].record(times[position], held, *own)
    return [deadline_us, *times, *(values.get(slot) for slot in range(plan.event_slot_count)), *records]
