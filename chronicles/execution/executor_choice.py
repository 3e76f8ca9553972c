"""Which store of instances is cheaper for a stream, the eager or the lazy one?

The eager store makes an instance for every choice of earlier events that later ones could complete; the lazy store
makes none, but visits choices of events each time one comes that can be the last. Both numbers are estimated from the
rates of events and the widths of windows, as if events were independent of each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import prod

from chronicles.compilation.plan import Plan
from chronicles.execution.backward_search import last_positions

# An eager store tells partial instances at no extra cost, so it is given up only for a clear gain.
_CLEARLY = 2.0
# What it costs to keep an event, or to find one of the windows of a search empty, in partial instances made.
_GLANCE = 0.5


def prefer_lazy(plan: Plan, counts: Mapping[str, int], span_us: int) -> bool:
    """Say whether the lazy store will clearly do less work.

    Parameters
    ----------
    plan : of the chronicle.
    counts : how many events of each name came; names that did not come may be missing.
    span_us : in how much time; positive.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> [plan] = load("chronicle led_to_alarm[](t1, t3) { "
    ...               "event(step[], t1) event(turn[], t2) event(alarm[], t3) "
    ...               "t2 - t1 in [1s, 10s] t3 - t2 in [1s, 10s] }").plans
    >>> prefer_lazy(plan, {"step": 100, "turn": 100, "alarm": 1}, 60_000_000)
    True
    >>> prefer_lazy(plan, {"step": 100, "turn": 100, "alarm": 100}, 60_000_000)
    False
    """
    numbers = [float(counts.get(position.test.name, 0)) for position in plan.positions]
    rates = [number / span_us for number in numbers]
    last = last_positions(plan)
    kept = sum(number for one, number in enumerate(numbers) if last != (one,))
    lazy = _GLANCE * kept + sum(numbers[one] * _searched(plan, one, rates) for one in last)
    return _made(plan, numbers, rates, _CLEARLY * lazy) > _CLEARLY * lazy


def _searched(plan: Plan, last: int, rates: Sequence[float]) -> float:
    """Estimate the work of a search: a look at each window, then a visit to each choice but of innermost events."""
    expected = sorted(
        rates[one] * (min(plan.distance_us[last][one], 0) + plan.distance_us[one][last])
        for one in range(len(rates))
        if one != last
    )
    choices = 1.0
    visited = 1.0
    for number in expected[:-1]:
        choices *= number
        visited += choices
    return _GLANCE + visited * prod(min(1.0, number) for number in expected)


def _made(plan: Plan, numbers: Sequence[float], rates: Sequence[float], enough: float) -> float:
    """Estimate how many partial instances are made; stop counting above `enough`."""
    places = range(len(rates))
    full = (1 << len(rates)) - 1
    reached = {1 << one: numbers[one] for one in places if _can_begin(plan, 1 << one)}
    made = 0.0
    while reached:
        made += sum(number for mask, number in reached.items() if mask != full)
        if made > enough:
            break
        longer: dict[int, float] = {}
        for mask, number in reached.items():
            for one in places:
                if number and not mask >> one & 1 and _can_begin(plan, mask | 1 << one):
                    partners = rates[one] * _width_us(plan, one, (place for place in places if mask >> place & 1))
                    longer.setdefault(mask | 1 << one, number * partners)
        reached = longer
    return made


def _can_begin(plan: Plan, mask: int) -> bool:
    """Say whether these positions can all come before the others."""
    places = range(len(plan.positions))
    inside = [one for one in places if mask >> one & 1]
    return all(plan.distance_us[one][other] >= 0 for one in inside for other in places if other not in inside)


def _width_us(plan: Plan, one: int, known: Iterable[int]) -> int:
    return min(plan.distance_us[place][one] + plan.distance_us[one][place] for place in known)
