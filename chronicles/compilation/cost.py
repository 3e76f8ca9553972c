"""How many instances of a chronicle can wait at once, at most?

An instance that has matched some events and waits for others lives until the least of "time of a matched event, plus
the upper bound of a missing one". So at any time each of its events lies in a window before now, and the number of
instances is at most the number of ways to choose events from these windows. A window of length L has at most
``floor(rate * L) + 1`` events that have one value of an argument in common. Events that share a variable in an argument
with one already chosen must have its value, so there are no more of them; of others there are as many for each of the
``keys`` values. Complete instances wait for the ends of `noevent`, `hold` and their kin.

The bound holds under these assumptions, of which the first is printed with it:

* an argument has at most ``keys`` values, and events of one name that have the same value of an argument are at least
  1/rate apart. How the events are spread over the values does not matter;
* instances past their deadline are forgotten at once. A recogniser forgets them in sweeps, so a little later;
* constants, filters and "must differ" are left out of account: they only make it fewer.

The order of the events in which the windows are counted is chosen to make the bound small; every order gives one.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from typing import NamedTuple

from chronicles.compilation.components import connected_components
from chronicles.compilation.plan import Plan
from chronicles.compilation.steps import members, missing_from, steps_from
from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import format_duration
from dyknow.language.places import Span
from dyknow.language.ways import reached

_SECOND_US = 1_000_000
# Below this window, pairs of unrelated events are few at the rates of traffic.
_WIDE_US = 60 * _SECOND_US


@dataclass(frozen=True, slots=True)
class CostRow:
    """One set of matched events: their time points, the bound as a formula, and its value at the given rates.

    In the formula an event's name is its rate per second and `keys` the number of values of an argument.
    """

    points: tuple[str, ...]
    formula: str
    instances: int
    is_complete: bool


@dataclass(frozen=True, slots=True)
class CostReport:
    """How many instances of a chronicle there can be at once, by what they have matched, with so many `keys`."""

    chronicle: str
    rows: tuple[CostRow, ...]
    keys: int = 1

    @property
    def waiting(self) -> int:
        """The most instances that still expect events."""
        return sum(row.instances for row in self.rows if not row.is_complete)

    @property
    def complete(self) -> int:
        """The most instances that have all their events and await the end of an interval."""
        return sum(row.instances for row in self.rows if row.is_complete)

    def render(self) -> str:
        """Write the report as a table, with what the stream must be like for it to hold.

        Examples
        --------
        >>> from chronicles.chronicle_set import load
        >>> plan = load("chronicle visit[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) "
        ...             "t2 - t1 in [1s, 1min] }").plans[0]
        >>> print(cost(plan, {"enter": 2.0}, keys=10).render())
        visit: at most 1,210 instances wait for events, 0 for the end of an interval,
        if an argument has at most 10 values, and events of one name with one of them are at least 1/rate apart
          t1    1,210  keys (enter*1min + 1)
        """
        width = max((len(_label(row)) for row in self.rows), default=0) + 4
        head = f"{self.chronicle}: at most {self.waiting:,} instances wait for events"
        lines = [f"{head}, {self.complete:,} for the end of an interval,", f"if {self._assumption}"]
        lines += [f"  {_label(row):{width}}{row.instances:>9,}  {row.formula}" for row in self.rows]
        return "\n".join(lines)

    @property
    def _assumption(self) -> str:
        if self.keys == 1:
            return "events of one name are at least 1/rate apart"
        values = f"an argument has at most {self.keys} values"
        return f"{values}, and events of one name with one of them are at least 1/rate apart"


def _label(row: CostRow) -> str:
    return " ".join(row.points) + (" (all)" if row.is_complete else "")


def cost(plan: Plan, rates_hz: Mapping[str, float], default_rate_hz: float = 1.0, *, keys: int = 1) -> CostReport:
    """Bound the instances of a chronicle that there are at any time.

    Parameters
    ----------
    plan : of the chronicle.
    rates_hz : the most events a second that have one value of an argument in common, by name of the message or
        attribute; with one key, the most events at all.
    default_rate_hz : for names that `rates_hz` lacks.
    keys : how many values an argument can have, such as the number of cars in view.
    """
    bound = _Bound(plan, rates_hz, default_rate_hz, keys)
    masks = [mask for mask in reachable(plan) if bound.can_wait(mask)]
    return CostReport(plan.name, tuple(map(bound.row, masks)), keys)


def reachable(plan: Plan) -> list[int]:
    """List the sets of positions (as bits) that an instance can have matched, in the order of their size."""
    found = reached([0], lambda mask: [step.target for step in steps_from(plan, mask)])
    return sorted(found - {0}, key=lambda mask: (mask.bit_count(), mask))


class _Factor(NamedTuple):
    """How many choices there are for one event: those of one key as a formula, the number of keys, and the product."""

    text: str
    keys: int
    choices: int


class _Bound:
    """Counts choices of events for one plan and its rates."""

    def __init__(self, plan: Plan, rates_hz: Mapping[str, float], default_rate_hz: float, keys: int) -> None:
        self._plan = plan
        self._names = [position.test.name for position in plan.positions]
        self._rates_hz = [Fraction(rates_hz.get(name, default_rate_hz)) for name in self._names]
        self._keys = keys
        tests = [position.test for position in plan.positions]
        self._slots = [{slot for _, slot in test.variables} for test in tests]
        self._argument_slots = [{slot for field, slot in test.variables if field < test.arity} for test in tests]
        # One value of an argument is given by the text, or there are no arguments.
        self._is_single = [not test.arity or any(field < test.arity for field, _ in test.constants) for test in tests]

    def can_wait(self, mask: int) -> bool:
        """Say whether an instance that has matched exactly these positions can be there for any time."""
        return all(length_us >= 0 for length_us in self._windows_us(mask).values())

    def row(self, mask: int) -> CostRow:
        """Bound the instances that have matched exactly these positions."""
        windows_us = self._windows_us(mask)
        members = sorted(windows_us)
        factors = min((self._factors(first, windows_us) for first in members), key=_product)
        points = tuple(self._plan.positions[one].label for one in members)
        return CostRow(points, _formula(factors), _product(factors), len(members) == len(self._names))

    def _windows_us(self, mask: int) -> dict[int, int]:
        """Say for each matched event how long before now it can lie while the instance waits; below 0: it cannot."""
        plan = self._plan
        matched, missing = members(mask), missing_from(plan, mask)
        if missing:
            return {one: min(plan.distance_us[one][other] for other in missing) for one in matched}
        anchors = [one.end for one in plan.obligations]
        ends = [(anchor.position, anchor.offset_us) for anchor in anchors]
        if plan.settling_us:
            ends += [(one, 0) for one in matched]
        # At the end itself the instance is concluded: it waits one microsecond less.
        settled_us = plan.settling_us - 1
        return {
            one: max((plan.distance_us[one][place] + offset_us for place, offset_us in ends), default=0) + settled_us
            for one in matched
        }

    def _factors(self, first: int, windows_us: Mapping[int, int]) -> list[_Factor]:
        """Choose events one after the other, each time the one with the fewest choices."""
        chosen: list[int] = []
        found: list[_Factor] = []
        position = first
        left = set(windows_us)
        while True:
            left.discard(position)
            found.append(self._factor(position, chosen, windows_us))
            chosen.append(position)
            if not left:
                return found
            position = min(sorted(left), key=lambda one: self._factor(one, chosen, windows_us).choices)

    def _factor(self, position: int, chosen: Iterable[int], windows_us: Mapping[int, int]) -> _Factor:
        """Count the choices for an event in its window, and beside those already chosen."""
        distance = self._plan.distance_us
        beside_us = [distance[one][position] + distance[position][one] for one in chosen]
        length_us = min([windows_us[position], *beside_us])
        is_joined = any(self._argument_slots[position] & self._slots[one] for one in chosen)
        keys = 1 if is_joined or self._is_single[position] else self._keys
        text = f"{self._names[position]}*{format_duration(length_us)} + 1"
        return _Factor(text, keys, keys * (math.floor(self._rates_hz[position] * length_us / _SECOND_US) + 1))


def _product(factors: Iterable[_Factor]) -> int:
    return math.prod(factor.choices for factor in factors)


def _formula(factors: Sequence[_Factor]) -> str:
    if len(factors) == 1 and factors[0].keys == 1:
        return factors[0].text
    return " ".join(f"{'keys ' if factor.keys > 1 else ''}({factor.text})" for factor in factors)


def warn_unjoined(plan: Plan, place: Span, reporter: Reporter) -> None:
    """Warn about events with variables that share none, even by way of others, and may be far apart in time.

    Parameters
    ----------
    plan : of the chronicle.
    place : where it is named.
    reporter : receives the warning.
    """
    slots_of = [{slot for _, slot in position.test.variables} for position in plan.positions]
    groups = [group for group in connected_components(slots_of) if any(slots_of[one] for one in group)]
    apart = [pair for group, following in combinations(groups, 2) for pair in product(group, following)]
    spread_us = max((plan.distance_us[one][other] + plan.distance_us[other][one] for one, other in apart), default=0)
    if spread_us >= _WIDE_US:
        named = " and ".join(plan.positions[group[0]].label for group in groups)
        count = len(groups)
        message = f"expected events that share a variable, got {count} groups without one in common, at {named}"
        hint = f"within {format_duration(spread_us)} every combination is kept: with n things each, n^{count} instances"
        reporter.warning("C1001", message, place, f"{hint}; join them by a variable, or narrow the time between them")
