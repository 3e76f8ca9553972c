"""Three-valued conditions over time."""

from anchoring.hypotheses.conditions import HeldFor, NotLostFor, Verdict


def test_held_for_starts_again_after_a_break() -> None:
    condition = HeldFor(("a", "b"), 20)
    states = [(True, True), (True, True), (True, False), (True, True), (True, True), (True, True)]
    verdicts = [condition.progress(10 * k, {"a": a, "b": b}) for k, (a, b) in enumerate(states)]
    assert verdicts == [*[Verdict.UNKNOWN] * 5, Verdict.TRUE]


def test_not_lost_for_forgives_a_short_loss() -> None:
    condition = NotLostFor({"a": 20})
    verdicts = [condition.progress(10 * k, {"a": k == 2}) for k in range(6)]
    assert verdicts == [*[Verdict.UNKNOWN] * 5, Verdict.FALSE]


def test_not_lost_for_is_false_as_soon_as_one_fluent_failed_for_its_time() -> None:
    states = [(True, True), (False, True), (False, False), (True, False), (False, False), (True, False)]
    condition = NotLostFor({"a": 20, "b": 30})
    verdicts = [condition.progress(10 * k, {"a": a, "b": b}) for k, (a, b) in enumerate(states)]
    assert verdicts == [*[Verdict.UNKNOWN] * 5, Verdict.FALSE]


def test_condition_is_idle_only_while_an_equal_state_would_change_nothing() -> None:
    held, kept = HeldFor(("a",), 20), NotLostFor({"a": 20, "b": 20})
    assert not held.is_idle
    assert not kept.is_idle
    held.progress(0, {"a": False})
    kept.progress(0, {"a": True, "b": True})
    assert held.is_idle
    assert kept.is_idle
    held.progress(1, {"a": True})
    kept.progress(1, {"a": True, "b": False})
    assert not held.is_idle
    assert not kept.is_idle
    assert held.progress(21, {"a": True}) is Verdict.TRUE
    assert held.is_idle
