"""In which order must chronicles run so that the events they emit reach the chronicles that look at them?

An `assert` action sets an attribute, so it counts as an emitted event for those who look at the attribute. It also asks
which value the attribute had: therefore chronicles that set one attribute run together, after all that emit changes of
it, and see what each other set.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

from chronicles.compilation.components import connected_components
from chronicles.compilation.plan import Emission, Plan
from dyknow.language.diagnostics import Reporter
from dyknow.language.places import Span
from dyknow.language.ways import inside_first

# A chronicle that must run before another one, and those of its emissions that the other one waits for.
Source = tuple[Plan, list[Emission]]


def order_by_emission(plans: Sequence[Plan], places: Mapping[str, Span], reporter: Reporter) -> tuple[Plan, ...]:
    """Sort plans so that emitters come first; a cycle is an error at the first chronicle in it.

    Parameters
    ----------
    plans : in the order of the texts, which is kept where nothing else decides.
    places : where each chronicle is named, for messages.
    reporter : receives cycles.
    """
    plan_of = {plan.name: plan for plan in plans}
    sources = {name: [source.name for source, _ in found] for name, found in _sources(plans).items()}
    ordered, circles = inside_first({name: sources[name] for name in plan_of})
    for names in circles:
        _report_circle(names, places, reporter)
    return tuple(plan_of[name] for name in ordered)


def _report_circle(names: Sequence[str], places: Mapping[str, Span], reporter: Reporter) -> None:
    """Report chronicles each of which looks at what the next one emits, and the last at what the first one does."""
    message = f"expected chronicles that do not feed each other in a circle, got {' -> '.join([*names, names[0]])}"
    related = [(places[fed_by], f"feeds {name!r}") for name, fed_by in pairwise(names)]
    hint = "an emitted event may only be used by other chronicles"
    reporter.error("C1101", message, places[names[0]], hint, related=related)


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
    by_level: dict[int, list[Source]] = {}
    for name, level in level_of.items():
        by_level.setdefault(level, []).extend(sources[name])
    delays_us: list[int] = []
    for _, heard in sorted(by_level.items()):
        delay_us = [delays_us[level_of[source.name]] + emission.delay_us for source, used in heard for emission in used]
        delays_us.append(max(delay_us, default=0))
    return {name: (level, delays_us[level]) for name, level in level_of.items()}


def _sources(plans: Sequence[Plan]) -> dict[str, list[Source]]:
    """Give, for each chronicle, those that must run before it, in the order of the texts."""
    emitted: dict[str, list[tuple[int, Emission]]] = {}
    for index, plan in enumerate(plans):
        for emission in plan.emissions:
            emitted.setdefault(emission.name, []).append((index, emission))
    found: dict[str, list[Source]] = {}
    # Chronicles that set an attribute together run together; most are alone.
    setters = [plan for plan in plans if plan.asserts]
    together = [[setters[index] for index in group] for group in connected_components(plan.asserts for plan in setters)]
    for allies in [*together, *([plan] for plan in plans if not plan.asserts)]:
        consumed = frozenset[str]().union(*(one.consumes for one in allies))
        asserted = frozenset[str]().union(*(one.asserts for one in allies))
        used: dict[int, list[Emission]] = {}
        for name in consumed | asserted:
            for index, emission in emitted.get(name, ()):
                if name in consumed or not emission.is_assertion:
                    used.setdefault(index, []).append(emission)
        sources = [(plans[index], used[index]) for index in sorted(used)]
        found |= {one.name: sources for one in allies}
    return found
