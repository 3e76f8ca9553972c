"""What a sequence of states says about a formula."""

import numpy as np
import pytest

from anchoring.hypotheses.conditions import Condition
from anchoring.hypotheses.conditions import Verdict as LinkVerdict
from dyknow.mtl import formula as model
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression import automaton
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, StateError, Verdict
from tests.cases import seeds
from tests.dyknow.mtl.support import agrees_with_the_oracle, pick, random_formula, random_states, verdicts

TRUE, FALSE, UNKNOWN = Verdict.TRUE, Verdict.FALSE, Verdict.UNKNOWN
SHORT = {TRUE: "T", FALSE: "F", UNKNOWN: "?"}
ORDER = (FALSE, UNKNOWN, TRUE)


def run(text: str, states: str, *, shared: SharedWork | None = None) -> str:
    """Progress a formula; states are written `5pq`: p and q at 5 us; `5?p`: p is not known at 5 us, the rest false."""
    progressor = Progressor(parse_formula(text), shared=shared)
    shown = []
    for written in states.split():
        t_us = int("".join(c for c in written if c.isdigit()))
        values = {name: (None if f"?{name}" in written else name in written) for name in "pqr"}
        shown.append(SHORT[progressor.progress(t_us, DictState(values))])
    return "".join(shown) + SHORT[progressor.finish()]


@seeds(range(2000), kept=200)
def test_random_formulas_agree_with_direct_evaluation(seeds: range) -> None:
    for seed in seeds:
        agrees_with_the_oracle(seed, remembers=seed % 2 == 0)


@seeds(range(5000, 6000), kept=100)
def test_random_formulas_agree_where_no_automaton_helps(seeds: range, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automaton, "_MOST_STEPS", 0)  # as with irregular times: lulls remember the steps
    for seed in seeds:
        agrees_with_the_oracle(seed, remembers=True)


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(40))
def test_many_random_formulas_agree_with_direct_evaluation(chunk: int) -> None:
    for seed in range(10_000 + 500 * chunk, 10_000 + 500 * (chunk + 1)):
        agrees_with_the_oracle(seed, remembers=seed % 2 == 0)


@pytest.mark.parametrize(
    ("text", "states", "expected"),
    [
        ("p", "5p 6", "TTT"),
        ("eventually[0us, 3us] p", "5 7 8p", "??TT"),
        ("eventually[0us, 3us] p", "5 7 8", "??FF"),
        ("eventually[0us, 3us] p", "5 7 9p", "??FF"),
        ("always[0us, 3us] p", "5p 7p 8p", "??TT"),
        ("always[0us, 3us] p", "5p 7p 8", "??FF"),
        ("always[0us, 3us] p", "5p 7p 9", "??TT"),
        ("eventually[2us, 3us] p", "5p 6p 8", "??FF"),
        ("eventually[2us, 3us] p", "5 7p", "?TT"),
        ("always[2us, 3us] p", "5 6 7p 8p", "???TT"),
        ("always[2us, oo] p", "5 6 7p 9p", "????T"),
        ("eventually[0us, 0us] p", "5 6p", "FFF"),
        ("always[0us, 0us] p", "5p 6", "TTT"),
        ("p until[0us, 3us] q", "5p 7p 8q", "??TT"),
        ("p until[0us, 3us] q", "5p 7 8q", "?FFF"),
        ("p until[0us, 3us] q", "5p 7p 8p", "??FF"),
        ("p until[0us, 3us] q", "5q", "TT"),
        ("p until[2us, 3us] q", "5q 7q", "FFF"),
        ("p until[2us, 3us] q", "5p 6p 8q", "??TT"),
        ("p until q", "5p 900p 9000p", "???F"),
        ("not (p until q)", "5p 900p 9000p", "???T"),
        ("next p", "5 9p", "?TT"),
        ("next next p", "5 9p 10", "??FF"),
        ("next p", "5p", "?F"),
        ("not next p", "5p", "?T"),
        ("always (p implies next q)", "5p 6q 7p 8", "???FF"),
        ("always eventually[0us, 2us] p", "1p 3 4 5", "???FF"),
        ("tolerate(p, 2us, 1us)", "1 3p 4p", "??TT"),
        ("tolerate(p, 2us, 1us)", "1 3p 4", "??FF"),
        ("p iff eventually[0us, 1us] q", "1p 2q", "?TT"),
        ("p iff eventually[0us, 1us] q", "1 2q", "?FF"),
    ],
)
def test_verdict_after_each_state_and_at_the_end(text: str, states: str, expected: str) -> None:
    assert run(text, states) == expected
    assert run(text, states, shared=SharedWork(remembers=False)) == expected


@pytest.mark.parametrize(
    ("text", "states", "expected"),
    [
        ("always p", "1p 2?p 3p", "????"),
        ("always p", "1p 2?p 3", "??FF"),
        ("eventually p", "1 2?p 3p", "??TT"),
        ("eventually[0us, 2us] p", "1 2?p 3 4p", "?????"),
        ("p or not p", "1?p", "??"),
        ("?p or q".replace("?", ""), "1?pq", "TT"),
        ("p and q", "1?p", "FF"),
    ],
)
def test_what_is_not_known_stays_open_unless_the_rest_decides(text: str, states: str, expected: str) -> None:
    assert run(text, states) == expected


def test_a_missing_value_can_make_unknown_final() -> None:
    progressor = Progressor(parse_formula("eventually[0us, 2us] p"))
    assert not progressor.is_final
    for t_us, value in ((1, False), (2, None), (3, False)):
        progressor.progress(t_us, DictState({"p": value}))
    assert (progressor.verdict, progressor.is_final) == (UNKNOWN, True)


def cars(values: dict[str, bool]) -> DictState:
    return DictState({("p", (car,)): value for car, value in values.items()}, {"Car": list(values)})


def run_cars(text: str, *states: dict[str, bool]) -> str:
    progressor = Progressor(parse_formula(text))
    shown = [SHORT[progressor.progress(t_us, cars(values))] for t_us, values in enumerate(states)]
    return "".join(shown) + SHORT[progressor.finish()]


def test_a_quantifier_means_the_members_of_the_state_where_it_is_asked() -> None:
    assert run_cars("forall ?c in Car: eventually p[?c]", {"a": False}, {"a": True, "b": False}) == "?TT"
    assert run_cars("always forall ?c in Car: p[?c]", {"a": True}, {"a": True, "b": False}) == "?FF"
    assert run_cars("always exists ?c in Car: p[?c]", {"a": True}, {}) == "?FF"


def test_what_is_asked_about_an_object_that_has_left_is_unknown() -> None:
    every = "always forall ?c in Car: eventually[0us, 2us] p[?c]"
    assert run_cars(every, {"a": False, "b": True}, {"b": True}, {"b": True}) == "????"
    assert run_cars(every, {"a": False, "b": True}, {"b": True}, {"a": True, "b": True}) == "????"
    assert run_cars(every, {"a": False}, {}, {"b": False}, {"b": False}, {"b": False}) == "????FF"


def test_a_window_that_is_over_when_its_object_leaves_has_its_answer() -> None:
    progressor = Progressor(parse_formula("forall ?c in Car: always[0us, 5us] p[?c]"))
    assert progressor.progress(0, cars({"a": True})) is UNKNOWN
    assert progressor.progress(6, cars({})) is TRUE


def test_two_variables_may_mean_the_same_object() -> None:
    assert run_cars("exists ?a in Car, ?b in Car: ?a != ?b and p[?a] and p[?b]", {"a": True, "b": False}) == "FF"
    assert run_cars("exists ?a in Car, ?b in Car: p[?a] and p[?b]", {"a": True, "b": False}) == "TT"


def test_nothing_is_kept_about_objects_that_left() -> None:
    progressor = Progressor(parse_formula("always forall ?c in Car: eventually p[?c]"))
    sizes = []
    for t_us in range(500):
        progressor.progress(t_us, cars({f"car{k}": False for k in range(t_us, t_us + 3)}))
        sizes.append(progressor.size)
    assert max(sizes) == sizes[10]


def test_states_must_come_in_order_of_time() -> None:
    for text in ("always p", "always forall ?c in Car: eventually p"):
        progressor = Progressor(parse_formula(text))
        progressor.progress(5, DictState({"p": True}))
        with pytest.raises(StateError, match="expected a state later than 5 us, got one at 5 us"):
            progressor.progress(5, DictState({"p": True}))


def test_order_of_time_is_checked_where_steps_are_remembered() -> None:
    progressor = Progressor(parse_formula("always eventually[0us, 900us] p"))
    for k in range(60):  # at ever longer steps, which no automaton holds
        progressor.progress(k * k, DictState({"p": True}))
    with pytest.raises(StateError, match="expected a state later than 3481 us, got one at 3481 us"):
        progressor.progress(59 * 59, DictState({"p": True}))


def test_every_free_variable_needs_an_object() -> None:
    formula = parse_formula("p[?a] and q[?b]", variables=["a", "b"])
    with pytest.raises(StateError, match=r"expected an object for each free variable, got none for \['b'\]"):
        Progressor(formula, {"a": "car7"})


def test_verdict_is_unknown_before_the_first_state() -> None:
    progressor = Progressor(parse_formula("p"))
    assert (progressor.verdict, progressor.finish(), progressor.size) == (UNKNOWN, UNKNOWN, 0)


@pytest.mark.parametrize("step_us", [1000, 1234])
def test_is_idle_when_more_of_the_same_changes_nothing(step_us: int) -> None:
    progressor = Progressor(parse_formula("always eventually[0s, 1s] p"))
    idle = []
    for k, value in enumerate((True, True, False, False, True, True)):
        progressor.progress(step_us * k * (k + 1), DictState({"p": value}))
        idle.append(progressor.is_idle)
    assert idle == [False, True, False, False, False, True]


def test_progressors_that_share_work_answer_as_if_alone() -> None:
    for seed in range(150):
        rng = np.random.default_rng([7, seed])
        formulas = [random_formula(rng, 1 + pick(rng, 3)) for _ in range(4)]
        states = random_states(rng, 8)
        shared = SharedWork(least_kept=20)
        together = [Progressor(one, shared=shared) for one in formulas]
        found = [[one.progress(t_us, state) for one in together] for t_us, state in states]
        assert [list(row) for row in zip(*found, strict=True)] == [verdicts(one, states)[:-1] for one in formulas], seed


def test_one_formula_about_many_objects_keeps_them_apart() -> None:
    formula = parse_formula("always eventually[0us, 2us] p[?c]", variables=["c"])
    shared = SharedWork()
    progressors = {name: Progressor(formula, {"c": name}, shared=shared) for name in "ab"}
    for t_us in range(4):
        state = DictState({("p", ("a",)): True, ("p", ("b",)): t_us == 0})
        found = {name: one.progress(t_us, state) for name, one in progressors.items()}
    assert found == {"a": UNKNOWN, "b": FALSE}


@pytest.mark.long
def test_joining_formulas_joins_their_verdicts() -> None:
    """Merging obligations of several formulas must not change what each of them says."""
    for seed in range(300):
        rng = np.random.default_rng([8, seed])
        parts = tuple(random_formula(rng, 2) for _ in range(3))
        states = random_states(rng, 8, unknown=0.02)
        alone = [[ORDER.index(one) for one in verdicts(part, states)] for part in parts]
        assert verdicts(model.And(parts), states) == [ORDER[min(row)] for row in zip(*alone, strict=True)], seed
        assert verdicts(model.Or(parts), states) == [ORDER[max(row)] for row in zip(*alone, strict=True)], seed


class FormulaCondition:
    """A formula as a condition of a link, as an adapter would make it."""

    def __init__(self, text: str) -> None:
        self._progressor = Progressor(parse_formula(text))

    def progress(self, t_us: int, state: object) -> LinkVerdict:
        return LinkVerdict(self._progressor.progress(t_us, DictState(state)).value)  # type: ignore[arg-type]

    @property
    def is_idle(self) -> bool:
        return self._progressor.is_idle


def test_a_formula_serves_as_condition_of_a_link() -> None:
    condition: Condition = FormulaCondition("eventually always[0us, 2us] visible")
    found = [condition.progress(t_us, {"visible": t_us != 1}).value for t_us in range(5)]
    assert found == ["unknown", "unknown", "unknown", "unknown", "true"]
    assert condition.is_idle
