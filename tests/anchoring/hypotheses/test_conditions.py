"""Three-valued conditions over time."""

from anchoring.hypotheses.conditions import AllOf, HeldFor, NotLostFor, Verdict


def test_held_for_starts_again_after_a_break() -> None:
    condition = HeldFor(("a", "b"), 20)
    states = [(True, True), (True, True), (True, False), (True, True), (True, True), (True, True)]
    verdicts = [condition.progress(10 * k, {"a": a, "b": b}) for k, (a, b) in enumerate(states)]
    assert verdicts == [*[Verdict.UNKNOWN] * 5, Verdict.TRUE]


def test_not_lost_for_forgives_a_short_loss() -> None:
    condition = NotLostFor("a", 20)
    verdicts = [condition.progress(10 * k, {"a": k == 2}) for k in range(6)]
    assert verdicts == [*[Verdict.UNKNOWN] * 5, Verdict.FALSE]


def test_all_of_is_false_as_soon_as_a_part_is() -> None:
    condition = AllOf(HeldFor(("a",), 0), NotLostFor("b", 0))
    assert condition.progress(0, {"a": True, "b": True}) is Verdict.UNKNOWN
    assert condition.progress(1, {"a": False, "b": False}) is Verdict.FALSE
    assert AllOf(HeldFor(("a",), 0), HeldFor(("b",), 0)).progress(0, {"a": True, "b": True}) is Verdict.TRUE


def test_condition_is_idle_only_while_an_equal_state_would_change_nothing() -> None:
    held, kept = HeldFor(("a",), 20), NotLostFor("a", 20)
    assert not held.is_idle
    held.progress(0, {"a": False})
    kept.progress(0, {"a": True})
    assert AllOf(held, kept).is_idle
    held.progress(1, {"a": True})
    assert not AllOf(held, kept).is_idle
    assert held.progress(21, {"a": True}) is Verdict.TRUE
    assert AllOf(held, kept).is_idle
