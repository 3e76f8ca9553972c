"""A watch says what the definition says, and what progression says, whoever else sees the states."""

import numpy as np
import pytest

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, Verdict
from dyknow.mtl.structure import free_variables
from dyknow.mtl.watching.plan import plan_of
from dyknow.mtl.watching.watch import Watch, Watching
from tests.dyknow.mtl.oracle import Sequences
from tests.dyknow.mtl.support import VERDICTS, pick, random_formula, random_states

NESTED = "always (p implies eventually[0us, 20us] always[0us, 9us] (q and eventually[2us, 8us] p))"


def watching_of(formula: Formula) -> Watching | None:
    plan = plan_of(formula, free_variables(formula))
    return None if plan is None else Watching(plan)


def drawn_formula(rng: np.random.Generator) -> Formula:
    formula = random_formula(rng, 1 + pick(rng, 4))
    return formula if rng.random() < 0.5 else model.Always(formula, model.Window(0, None))


@pytest.mark.parametrize("count", [1000, pytest.param(40_000, marks=pytest.mark.slow)])
def test_verdicts_are_those_of_the_definition_while_time_passes(count: int) -> None:
    told = 0
    for seed in range(count):
        rng = np.random.default_rng([7, seed])
        formula = drawn_formula(rng)
        watching = watching_of(formula)
        if watching is None:
            continue
        states = random_states(rng, 3 + pick(rng, 12), unknown=0.05 * pick(rng, 3), step_us=1 + pick(rng, 5))
        watch = watching.watch(())
        for k, (t_us, state) in enumerate(states):
            end_us = states[k + 1][0] if k + 1 < len(states) else t_us + 6
            promises = sorted(int(one) for one in rng.integers(t_us - 1, end_us + 1, pick(rng, 4)))
            for promise_us in (None, *promises):
                verdict = watch.progress(t_us, state) if promise_us is None else watch.advance(promise_us)
                so_far = Sequences(states[: k + 1], has_ended=False, least_us=promise_us or 0)
                assert verdict is VERDICTS.get(so_far.holds(formula, 0, {}), Verdict.UNKNOWN), (seed, t_us, formula)
                if verdict is not Verdict.UNKNOWN or watch.is_final:
                    break
            told += verdict is not Verdict.UNKNOWN
            if watch.is_final:
                assert Sequences(states, has_ended=False).holds(formula, 0, {}) not in VERDICTS, (seed, formula)
            if verdict is not Verdict.UNKNOWN or watch.is_final:
                break
    assert told > count // 4


@pytest.mark.long
@pytest.mark.parametrize("count", [300, pytest.param(6000, marks=pytest.mark.slow)])
def test_watches_that_come_and_go_say_what_progressors_say(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dyknow.mtl.watching.watch._KEPT_IN_VAIN", 2)
    compared = 0
    for seed in range(count):
        rng = np.random.default_rng([8, seed])
        formula = model.Always(random_formula(rng, 1 + pick(rng, 4)), model.Window(0, None))
        watching, shared = watching_of(formula), SharedWork()
        if watching is None:
            continue
        live: list[tuple[Progressor, Watch]] = []
        for t_us, state in random_states(rng, 60, unknown=0.02 * pick(rng, 2), step_us=1 + pick(rng, 4)):
            if rng.random() < 0.3:
                live.append((Progressor(formula, shared=shared), watching.watch(())))
            if live and rng.random() < 0.1:
                progressor, watch = live.pop(pick(rng, len(live)))
                assert watch.advance(t_us) is progressor.advance(t_us), (seed, t_us)
            open_still = []
            for progressor, watch in live:
                verdict = watch.progress(t_us, state)
                assert verdict is progressor.progress(t_us, state), (seed, t_us)
                compared += 1
                if verdict is Verdict.UNKNOWN:
                    open_still.append((progressor, watch))
            live = open_still
    assert compared > 10 * count


def test_nothing_is_worked_out_while_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[int] = []
    look = Watch._look

    def counted(watch: Watch, known_us: int) -> Verdict:
        looks.append(known_us)
        return look(watch, known_us)

    monkeypatch.setattr(Watch, "_look", counted)
    watching = watching_of(parse_formula("always (p implies eventually[0us, 30us] q)"))
    assert watching is not None
    watch = watching.watch(())
    for t_us in range(100):
        is_open = 40 <= t_us < 60
        assert watch.progress(t_us, DictState({"p": is_open, "q": not is_open})) is Verdict.UNKNOWN
    assert looks == [0, 40, 60]


def test_times_are_forgotten_with_the_longest_window() -> None:
    watching = watching_of(parse_formula(NESTED))
    assert watching is not None
    rng, watch, most = np.random.default_rng(3), watching.watch(()), 0
    for t_us in range(5000):
        if watch.progress(t_us, DictState({name: rng.random() < 0.9 for name in "pq"})) is not Verdict.UNKNOWN:
            watch = watching.watch(())
        most = max(most, len(watching.times_us))
    assert most < 2 * (40 + 64)


@pytest.mark.parametrize(
    ("text", "is_watched"),
    [
        ("always p", True),
        ("eventually[5us, oo] always[0us, 5us] p", True),
        ("not always (p implies eventually[0us, 9us] q)", True),
        ("always (p implies (q until[2us, 15us] p))", True),
        ("forall ?c in Car: r[?c]", True),
        ("always (p implies eventually q)", False),
        ("always p and always q", False),
        ("always forall ?c in Car: eventually[0us, 9us] r[?c]", False),
        ("always (p implies next q)", False),
    ],
)
def test_what_may_stay_open_for_ever_is_progressed(text: str, is_watched: bool) -> None:
    assert (watching_of(parse_formula(text)) is not None) is is_watched
