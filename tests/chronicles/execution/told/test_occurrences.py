"""Building occurrences, and what is kept to tell each once."""

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.execution.instances import Instance
from chronicles.execution.obligations.conclusions import Conclusions
from chronicles.execution.obligations.history import AttributeHistory
from chronicles.execution.told.occurrences import Finding, OccurrenceBuilder

PAST = AttributeHistory((), ())


def finding(builder: OccurrenceBuilder, instance: Instance) -> Finding:
    return builder.finding(instance, ((), ()), max(instance[1:3]), 99)


def test_equal_sets_of_events_are_told_once_also_after_a_restart() -> None:
    plan = load("chronicle c { event(a[], t1) event(a[], t2) t2 - t1 in [-5us, 5us] }").plans[0]
    first, second = (1, 1, Event("a", (), 1)), (3, 2, Event("a", (), 3))
    builder, restored = OccurrenceBuilder(plan, 0, PAST), OccurrenceBuilder(plan, 0, PAST)
    assert builder.is_new(finding(builder, [0, 1, 3, first, second]))
    restored.restore(builder.state())
    for one in (builder, restored):
        assert not one.is_new(finding(one, [0, 3, 1, second, first]))
        one.forget_before(3 + plan.tail_us + 1)
        assert one.is_new(finding(one, [0, 3, 1, second, first]))


def test_what_was_selected_is_known_after_a_restart() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [0us, 5us] select SELECT }"
    first, second, third = (1, 1, Event("a", (), 1)), (3, 2, Event("b", (), 3)), (4, 3, Event("b", (), 4))
    for select in ("first(t1)", "non_overlapping"):
        plan = load(text.replace("SELECT", select)).plans[0]
        builder, restored = OccurrenceBuilder(plan, 0, PAST), OccurrenceBuilder(plan, 0, PAST)
        assert builder.is_new(finding(builder, [0, 1, 3, first, second]))
        restored.restore(builder.state())
        for one in (builder, restored):
            assert not one.is_new(finding(one, [0, 1, 4, first, third]))


def test_counted_events_are_known_after_a_restart() -> None:
    plan = load("chronicle c[?x] { event(a[?x], t1) noevent(b[?x, ?y], (t1, t1 + 5us)) }").plans[0]
    instance = [0, 1, "u", (1, 1, Event("a", ("u",), 1))]
    conclusions, restored = Conclusions(plan, PAST), Conclusions(plan, PAST)
    conclusions.append(Event("b", ("v", "w"), 2))
    assert conclusions.solutions(instance) == [(("u",), ())]
    conclusions.append(Event("b", ("u", "w"), 3))
    restored.restore(conclusions.state())
    assert conclusions.solutions(instance) == restored.solutions(instance) == []
