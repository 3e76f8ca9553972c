"""In which order must chronicles run so that the events they emit reach the chronicles that look at them?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from chronicles.compilation.plan import Plan
from chronicles.language.diagnostics import Reporter, Span


def order_by_emission(plans: Sequence[Plan], places: Mapping[str, Span], reporter: Reporter) -> tuple[Plan, ...]:
    """Sort plans so that emitters come first; a cycle is an error at the first chronicle in it.

    Parameters
    ----------
    plans : in the order of the texts, which is kept where nothing else decides.
    places : where each chronicle is named, for messages.
    reporter : receives cycles.
    """
    emitters = [(plan, plan.produces) for plan in plans if plan.emissions]
    sources = {
        plan.name: [one for one, produced in emitters if not produced.isdisjoint(plan.consumes)] for plan in plans
    }
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
    and how long (us) after its time an event it looks at can still be emitted.
    """
    found: dict[str, tuple[int, int]] = {}
    emitters = [plan for plan in plans if plan.emissions]
    for plan in plans:
        consumed = plan.consumes
        above = [
            (found[source.name][0] + 1, found[source.name][1] + emission.delay_us)
            for source in emitters
            if source.name in found
            for emission in source.emissions
            if emission.name in consumed
        ]
        level = max((one[0] for one in above), default=0)
        found[plan.name] = (level, max((one[1] for one in above), default=0))
    return found
