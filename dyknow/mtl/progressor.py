"""What do the states so far say about a formula? The one class that a user of formulas needs.

A progressor takes one state after another and keeps what is left of its formula. Progressors with a common
`SharedWork` do equal work once: the same question about the same state, and the same formula about other objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dyknow.mtl import progression
from dyknow.mtl.automaton import Place, Step, Values, residual_at, verdict_of
from dyknow.mtl.formula import Formula
from dyknow.mtl.lull import Lull
from dyknow.mtl.printer import print_formula
from dyknow.mtl.residual import Known, Residual, is_timeless, size_of_residual
from dyknow.mtl.shared_work import SharedWork
from dyknow.mtl.states import State, StateError
from dyknow.mtl.structure import free_variables
from dyknow.mtl.verdict import Verdict


class Progressor:
    """Progresses a formula through states of increasing time.

    Parameters
    ----------
    formula : what should hold from the first state on.
    objects : for each free variable of the formula the object that it stands for.
    shared : work shared with other progressors; by default with none.

    Raises
    ------
    StateError
        If a free variable has no object.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.states import DictState
    >>> green = Progressor(parse_formula("always eventually[0s, 2s] green"))
    >>> [green.progress(t_us, DictState({"green": t_us < 2_000_000})).value for t_us in range(0, 5_000_000, 1_000_000)]
    ['unknown', 'unknown', 'unknown', 'unknown', 'false']
    >>> moved = Progressor(parse_formula("eventually speed[?c] > 2 m/s", variables=["c"]), {"c": "car7"})
    >>> moved.progress(0, DictState({}))
    <Verdict.UNKNOWN: 'unknown'>
    >>> moved.progress(40_000, DictState({("speed", ("car7",)): 2.5}))
    <Verdict.TRUE: 'true'>
    """

    __slots__ = (
        "_automaton",
        "_before",
        "_bound",
        "_generation",
        "_lull",
        "_place",
        "_residual",
        "_residual_us",
        "_shared",
        "_t_us",
        "_template",
    )

    def __init__(
        self,
        formula: Formula,
        objects: Mapping[str, str] = MappingProxyType({}),
        *,
        shared: SharedWork | None = None,
    ) -> None:
        variables = free_variables(formula)
        missing = [name for name in variables if name not in objects]
        if missing:
            where = f"formula {print_formula(formula)!r}"
            raise StateError(f"{where}: expected an object for each free variable, got none for {missing!r}")
        self._shared = shared if shared is not None else SharedWork()
        self._template = self._shared.templates.make(formula, variables)
        self._bound = tuple(objects[name] for name in variables)
        self._automaton = self._shared.automaton(self._template)
        self._generation = 0
        self._t_us: int | None = None
        # What is left of the formula, in one of three forms; all are None before the first state.
        self._place: Place | None = None
        self._lull: Lull | None = None
        self._residual: Residual | None = None
        self._residual_us: int | None = None  # beside a place the residual may be of an earlier state
        self._before: Place | Residual | None = None

    @property
    def verdict(self) -> Verdict:
        """What is known so far."""
        if self._place is not None:
            return self._place.verdict
        return Verdict.UNKNOWN if self._residual is None else verdict_of(self._residual)

    @property
    def is_final(self) -> bool:
        """Tell whether no state can change the verdict; an unknown one can be final where values were missing."""
        return isinstance(self._residual, Known)

    @property
    def is_idle(self) -> bool:
        """Tell whether more states equal to the last one would change nothing; False is always safe."""
        if self._place is not None:
            return self._place is self._before and self._place.is_timeless
        if self._residual is None:
            return False
        return self.is_final or (self._residual is self._before and is_timeless(self._residual))

    @property
    def size(self) -> int:
        """Count the nodes of what is left of the formula; 0 before the first state."""
        if self._place is not None:
            return self._place.size
        return 0 if self._residual is None else size_of_residual(self._residual)

    def progress(self, t_us: int, state: State) -> Verdict:
        """Take the next state and say what is known.

        Parameters
        ----------
        t_us : later than that of the state before.
        state : the world at that time; it must not change afterwards.

        Raises
        ------
        StateError
            If the time is not later, or a value is of the wrong type.
        """
        automaton, last_us = self._automaton, self._t_us
        if automaton is None:
            return self._keep(self._progressed(t_us, state), t_us, self._residual)
        values = automaton.values(state, self._bound)
        place = self._place
        if place is not None or last_us is None:
            edges = automaton.start if place is None else place.edges
            step = (None if last_us is None else t_us - last_us, values)
            following = edges.get(step)
            if following is None:
                return self._extend(edges, step, t_us, state)
            self._t_us, self._before, self._place = t_us, place, following
            return following.verdict
        lull = self._lull
        if lull is not None and last_us < t_us < lull.until_us:
            after = lull.edges.get(values)
            if after is not None:
                self._t_us, self._before, self._residual, self._lull = t_us, lull.residual, after.residual, after
                return after.verdict
        return self._keep_lull(lull, values, t_us, state)

    def finish(self) -> Verdict:
        """End the sequence: what the states say if they are all there is.

        What should have happened and did not is false, what should not and did not is true. Before the first state
        nothing is known. The last verdict of `progress` tells what holds whatever might still come.
        """
        residual = self._current()
        if residual is None:
            return Verdict.UNKNOWN
        self._place = self._lull = None
        return self._keep(progression.finish(residual), self._t_us, residual)

    def _extend(self, edges: dict[Step, Place], step: Step, t_us: int, state: State) -> Verdict:
        """Work out where an edge of the automaton leads; leave the automaton if it is full or all is known."""
        assert self._automaton is not None
        residual = self._progressed(t_us, state)
        before = self._place
        is_over = isinstance(residual, Known)
        self._place = None if is_over else self._automaton.add(edges, step, residual, t_us)
        if self._place is None:
            return self._keep(residual, t_us, before)
        self._before, self._residual, self._residual_us, self._t_us = before, residual, t_us, t_us
        return self._place.verdict

    def _keep_lull(self, lull: Lull | None, values: Values, t_us: int, state: State) -> Verdict:
        """Progress, and remember the step if it would be the same at any other time before the next deadline."""
        residual = self._progressed(t_us, state)
        after = self._shared.lull(self._template, residual)
        if lull is not None and t_us < lull.until_us and not self._shared.moment(t_us, state).has_opened:
            lull.edges[values] = after
        self._lull = after
        return self._keep(residual, t_us, self._residual)

    def _keep(self, residual: Residual, t_us: int | None, before: Place | Residual | None) -> Verdict:
        self._before, self._residual, self._t_us = before, residual, t_us
        return verdict_of(residual)

    def _progressed(self, t_us: int, state: State) -> Residual:
        if self._t_us is not None and t_us <= self._t_us:
            raise StateError(f"progressor: expected a state later than {self._t_us} us, got one at {t_us!r} us")
        moment, table = self._shared.moment(t_us, state), self._shared.table
        residual = self._current()
        if residual is None:
            self._generation = table.generation
            return progression.ask(self._template, self._bound, moment, table)
        if self._generation != table.generation:
            residual = table.adopt(residual)
            self._generation = table.generation
        return progression.progress(residual, moment, table)

    def _current(self) -> Residual | None:
        if self._place is None or self._residual_us == self._t_us:
            return self._residual
        assert self._t_us is not None
        return residual_at(self._place.relative, self._bound, self._t_us, self._shared.table)
