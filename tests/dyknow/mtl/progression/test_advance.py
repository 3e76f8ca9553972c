"""What is known when time passes without a state."""

import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression import automaton
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, StateError, Verdict
from tests.cases import seeds
from tests.dyknow.mtl.support import agrees_with_the_oracle_while_time_passes, verdicts

TRUE, FALSE, UNKNOWN = Verdict.TRUE, Verdict.FALSE, Verdict.UNKNOWN


def after_nothing(text: str, *, until_us: int) -> Verdict:
    """Give one state at 10 us, in which q holds and p does not, and let time pass."""
    progressor = Progressor(parse_formula(text))
    progressor.progress(10, DictState({"p": False, "q": True, "r": None}))
    return progressor.advance(until_us)


@seeds(range(1000), kept=100)
def test_random_formulas_agree_with_direct_evaluation(seeds: range) -> None:
    for seed in seeds:
        agrees_with_the_oracle_while_time_passes(seed, remembers=seed % 2 == 0)


@seeds(range(2000, 2500), kept=60)
def test_random_formulas_agree_where_no_automaton_helps(seeds: range, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automaton, "_MOST_STEPS", 0)
    for seed in seeds:
        agrees_with_the_oracle_while_time_passes(seed, remembers=True)


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(16))
def test_many_random_formulas_agree_with_direct_evaluation(chunk: int) -> None:
    for seed in range(10_000 + 500 * chunk, 10_000 + 500 * (chunk + 1)):
        agrees_with_the_oracle_while_time_passes(seed, remembers=seed % 2 == 0)


@pytest.mark.parametrize(
    ("text", "until_us", "expected"),
    [
        ("eventually[0us, 5us] p", 15, UNKNOWN),  # a state at 15 us may come yet
        ("eventually[0us, 5us] p", 16, FALSE),
        ("always[0us, 5us] q", 15, UNKNOWN),
        ("always[0us, 5us] q", 16, TRUE),
        ("q until[0us, 5us] p", 16, FALSE),
        ("not (q until[0us, 5us] p)", 16, TRUE),
        ("eventually[3us, 5us] q", 16, FALSE),
        ("eventually p", 10**9, UNKNOWN),
        ("next p", 10**9, UNKNOWN),
        ("eventually[0us, 5us] r", 16, UNKNOWN),  # it may have been true, and nobody will ever know
        ("always eventually[0us, 5us] p", 16, FALSE),
        ("always (q implies always[0us, 5us] q)", 16, UNKNOWN),
        ("tolerate(p, 5us, 3us)", 15, UNKNOWN),
        ("tolerate(p, 5us, 3us)", 16, FALSE),
    ],
)
def test_a_window_is_over_when_no_state_can_come_in_it(text: str, until_us: int, expected: Verdict) -> None:
    assert after_nothing(text, until_us=until_us) is expected


def test_what_can_never_be_known_is_final() -> None:
    progressor = Progressor(parse_formula("eventually[0us, 5us] p"))
    progressor.progress(0, DictState({}))
    assert not progressor.is_final
    assert (progressor.advance(6), progressor.is_final) == (UNKNOWN, True)


def test_a_promise_that_is_known_already_changes_nothing() -> None:
    progressor = Progressor(parse_formula("eventually[0us, 5us] p"))
    progressor.progress(3, DictState({"p": False}))
    assert [progressor.advance(one) for one in (0, 3, 4, 8, 5)] == [UNKNOWN] * 5
    with pytest.raises(StateError, match="expected a state at 8 us or later as promised, got one at 7 us"):
        progressor.progress(7, DictState({"p": True}))
    assert progressor.progress(8, DictState({"p": True})) is TRUE


@pytest.mark.parametrize("text", ["always eventually[0us, 5us] p", "forall ?c in Car: eventually[0us, 5us] p"])
def test_a_promise_must_be_kept(text: str) -> None:
    progressor = Progressor(parse_formula(text))
    assert progressor.advance(4) is UNKNOWN
    with pytest.raises(StateError, match="expected a state at 4 us or later as promised, got one at 3 us"):
        progressor.progress(3, DictState({"p": True}))
    progressor.progress(4, DictState({"p": False}, {"Car": ["a"]}))
    progressor.advance(7)
    with pytest.raises(StateError, match="expected a state at 7 us or later as promised, got one at 6 us"):
        progressor.progress(6, DictState({"p": True}, {"Car": ["a"]}))
    assert progressor.advance(10) is FALSE


def test_promises_between_states_do_not_keep_an_automaton_from_helping() -> None:
    shared = SharedWork()
    formula = parse_formula("always (p or eventually[0us, 25us] p)")
    progressor = Progressor(formula, shared=shared)
    steps = shared.automaton(shared.templates.make(formula, ()))
    assert steps is not None
    for t_us in range(0, 10_000, 10):
        progressor.progress(t_us, DictState({"p": t_us % 30 == 0}))
        assert progressor.advance(t_us + 10) is UNKNOWN
    assert not steps.is_full
    assert steps.place_count < 10


def test_next_deadline_is_the_earliest_end_of_a_window() -> None:
    progressor = Progressor(parse_formula("always (eventually[0us, 9us] p and (q or always[2us, 5us] q))"))
    assert progressor.next_deadline_us is None
    progressor.progress(10, DictState({"p": False, "q": False}))
    assert progressor.next_deadline_us == 15
    assert progressor.advance(16) is UNKNOWN
    assert progressor.next_deadline_us == 19
    assert progressor.advance(20) is FALSE
    assert progressor.next_deadline_us is None


def test_letting_time_pass_up_to_each_state_changes_no_verdict_on_it() -> None:
    text = "always (p implies (q until[2us, 15us] not p or next q)) and always eventually[3us, 40us] q"
    states = [(7 * k, DictState({"p": k % 3 > 0, "q": k % 5 > 1})) for k in range(60)]
    progressor = Progressor(parse_formula(text))
    found = []
    for t_us, state in states:
        progressor.advance(t_us)
        found.append(progressor.progress(t_us, state))
    assert [*found, progressor.finish()] == verdicts(parse_formula(text), states)
