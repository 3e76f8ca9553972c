"""What do the states so far say about a formula? The one class that a user of formulas needs.

A progressor takes one state after another and keeps what is left of its formula. Progressors with a common
`SharedWork` do equal work once: the same question about the same state, and the same formula about other objects.
"""

from collections.abc import Mapping

from dyknow.mtl.formula import Formula
from dyknow.mtl.printer import print_formula
from dyknow.mtl.progression import progression
from dyknow.mtl.progression.automaton import Place, Step, residual_at, verdict_of
from dyknow.mtl.progression.residual import Known, Residual, is_timeless, next_end_us, size_of_residual
from dyknow.mtl.progression.residual_printer import formula_with_objects, print_residual
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import State, StateError, Verdict
from dyknow.mtl.progression.templates import NEVER_US
from dyknow.mtl.structure import free_variables

_LONGEST_SHOWN = 100


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
    >>> from dyknow.mtl.progression.states import DictState
    >>> green = Progressor(parse_formula("always eventually[0s, 2s] green"))
    >>> [green.progress(t_us, DictState({"green": t_us < 2_000_000})).value for t_us in range(0, 5_000_000, 1_000_000)]
    ['unknown', 'unknown', 'unknown', 'unknown', 'false']
    >>> moved = Progressor(parse_formula("eventually speed[?c] > 2 m/s", variables=["c"]), {"c": "car7"})
    >>> moved.progress(0, DictState({}))
    <Verdict.UNKNOWN: 'unknown'>
    >>> moved.progress(40_000, DictState({("speed", ("car7",)): 2.5}))
    <Verdict.TRUE: 'true'>
    """

    def __init__(
        self,
        formula: Formula,
        objects: Mapping[str, str] = {},
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
        self._t_us: int | None = None  # of the last state
        # A promise that the next state has to keep. While there is one the automaton is put aside, so that `progress`
        # need not look for promises where every nanosecond counts.
        self._least_us: int | None = None
        # What is left of the formula, in one of two forms; both are None before the first state.
        self._place: Place | None = None
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
    def next_deadline_us(self) -> int | None:
        """The earliest end of a window; None if none ends. Only `advance` beyond it can tell more without a state."""
        residual = self._current()
        end_us = NEVER_US if residual is None else next_end_us(residual)
        return None if end_us == NEVER_US else end_us

    @property
    def size(self) -> int:
        """Count the nodes of what is left of the formula; 0 before the first state."""
        if self._place is not None:
            return self._place.size
        return 0 if self._residual is None else size_of_residual(self._residual)

    @property
    def remaining(self) -> str:
        """Write what is left of the formula: asked in the last state, it means what the states to come must satisfy.

        It can be read again unless ``<unknown>`` is in it, which stands for what will never be known. Before the first
        state it is the formula.

        Examples
        --------
        >>> from dyknow.mtl.parser import parse_formula
        >>> from dyknow.mtl.progression.states import DictState
        >>> goes_on = Progressor(parse_formula("always (stopped implies eventually[0s, 1min] not stopped)"))
        >>> for t_us, stopped in ((0, False), (10_000_000, True), (25_000_000, True)):
        ...     verdict = goes_on.progress(t_us, DictState({"stopped": stopped}))
        >>> goes_on.remaining
        'always[1us, oo] (stopped implies eventually[0s, 1min] not stopped) and eventually[1us, 45s] not stopped'
        """
        residual, source_of = self._current(), self._shared.templates.source_of
        if residual is None:
            return print_formula(formula_with_objects(self._template, self._bound, source_of))
        return print_residual(residual, self._t_us if self._t_us is not None else 0, source_of)

    def __repr__(self) -> str:
        """Show the verdict and what is left."""
        return f"<Progressor {self.verdict.value}: {_shortened(self.remaining)}>"

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
            if self._least_us is not None:
                return self._resume(self._least_us, t_us, state)
            return self._keep(self._progressed(t_us, state), t_us, self._residual)
        place = self._place
        if place is None and last_us is not None:
            return self._keep(self._progressed(t_us, state), t_us, self._residual)
        edges = automaton.start if place is None else place.edges
        step = (None if last_us is None else t_us - last_us, automaton.values(state, self._bound))
        following = edges.get(step)
        if following is None:
            return self._extend(edges, step, t_us, state)
        self._t_us, self._before, self._place = t_us, place, following
        return following.verdict

    def advance(self, t_us: int) -> Verdict:
        """Let time pass: no state will come before `t_us`, so windows that end before it are over.

        A state at `t_us` itself may still come, and a window that ends there may still see it.

        Parameters
        ----------
        t_us : a promise about the states to come. One that says no more than what is known already is no mistake.

        Returns
        -------
        What is known: final if true or false, as after a state.

        Examples
        --------
        >>> from dyknow.mtl.parser import parse_formula
        >>> from dyknow.mtl.progression.states import DictState
        >>> soon = Progressor(parse_formula("eventually[0s, 1s] p"))
        >>> soon.progress(0, DictState({"p": False})), soon.next_deadline_us
        (<Verdict.UNKNOWN: 'unknown'>, 1000000)
        >>> soon.advance(1_000_000), soon.advance(1_000_001)
        (<Verdict.UNKNOWN: 'unknown'>, <Verdict.FALSE: 'false'>)
        """
        known_us = self._t_us if self._least_us is None else self._least_us - 1
        if known_us is not None and t_us <= known_us + 1:
            return self.verdict
        self._least_us, self._automaton = t_us, None
        place, last_us = self._place, self._t_us
        if last_us is None or (place is not None and t_us - last_us <= place.next_end_us):
            return self.verdict
        self._let_pass(t_us, last_us)
        return self.verdict

    def finish(self) -> Verdict:
        """End the sequence: what the states say if they are all there is.

        What should have happened and did not is false, what should not and did not is true. Before the first state
        nothing is known. The last verdict of `progress` tells what holds whatever might still come.
        """
        residual = self._current()
        if residual is None:
            return Verdict.UNKNOWN
        self._place = None
        return self._keep(progression.finish(residual), self._t_us, residual)

    def _let_pass(self, t_us: int, last_us: int) -> None:
        """Close the windows that end before a time, at which no state has come."""
        table, residual = self._shared.table, self._current()
        assert residual is not None
        if self._generation != table.generation:
            residual = self._adopted(residual)
        after = progression.advance(residual, t_us, table)
        if after is residual:
            return
        place, self._place = self._place, None
        automaton = self._shared.automaton(self._template)
        if automaton is not None and place is not None and not isinstance(after, Known):
            self._place = automaton.place_of(after, last_us)
        self._before, self._residual, self._residual_us = residual, after, last_us

    def _resume(self, least_us: int, t_us: int, state: State) -> Verdict:
        """Take the first state after a promise."""
        if t_us < least_us:
            raise StateError(
                f"{self._where()}: expected a state at {least_us} us or later as promised, got one at {t_us!r} us"
            )
        self._least_us, self._automaton = None, self._shared.automaton(self._template)
        return self.progress(t_us, state)

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

    def _keep(self, residual: Residual, t_us: int | None, before: Place | Residual | None) -> Verdict:
        self._before, self._residual, self._t_us = before, residual, t_us
        return verdict_of(residual)

    def _progressed(self, t_us: int, state: State) -> Residual:
        if self._t_us is not None and t_us <= self._t_us:
            raise StateError(f"{self._where()}: expected a state later than {self._t_us} us, got one at {t_us!r} us")
        moment, table = self._shared.moment(t_us, state), self._shared.table
        residual = self._current()
        if residual is None:
            self._generation = table.generation
            return progression.ask(self._template, self._bound, moment, table)
        if self._generation != table.generation:
            residual = self._adopted(residual)
        return progression.progress(residual, moment, table)

    def _adopted(self, residual: Residual) -> Residual:
        """Bring what is left into the present generation of the table."""
        self._generation = self._shared.table.generation
        return self._shared.table.adopt(residual)

    def _where(self) -> str:
        return f"progressor of {_shortened(self.remaining)!r}"

    def _current(self) -> Residual | None:
        if self._place is None or self._residual_us == self._t_us:
            return self._residual
        assert self._t_us is not None
        return residual_at(self._place.relative, self._bound, self._t_us, self._shared.table)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."
