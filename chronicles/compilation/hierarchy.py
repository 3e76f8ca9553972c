"""In which order must chronicles run so that the events they emit reach the chronicles that look at them?

An `assert` action sets an attribute, so it counts as an emitted event for those who look at the attribute. It also asks
which value the attribute had: therefore chronicles that set one attribute run together, after all that emit changes of
it, and see what each other set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from chronicles.compilation.plan import Emission, Plan
from chronicles.language.diagnostics import Reporter, Span


def order_by_emission(plans: Sequence[Plan], places: Mapping[str, Span], reporter: Reporter) -> tuple[Plan, ...]:
    """Sort plans so that emitters come first; a cycle is an error at the first chronicle in it.

    Parameters
    ----------
    plans : in the order of the texts, which is kept where nothing else decides.
    places : where each chronicle is named, for messages.
    reporter : receives cycles.
    """
    sources = {name: [plan for plan, _ in found] for name, found in _sources(plans).items()}
    ordered: list[Plan] = []

    def append(plan: Plan, path: tuple[str, ...]) -> None:
        """Put a plan behind all plans whose events it looks at."""
        if plan.name in path:
            cycle = " -> ".join([*path[path.index(plan.name) :], plan.name])
            message = f"expected chronicles that do not feed each other in a circle, got {cycle}"
            hint = "an emitted event may only be used by other chronicles"
            reporter.error("C1101", message, places[plan.name], hint)
            return
        if plan not in ordered:
            for source in sources[plan.name]:
                append(source, (*path, plan.name))
        if plan not in ordered:
            ordered.append(plan)

    for plan in plans:
        append(plan, ())
    return tuple(ordered)


def levels(plans: Sequence[Plan]) -> dict[str, tuple[int, int]]:
    """Give each chronicle a level and a delay.

    Parameters
    ----------
    plans : emitters first, as `order_by_emission` gives them.

    Returns
    -------
    By name: 0 for a chronicle that looks at no emitted event, otherwise one more than the highest level it looks at;
    and how long (us) after its time an event that a chronicle of its level looks at can still be emitted.
    """
    sources = _sources(plans)
    level_of: dict[str, int] = {}
    for plan in plans:
        level_of[plan.name] = max((level_of[source.name] + 1 for source, _ in sources[plan.name]), default=0)
    # A level runs as one, as late as its latest chronicle, and so do the events it emits.
    delays_us: list[int] = []
    for level in range(1 + max(level_of.values(), default=-1)):
        heard = [pair for plan in plans if level_of[plan.name] == level for pair in sources[plan.name]]
        delay_us = [delays_us[level_of[source.name]] + emission.delay_us for source, used in heard for emission in used]
        delays_us.append(max(delay_us, default=0))
    return {name: (level, delays_us[level]) for name, level in level_of.items()}


def _sources(plans: Sequence[Plan]) -> dict[str, list[tuple[Plan, list[Emission]]]]:
    """Give, for each chronicle, those that must run before it and which of their emissions it waits for."""
    emitters = [plan for plan in plans if plan.emissions]
    found: dict[str, list[tuple[Plan, list[Emission]]]] = {}
    for plan in plans:
        allies = _allies(plan, emitters)
        consumed = frozenset[str]().union(*(one.consumes for one in allies))
        asserted = frozenset[str]().union(*(one.asserts for one in allies))
        found[plan.name] = [
            (source, used)
            for source in emitters
            if (
                used := [
                    one
                    for one in source.emissions
                    if one.name in consumed or (one.name in asserted and not one.is_assertion)
                ]
            )
        ]
    return found


def _allies(plan: Plan, emitters: Sequence[Plan]) -> list[Plan]:
    """List a chronicle and those that set an attribute with it, directly or by way of others."""
    allies = [plan]
    for one in allies:
        allies += [other for other in emitters if other not in allies and not other.asserts.isdisjoint(one.asserts)]
    return allies
