"""Values of attributes over time."""

from collections.abc import Callable
from random import Random

from chronicles.events import Event
from chronicles.execution.live.plain_data import to_plain
from chronicles.execution.obligations.history import AttributeHistory


def history(*changes: tuple[str, int, str, str], default: str = "unknown") -> AttributeHistory:
    kept = AttributeHistory(["p"], [("p", default)])
    for thing, t_us, old, new in changes:
        kept.append(Event("p", (thing,), t_us, old, new))
    return kept


def test_value_holds_from_its_change_up_to_the_next() -> None:
    kept = history(("a", 10, "off", "on"), ("a", 20, "on", "off"))
    assert kept.value_throughout("p", ("a",), 10, 20) == "on"
    assert kept.value_throughout("p", ("a",), 10, 21) is None
    assert kept.value_throughout("p", ("a",), 20, 99) == "off"


def test_value_is_unknown_or_the_default_before_the_first_change() -> None:
    assert history().value_throughout("p", ("a",), 0, 9) == "unknown"
    assert history(("a", 10, "on", "off"), default="off").value_throughout("p", ("a",), 0, 10) == "off"


def test_order_of_changes_at_one_time_does_not_matter() -> None:
    for changes in ((("off", "on"), ("on", "gone")), (("on", "gone"), ("off", "on"))):
        kept = history(("a", 5, "unknown", "off"), *(("a", 10, old, new) for old, new in changes))
        assert kept.value_throughout("p", ("a",), 10, 11) == "gone"


def test_change_and_change_back_at_one_time_is_no_change() -> None:
    kept = history(("a", 5, "unknown", "on"), ("a", 10, "on", "off"), ("a", 10, "off", "on"))
    assert kept.value_throughout("p", ("a",), 5, 20) == "on"


def test_forgetting_keeps_the_value_that_still_lasts() -> None:
    kept = history(("a", 5, "unknown", "on"), ("a", 10, "on", "off"), ("b", 3, "on", "unknown"))
    assert kept.forget_before("p", 50, 50) == 1
    assert kept.value_throughout("p", ("a",), 50, 60) == "off"


def test_forgotten_things_are_found_no_more_and_unknown() -> None:
    kept = history(("a", 5, "unknown", "on"), ("b", 3, "on", "unknown"))
    kept.index_by("p", ())
    assert kept.matching("p", (), ()) == ()
    kept = AttributeHistory(["p"], [])
    kept.index_by("p", ())
    for thing, new in (("a", "on"), ("b", "unknown")):
        kept.append(Event("p", (thing,), 3, "off", new))
    assert kept.matching("p", (), ()) == (("a",), ("b",))
    kept.forget_before("p", 10, 10)
    assert kept.matching("p", (), ()) == (("a",),)
    assert kept.value_throughout("p", ("b",), 10, 20) == "unknown"


def test_what_is_unknown_may_be_forgotten_sooner_than_what_is_known() -> None:
    kept = history(("a", 5, "unknown", "on"), ("a", 10, "on", "unknown"), ("b", 5, "unknown", "on"))
    assert kept.forget_before("p", 1, 10) == 2
    assert kept.forget_before("p", 1, 11) == 1
    assert kept.value_throughout("p", ("a",), 5, 6) == "unknown"
    assert kept.value_throughout("p", ("b",), 5, 6) == "on"


def test_value_comes_with_the_hypotheses_of_the_change_that_brought_it() -> None:
    kept = AttributeHistory(["p"], [])
    for t_us, new, labels in ((5, "on", ("h2",)), (5, "on", ("h1",)), (9, "on", ("h3",)), (12, "off", ())):
        kept.append(Event("p", ("a",), t_us, "unknown", new, labels))
    assert kept.values_within("p", ("a",), 6, 8) == [("on", ("h1", "h2"))]
    assert kept.values_within("p", ("a",), 0, 20) == [("unknown", ()), ("on", ("h1", "h2")), ("off", ())]
    assert kept.values_within("p", ("a",), 9, 10) == [("on", ("h3",))]
    kept.forget_before("p", 10, 10)
    assert kept.values_within("p", ("a",), 10, 12) == [("on", ("h3",))]


def test_assigned_value_lasts_up_to_the_next_change() -> None:
    kept = history(("a", 5, "unknown", "off"), ("a", 20, "off", "blue"))
    change = kept.assign(Event("p", ("a",), 10, None, "on"))
    assert change == Event("p", ("a",), 10, "off", "on")
    assert kept.assign(Event("p", ("a",), 15, None, "on")) is None
    assert [kept.value_throughout("p", ("a",), t_us, t_us + 1) for t_us in (9, 10, 19, 20)] == [
        "off",
        "on",
        "on",
        "blue",
    ]
    kept.append(change)  # comes back as an event, and is known already
    assert kept.value_throughout("p", ("a",), 20, 99) == "blue"


def test_restored_history_equals_the_one_that_gave_its_state() -> None:
    kept = history()
    kept.index_by("p", ())
    kept.append(Event("p", ("b",), 7, "on", "off"))
    kept.append(Event("p", ("a",), 9, "on", "off", ("h",)))
    kept.assign(Event("p", ("c",), 8, None, "on"))
    restored = history()
    restored.index_by("p", ())
    restored.restore(kept.state())
    assert to_plain(restored.state()) == to_plain(kept.state())
    assert restored.matching("p", (), ()) == (("b",), ("a",), ("c",))
    assert restored.values_within("p", ("a",), 0, 20) == kept.values_within("p", ("a",), 0, 20)


def test_filled_history_answers_as_one_that_got_its_changes_one_by_one() -> None:
    random = Random(1)
    changes = [
        Event("p", (random.choice("abcdef"),), t_us // 2, *random.sample(["on", "off", "unknown"], 2), labels)
        for t_us in range(60)
        for labels in ((), ("h",))[: random.randint(0, 2)]
    ]
    things = [(thing,) for thing in "abcdefg"]
    windows = [(start_us, start_us + length_us) for start_us in range(-1, 31) for length_us in (1, 2, 7)]

    def answers(kept: AttributeHistory) -> list[object]:
        values = [kept.values_within("p", args, *window) for args in things for window in windows]
        same = [kept.value_throughout("p", args, *window) for args in things for window in windows]
        return [values, same, [kept.is_reported("p", args, t_us) for args in things for t_us in range(31)]]

    def matching(kept: AttributeHistory) -> set[tuple[str, ...]]:
        return set(kept.matching("p", (), ()))

    def left(kept: AttributeHistory) -> int:
        return kept.forget_before("p", 20, 25)

    def state(kept: AttributeHistory) -> list[object]:
        fluents, *others = kept.state()
        return [sorted(fluents), *others]

    asked: list[Callable[[AttributeHistory], object]] = [answers, matching, left, state]
    for first in asked:  # each once as the first one that looks
        one_by_one, filled = AttributeHistory(["p"], []), AttributeHistory(["p"], [])
        for kept in (one_by_one, filled):
            kept.index_by("p", ())
        for change in changes:
            one_by_one.append(change)
        filled.fill([Event("q", (), 0, "off", "on"), Event("p", ("g",), 0), *changes])
        for ask in (first, *asked):
            assert ask(filled) == ask(one_by_one)
