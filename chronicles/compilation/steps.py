"""In which orders can an instance get its events, and what has to be compared at each step?

A state is a set of matched positions, as a mask; a step takes an instance from one state to the next by matching one
position. Everything here follows from the plan and is worked out once, when the first instance reaches the state.
"""

from dataclasses import dataclass

from chronicles.compilation.plan import Plan


@dataclass(frozen=True, slots=True)
class Step:
    """The way from one state to the next by matching one position.

    `joined` are the slots with values on which the event must agree, `fresh` those that it gives a value. `differ`
    (fresh slot, known slot) must differ. `windows` (matched position, least, most) bound how long after it the event
    comes; the time of the event is never before any of them.
    """

    source: int
    position: int
    joined: tuple[int, ...]
    fresh: tuple[int, ...]
    differ: tuple[tuple[int, int], ...]
    windows: tuple[tuple[int, int | None, int | None], ...]

    @property
    def target(self) -> int:
        """The state it leads to."""
        return self.source | 1 << self.position


def members(mask: int) -> list[int]:
    """List the positions of a state in ascending order.

    Examples
    --------
    >>> members(0b1101)
    [0, 2, 3]
    """
    return [index for index in range(mask.bit_length()) if mask >> index & 1]


def known_slots(plan: Plan, mask: int) -> tuple[int, ...]:
    """List the slots that have values in a state, in the order in which its patterns name them."""
    return tuple(dict.fromkeys(slot for one in members(mask) for _, slot in plan.positions[one].test.variables))


def deadline_bounds(plan: Plan, mask: int) -> list[tuple[int, int]]:
    """List (position, bound): an instance dies at the least of its times plus their bounds."""
    missing = missing_from(plan, mask)
    bounds = {one: min(plan.distance_us[one][other] for other in missing) for one in members(mask)}
    return [(one, bound) for one, bound in _without_implied(plan, bounds).items()]


def steps_from(plan: Plan, mask: int) -> list[Step]:
    """List the steps out of a state; simultaneous events may come in any order."""
    missing, distance = missing_from(plan, mask), plan.distance_us
    # The event of no other missing position must come before.
    return [_step(plan, mask, one) for one in missing if all(distance[one][other] >= 0 for other in missing)]


def missing_from(plan: Plan, mask: int) -> list[int]:
    """List the positions that a state lacks, in ascending order."""
    return [index for index in range(len(plan.positions)) if not mask >> index & 1]


def _step(plan: Plan, mask: int, position: int) -> Step:
    known = known_slots(plan, mask)
    own = [slot for _, slot in plan.positions[position].test.variables]
    fresh = tuple(slot for slot in own if slot not in known)
    differ = tuple((new, old) for new in fresh for old in known if (min(new, old), max(new, old)) in plan.different)
    joined = tuple(slot for slot in own if slot in known)
    return Step(mask, position, joined, fresh, differ, _windows(plan, mask, position))


def _windows(plan: Plan, mask: int, position: int) -> tuple[tuple[int, int | None, int | None], ...]:
    """Bound the time of the event, leaving out what other bounds or the order of time imply.

    After its deadline an instance takes no event, also where the window of the event itself is longer.
    """
    distance = plan.distance_us
    most = _without_implied(
        plan, {one: min(distance[one][q] for q in missing_from(plan, mask)) for one in members(mask)}
    )
    least = {one: -distance[position][one] for one in members(mask) if distance[position][one] < 0}
    for one in list(least):
        # t - one >= least[one] follows from t - other >= least[other] and other - one >= -distance[other][one].
        if any(least[one] <= least[other] - distance[other][one] for other in least if other != one):
            del least[one]
    return tuple((one, least.get(one), most.get(one)) for one in members(mask) if one in least or one in most)


def _without_implied(plan: Plan, bounds: dict[int, int]) -> dict[int, int]:
    """Leave out upper bounds that follow from another: t <= other + bound[other], other <= one + distance."""
    left = dict(bounds)
    for one, bound in bounds.items():
        if any(bound >= left[other] + plan.distance_us[one][other] for other in left if other != one):
            del left[one]
    return left
