"""Which obligations are the same, and which make others superfluous? The table that makes residuals.

Equal residuals made by one table are one object (hash-consing), so progressors that share a table share work. Joining
merges by implication: of obligations of one shape only the strictest windows stay in a conjunction of "somewhere", only
their union in a conjunction of "everywhere", and the other way round in a disjunction. That is what keeps
``always eventually[0, 1s] p`` at one open deadline for ever.
"""

from collections.abc import Iterable
from typing import cast

from dyknow.mtl.progression.residual import (
    FALSE,
    TRUE,
    Expected,
    Guarded,
    Implied,
    Junction,
    Known,
    Residual,
    Waiting,
    implies,
)
from dyknow.mtl.progression.state_test import Bound
from dyknow.mtl.progression.templates import Following, Shape


class FormulaTable:
    """Makes residuals, and remembers those of late; invariant: equal ones of one generation are the same object.

    Deadlines are absolute, so new residuals come for ever. When there are twice as many as were in use the last time,
    all are forgotten: a new generation starts, and each progressor brings in again what it still needs (`adopt`).

    Parameters
    ----------
    least_kept : how many residuals are always remembered.

    Attributes
    ----------
    generation : how often the table forgot.
    """

    def __init__(self, least_kept: int = 10_000) -> None:
        self._least_kept = least_kept
        self.generation = 0
        self._made: dict[object, Residual] = {}
        self._implied: Implied = {}
        self._limit = least_kept
        self._adopted = 0

    def __len__(self) -> int:
        """Count the residuals that are remembered."""
        return len(self._made)

    def adopt(self, residual: Residual) -> Residual:
        """Bring a residual of an older generation into this one."""
        match residual:
            case Waiting(shape, bound, start_us, end_us):
                adopted: Residual = self.waiting(shape, bound, start_us, end_us)
            case Expected(following, bound):
                adopted = self.expected(following, bound)
            case Guarded(sort, member, inner):
                adopted = self.guarded(sort, member, self.adopt(inner))
            case Junction(is_conjunction, parts):
                adopted = self.join(list(map(self.adopt, parts)), is_conjunction=is_conjunction)
            case _:
                return residual
        self._adopted += 1
        return adopted

    def waiting(self, shape: Shape, bound: Bound, start_us: int, end_us: int) -> Waiting:
        """Make an obligation over a window."""
        key = (shape, bound, start_us, end_us)
        found = self._made.get(key)
        if found is None:
            found = self._made[key] = Waiting(shape, bound, start_us, end_us)
        return cast(Waiting, found)

    def expected(self, following: Following, bound: Bound) -> Expected:
        """Make an obligation for the next state."""
        return cast(Expected, self._made.setdefault((following, bound), Expected(following, bound)))

    def guarded(self, sort: str, member: str, inner: Residual) -> Residual:
        """Tie a residual to a member of a sort; what is known already needs no member."""
        if isinstance(inner, Known):
            return inner
        return self._made.setdefault((sort, member, inner), Guarded(sort, member, inner))

    def join(self, parts: Iterable[Residual], *, is_conjunction: bool) -> Residual:
        """Join residuals, leaving out what others make superfluous."""
        neutral, decisive = (TRUE, FALSE) if is_conjunction else (FALSE, TRUE)
        flat: dict[Residual, None] = {}
        for part in parts:
            if part is decisive:
                return decisive
            if part is neutral:
                continue
            if type(part) is Junction and part.is_conjunction is is_conjunction:
                for inner in part.parts:
                    flat[inner] = None
            else:
                flat[part] = None
        if not flat:
            return neutral
        if len(flat) == 1:
            return next(iter(flat))
        kept = self._merged(flat, is_conjunction=is_conjunction)
        if len(kept) == 1:
            return kept[0]
        key = (is_conjunction, frozenset(kept))
        found = self._made.get(key)
        if found is None:
            found = self._made[key] = Junction(is_conjunction, tuple(kept))
        return found

    # ---- merging

    def _merged(self, parts: Iterable[Residual], *, is_conjunction: bool) -> list[Residual]:
        waiting: dict[tuple[Shape, Bound], list[Waiting]] = {}
        guarded: dict[tuple[str, str], list[Guarded]] = {}
        kept: list[Residual] = []
        compound: list[Residual] = []
        for part in parts:
            if type(part) is Waiting:  # isinstance costs twice as much here
                key = (part.shape, part.bound)
                if key in waiting:
                    waiting[key].append(part)
                else:
                    waiting[key] = [part]
            elif type(part) is Guarded:
                guarded.setdefault((part.sort, part.member), []).append(part)
            elif type(part) is Junction:
                compound.append(part)
            else:
                kept.append(part)
        for windows in waiting.values():
            if len(windows) == 1:
                kept.append(windows[0])
            elif windows[0].shape.is_universal is is_conjunction:
                kept += self._united(windows)
            else:
                kept += _narrowest(windows)
        kept += [self._merged_guards(same, is_conjunction=is_conjunction) for same in guarded.values()]
        return _absorbed(kept, compound, self._implied, is_conjunction=is_conjunction) if compound else kept

    def _merged_guards(self, same: list[Guarded], *, is_conjunction: bool) -> Residual:
        """Join what is asked about one member inside its guard."""
        if len(same) == 1:
            return same[0]
        inner = self.join([one.inner for one in same], is_conjunction=is_conjunction)
        return self.guarded(same[0].sort, same[0].member, inner)

    def _united(self, windows: list[Waiting]) -> list[Waiting]:
        """Unite windows that overlap or touch: time is in whole microseconds."""
        ordered = sorted(windows, key=lambda one: (one.start_us, -one.end_us))
        united = [ordered[0]]
        for one in ordered[1:]:
            last = united[-1]
            if one.start_us > last.end_us + 1:
                united.append(one)
            elif one.end_us > last.end_us:
                united[-1] = self.waiting(one.shape, one.bound, last.start_us, one.end_us)
        return united

    # ---- memory

    def forget_if_full(self) -> None:
        """Start a new generation when too much was made; only between states, or equal residuals would differ."""
        if len(self._implied) > 10 * self._limit:
            self._implied = {}
        if len(self._made) <= self._limit:
            return
        self._limit = max(self._least_kept, 2 * self._adopted)
        self._adopted = 0
        self._made = {}
        self._implied = {}
        self.generation += 1


def _narrowest(windows: list[Waiting]) -> list[Waiting]:
    """Keep the windows that have no other one inside them."""
    if len(windows) == 2 and windows[0].start_us == windows[1].start_us:  # by far the commonest case
        return [min(windows, key=_end_us)]
    ordered = sorted(windows, key=lambda one: (one.end_us, -one.start_us))
    kept = [ordered[0]]
    for one in ordered[1:]:
        if one.start_us > kept[-1].start_us:
            kept.append(one)
    return kept


def _absorbed(
    simple: list[Residual], compound: list[Residual], known: Implied, *, is_conjunction: bool
) -> list[Residual]:
    """Leave out each junction that another part makes superfluous; `simple` parts were merged before."""
    kept = list(simple)
    for index, one in enumerate(compound):
        others = (*kept, *compound[index + 1 :])
        if is_conjunction:
            is_needed = not any(implies(other, one, known) for other in others)
        else:
            is_needed = not any(implies(one, other, known) for other in others)
        if is_needed:
            kept.append(one)
    return kept


def _end_us(one: Waiting) -> int:
    return one.end_us
