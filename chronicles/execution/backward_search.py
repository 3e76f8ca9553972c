"""Which earlier events make an instance complete, given its last one?

For each last position and each order of the others the search is written out as Python source and compiled once: one
loop for each position, its window cut out of a time-sorted buffer with `bisect`. The numbers of the minimal network
stand in the source as constants, so a search does nothing but compare times.

The innermost position needs no loop: all events in its window complete an instance. So a search gives families, each
the events of all other positions and the list of those that fit the innermost one; `Instances` makes instances of them
when somebody looks. Counting them, or keeping them until later, costs little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, overload

from chronicles.compilation.plan import Plan
from chronicles.execution.event_tests import Values
from chronicles.execution.instances import Instance, Record
from chronicles.execution.windows import fresh_differences, joined_slots, rivals, window

Row = tuple[Record, Values]
Family = tuple[Any, ...]  # Any: the rows of all positions but the innermost, then the list of rows of that one
Expansion = Callable[[Family], list[Instance]]
# The families that a record completes, and how they expand.
Search = Callable[[Record, Values], tuple[list[Family], Expansion] | None]
Buffer = tuple[list[int], list[Row]]
# Position and places of its values -> the buffer, or for some places the buffers by the values there.
Lookup = Callable[[int, tuple[int, ...]], Any]  # Any: Buffer | Mapping[value or values, Buffer]


class Instances(Sequence[Instance]):
    """Complete instances, made when they are looked at; their number is known."""

    __slots__ = ("_length", "_parts")

    def __init__(self, parts: Sequence[tuple[list[Family], Expansion]]) -> None:
        self._parts = parts
        self._length = sum(len(family[-1]) for families, _ in parts for family in families)

    def __len__(self) -> int:
        return self._length

    def __iter__(self) -> Iterator[Instance]:
        for families, expand in self._parts:
            for family in families:
                yield from expand(family)

    @overload
    def __getitem__(self, index: int) -> Instance: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Instance]: ...

    def __getitem__(self, index: int | slice) -> Instance | Sequence[Instance]:
        return list(self)[index]


def last_positions(plan: Plan) -> tuple[int, ...]:
    """Give the positions whose event can be the last of an instance; simultaneous events come in any order."""
    places = range(len(plan.positions))
    return tuple(one for one in places if all(plan.distance_us[other][one] >= 0 for other in places))


def focus_source(plan: Plan, last: int) -> str:
    """Write the function that counts the events in the windows before a last event.

    It gives up at the first window that is empty. Otherwise it calls `choose`, which picks a search by the counts.
    """
    lines = [f"def focus(r{last}, v{last}):", f"    t{last} = r{last}[0]"]
    others = _others(plan, last)
    for one in others:
        lines += _indented(1, _buffer_lines(plan, one, [last], "return None"))
        low, high = _window(plan, one, [last])
        end = f"bisect_right(times{one}, {high})" if high else f"len(times{one})"
        count = f"n{one} = {end} - bisect_left(times{one}, {low})"
        lines += _indented(1, [count, f"if n{one} <= 0:", "    return None"])
    counts = "".join(f"n{one}, " for one in others)
    return "\n".join([*lines, f"    return choose(({counts}))(r{last}, v{last})"])


def search_source(plan: Plan, last: int, order: Sequence[int]) -> str:
    """Write the functions `search`, which finds the families that end with an event, and `expand`.

    Parameters
    ----------
    last : the position of that event.
    order : the other positions in the order in which they are searched.
    """
    lines = [f"def search(r{last}, v{last}):", f"    t{last} = r{last}[0]", f"    row{last} = r{last}, v{last}"]
    lines += ["    found = []"]
    bound = [last]
    for depth, one in enumerate(order, 1):
        lines += _indented(depth, _buffer_lines(plan, one, bound, "return None" if depth == 1 else "continue"))
        low, high = _window(plan, one, bound)
        end = f"bisect_right(times{one}, {high})" if high else ""
        rows = f"rows{one}[bisect_left(times{one}, {low}):{end}]"
        unwanted = _unwanted(plan, one, bound)
        if unwanted:
            rows = f"[(r{one}, v{one}) for r{one}, v{one} in {rows} if not ({' or '.join(unwanted)})]"
        if depth < len(order):
            lines += _indented(depth, [f"for row{one} in {rows}:", f"    r{one}, v{one} = row{one}"])
            lines += _indented(depth, [f"    t{one} = r{one}[0]"])
        else:
            family = ", ".join(f"row{place}" for place in bound)
            lines += _indented(depth, [f"rows = {rows}", "if rows:", f"    found.append(({family}, rows))"])
        bound.append(one)
    if not order:
        lines.append(f"    found.append(([row{last}],))")
    return "\n".join([*lines, "    return (found, expand) if found else None", _expand_source(plan, bound)])


def _expand_source(plan: Plan, bound: Sequence[int]) -> str:
    """Write the function that makes the instances of a family, in the layout of `instances.py`."""
    *outer, inner = bound
    family = "".join(f"(r{one}, v{one}), " for one in outer)
    places = range(len(plan.positions))
    # A complete instance has no deadline; it closes with its last event.
    parts = [f"r{one}[0]" for one in (bound[0], *places)]
    parts += [_value(plan, slot, bound) for slot in range(plan.event_slot_count)]
    parts += [f"r{one}" for one in places]
    return "\n".join(
        [
            "def expand(family):",
            f"    {family}rows, = family",
            f"    return [[{', '.join(parts)}] for r{inner}, v{inner} in rows]",
        ]
    )


def _others(plan: Plan, last: int) -> list[int]:
    return [one for one in range(len(plan.positions)) if one != last]


def compiled(source: str, name: str, names: Mapping[str, object]) -> Any:  # Any: the function of that name
    """Compile the source of a function that looks up `names`."""
    namespace = dict(names)
    exec(compile(source, f"<{name}>", "exec"), namespace)
    return namespace[name]


def buffers_of(plan: Plan, last: int, order: Sequence[int], lookup: Lookup) -> dict[str, Any]:  # Any: see Lookup
    """Collect the buffers that a search in some order looks at, under the names in its source."""
    names: dict[str, Any] = {}
    bound = [last]
    for one in order:
        places = _places(plan, one, joined_slots(plan, one, bound))
        found = lookup(one, places)
        if places:
            names[f"buffers{one}"] = found
        else:
            names[f"times{one}"], names[f"rows{one}"] = found
        bound.append(one)
    return names


def _buffer_lines(plan: Plan, one: int, bound: Sequence[int], give_up: str) -> list[str]:
    """Write how a buffer is found by the values of the variables that are known."""
    slots = joined_slots(plan, one, bound)
    if not slots:
        return []
    values = [_value(plan, slot, bound) for slot in slots]
    key = values[0] if len(values) == 1 else f"({', '.join(values)})"
    lines = [f"buffer = buffers{one}.get({key})", "if buffer is None:", f"    {give_up}"]
    return [*lines, f"times{one}, rows{one} = buffer"]


def _window(plan: Plan, one: int, bound: Sequence[int]) -> tuple[str, str]:
    """Write the ends of the window of a position; an empty end bounds nothing, as nothing is later than the last."""
    last = bound[0]
    bounds = window(plan, one, bound)
    highs = [(place, offset_us) for place, offset_us in bounds.highs if place != last or offset_us < 0]
    return _extreme("max", bounds.lows), _extreme("min", highs)


def _extreme(function: str, bounds: Sequence[tuple[int, int]]) -> str:
    terms = [f"t{place} {'-' if offset_us < 0 else '+'} {abs(offset_us)}" for place, offset_us in bounds]
    return terms[0] if len(terms) == 1 else f"{function}({', '.join(terms)})" if terms else ""


def _unwanted(plan: Plan, one: int, bound: Sequence[int]) -> list[str]:
    """Write when an event in the window is not wanted: it is in another place already, or variables must differ."""
    # The last event is in no buffer yet.
    same = [f"r{one} is r{place}" for place in rivals(plan, one, bound[1:])]
    places = [*bound, one]
    differences = fresh_differences(plan, one, bound)
    return same + [f"{_value(plan, first, places)} == {_value(plan, second, places)}" for first, second in differences]


def _places(plan: Plan, one: int, slots: Sequence[int]) -> tuple[int, ...]:
    own = [slot for _, slot in plan.positions[one].test.variables]
    return tuple(own.index(slot) for slot in slots)


def _value(plan: Plan, slot: int, bound: Sequence[int]) -> str:
    for one in bound:
        for place, (_, found) in enumerate(plan.positions[one].test.variables):
            if found == slot:
                return f"v{one}[{place}]"
    raise AssertionError(slot)


def _indented(depth: int, lines: Iterable[str]) -> list[str]:
    return [f"{'    ' * depth}{line}" for line in lines]
