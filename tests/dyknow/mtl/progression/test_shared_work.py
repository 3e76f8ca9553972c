"""Remembered steps never change an answer, and stay few."""

import numpy as np
import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, Verdict

NESTED = "always (not p implies eventually[0us, 20us] always[0us, 20us] p)"


class CountingState:
    """A state that counts how often it is looked at."""

    def __init__(self, values: dict[str, bool]) -> None:
        self.values = values
        self.looks = 0

    def value(self, feature: str, _arguments: tuple[str, ...]) -> bool:
        self.looks += 1
        return self.values[feature]

    def members(self, _sort: str) -> tuple[str, ...]:
        return ()


@pytest.mark.parametrize("most_step_us", [1, 2, 40])
@pytest.mark.parametrize(
    "text",
    [
        "always eventually[0us, 8us] p",
        NESTED,
        "always (p implies always[3us, 9us] q)",
        "always (p implies always[7us, oo] q)",
        "always (p implies (q until[2us, 15us] p or next q))",
        "always (tolerate(p, 9us, 4us) or eventually[5us, 7us] q)",
    ],
)
@pytest.mark.parametrize("state_count", [500, pytest.param(3000, marks=pytest.mark.slow)])
def test_remembering_does_not_change_verdicts(text: str, most_step_us: int, state_count: int) -> None:
    formula = parse_formula(text)
    ends = 0
    for share in (0.3, 0.8, 0.95):
        rng = np.random.default_rng([most_step_us, int(100 * share)])
        remembering, shared = SharedWork(), SharedWork(remembers=False)
        pair = Progressor(formula, shared=remembering), Progressor(formula, shared=shared)
        t_us = 0
        for _ in range(state_count):
            t_us += 1 + int(rng.integers(most_step_us))
            state = DictState({name: bool(rng.random() < share) for name in "pq"})
            found = [one.progress(t_us, state) for one in pair]
            assert found[0] is found[1]
            assert pair[0].size == pair[1].size
            if found[0] is not Verdict.UNKNOWN:
                ends += 1
                pair = Progressor(formula, shared=remembering), Progressor(formula, shared=shared)
    assert ends > 0


def test_irregular_steps_make_a_progressor_leave_its_automaton() -> None:
    rng = np.random.default_rng(1)
    shared = SharedWork()
    formula = parse_formula(NESTED)
    progressor = Progressor(formula, shared=shared)
    automaton = shared.automaton(shared.templates.make(formula, ()))
    assert automaton is not None
    t_us = 0
    for k in range(2000):
        t_us += 1 + int(rng.integers(1000)) * (k % 50 == 0)
        progressor.progress(t_us, DictState({"p": True}))
    assert automaton.is_full
    assert automaton.place_count < 50


@pytest.mark.long
def test_an_automaton_stops_growing() -> None:
    rng = np.random.default_rng(2)
    shared = SharedWork()
    formula = parse_formula("always (p implies eventually[0us, 300us] always[0us, 300us] q)")
    automaton = shared.automaton(shared.templates.make(formula, ()))
    assert automaton is not None
    for run in range(40):
        progressor = Progressor(formula, shared=shared)
        for t_us in range(run, 600):
            progressor.progress(t_us, DictState({"p": rng.random() < 0.1 and t_us < 300, "q": rng.random() < 0.9}))
    assert automaton.place_count == 1000


def test_formulas_with_members_of_sorts_over_time_have_no_automaton() -> None:
    shared = SharedWork()
    of_time = parse_formula("forall ?c in Car: eventually p[?c]")
    of_states = parse_formula("eventually forall ?c in Car: p[?c]")
    assert shared.automaton(shared.templates.make(of_time, ())) is None
    assert shared.automaton(shared.templates.make(of_states, ())) is not None


def test_equal_progressors_look_at_a_state_once_when_nothing_is_remembered_of_earlier_ones() -> None:
    shared = SharedWork(remembers=False)
    formula = parse_formula("always eventually[0us, 9us] p")
    progressors = [Progressor(formula, shared=shared) for _ in range(100)]
    for t_us in range(50):
        state = CountingState({"p": t_us % 7 > 0})
        for one in progressors:
            one.progress(t_us, state)
        assert state.looks == 1


def test_the_same_time_with_another_state_is_another_moment() -> None:
    shared = SharedWork(remembers=False)
    formula = parse_formula("p")
    verdicts = [Progressor(formula, shared=shared).progress(0, DictState({"p": value})) for value in (True, False)]
    assert verdicts == [Verdict.TRUE, Verdict.FALSE]


def test_formulas_that_leave_the_same_keep_their_tests_apart() -> None:
    shared = SharedWork()
    one = Progressor(parse_formula("p and always q"), shared=shared)
    other = Progressor(parse_formula("always q and p"), shared=shared)
    for k in range(60):  # at ever longer steps, which no automaton holds
        state = DictState({"p": k == 0, "q": True})
        assert one.progress(k * k, state) is other.progress(k * k, state) is Verdict.UNKNOWN
    state = DictState({"p": True, "q": False})
    assert one.progress(3600, state) is other.progress(3600, state) is Verdict.FALSE


def test_a_way_into_a_residual_is_no_rest_in_it() -> None:
    """Idle means that the last step changed nothing, also where the automaton is just left."""
    progressor = Progressor(parse_formula("always (p or eventually q)"))
    steps = [(True, False), (False, False), (False, True)]
    idle = []
    for k in range(60):
        p, q = steps[k % 3]
        progressor.progress(k * k, DictState({"p": p, "q": q}))
        idle.append(progressor.is_idle)
    assert not any(idle[1::3])
    assert not any(idle[2::3])
    assert all(idle[3::3])


def test_a_second_run_over_the_same_states_finds_the_same() -> None:
    shared = SharedWork()
    formula = parse_formula("eventually[0us, 30ms] p")
    times_us = np.cumsum(np.random.default_rng(3).integers(1, 200, 400)).tolist()
    states = [(t_us, DictState({"p": False})) for t_us in times_us]
    runs = []
    for work in (shared, shared, SharedWork(remembers=False)):
        progressor = Progressor(formula, shared=work)
        runs.append([progressor.progress(t_us, state) for t_us, state in states])
    assert runs[0] == runs[1] == runs[2]
    assert runs[0][-1] is Verdict.FALSE


def test_leaving_the_automaton_for_an_older_residual_is_no_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dyknow.mtl.progression.automaton._MOST_STEPS", 2)
    progressor = Progressor(parse_formula("always (p or eventually q)"))
    idle = []
    for t_us, values in ((0, "p"), (1, ""), (2, "q"), (3, ""), (8, "q"), (9, "q")):  # the step to 8 is one too many
        progressor.progress(t_us, DictState({name: name in values for name in "pq"}))
        idle.append(progressor.is_idle)
    assert idle == [False, False, False, False, False, True]
