"""Mediation: streams that come and go become one."""

import pytest

from dyknow.errors import ProcessError
from dyknow.node import Node
from dyknow.policies.policy import Order, Policy
from dyknow.sample import Sample
from dyknow.streams.mediation import Collected
from dyknow.streams.stream import StreamGenerator
from tests.dyknow.units import Doubling, Pairing, Recorder

Scene = tuple[Node, StreamGenerator, Recorder, dict[str, StreamGenerator]]


def scene(kind: str, policy: Policy = Policy()) -> Scene:  # noqa: B008 - frozen value
    node, seen = Node(), Recorder()
    control = node.add_source("chosen")
    sources = {label: node.add_source(label) for label in ("pos[car1]", "pos[car2]")}
    node.add_mediation("cars", kind, control="chosen", policy=policy)
    node.subscribe("cars", seen)
    return node, control, seen, sources


def choose(control: StreamGenerator, *labels: str) -> None:
    control.publish(Sample(0, 0, set(labels)))


def publish(stream: StreamGenerator, t_us: int) -> None:
    stream.publish(Sample(t_us, t_us, t_us))


def test_nothing_is_passed_on_before_the_control_says_so() -> None:
    _, _, seen, sources = scene("selection")
    publish(sources["pos[car1]"], 1)
    assert seen.values == []


def test_selection_passes_the_chosen_stream_on_as_it_is_and_can_switch() -> None:
    _, control, seen, sources = scene("selection")
    for t_us, chosen in enumerate(("pos[car1]", "pos[car2]")):
        choose(control, chosen)
        for k, source in enumerate(sources.values()):
            publish(source, 10 * t_us + k)
    choose(control)
    publish(sources["pos[car1]"], 20)
    assert seen.values == [0, 11]


def test_collection_says_where_each_value_came_from() -> None:
    _, control, seen, sources = scene("collection")
    choose(control, "pos[car1]", "pos[car2]")
    for k, source in enumerate(sources.values()):
        publish(source, k)
    assert seen.values == [Collected("pos[car1]", 0), Collected("pos[car2]", 1)]


def test_stream_that_stays_chosen_is_not_read_anew() -> None:
    _, control, seen, sources = scene("selection", Policy(order=Order.STRICT))
    choose(control, "pos[car1]")
    publish(sources["pos[car1]"], 5)
    choose(control, "pos[car1]")
    publish(sources["pos[car1]"], 5)
    assert seen.values == [5]


def test_label_that_is_created_later_is_waited_for() -> None:
    node, control, seen, _ = scene("collection")
    choose(control, "pos[car3]")
    assert node.report()[-1].waiting_for == ("pos[car3]",)
    publish(node.add_source("pos[car3]"), 7)
    assert seen.values == [Collected("pos[car3]", 7)]
    assert node.report()[-2].waiting_for == ()


def test_collection_goes_on_when_a_stream_is_removed_and_comes_back() -> None:
    node, control, seen, sources = scene("collection")
    choose(control, *sources)
    node.remove("pos[car1]")
    publish(sources["pos[car2]"], 1)
    publish(node.add_source("pos[car1]"), 2)
    assert [one.value for one in seen.values] == [1, 2]


def test_finish_and_time_reach_a_stream_created_after_the_mediation_first() -> None:
    node, control, seen, _ = scene("collection")
    numbers, pairs = node.add_source("numbers"), Recorder()
    node.add_refinement("pairs", Pairing(), of="cars")
    node.subscribe("pairs", pairs)

    class Held(Doubling):
        def update(self, sample: Sample[int]) -> tuple[()]:
            return ()

        def finish(self) -> tuple[Sample[int], ...]:
            return (Sample(9, 9, 9),)

    node.add_refinement("late", Held(), of="numbers")
    node.advance(0)  # the order of processes is known, and changes by the choice
    choose(control, "late")
    publish(numbers, 1)
    node.finish()
    assert (seen.values, pairs.values) == ([Collected("late", 9)], [[Collected("late", 9)]])


def test_stream_that_depends_on_the_mediation_is_refused() -> None:
    node, control, _, _ = scene("selection")
    node.add_refinement("doubled", Doubling(), of="cars")
    with pytest.raises(
        ProcessError, match="mediation 'cars': expected streams that do not depend on it, got 'doubled'"
    ):
        choose(control, "doubled")


def test_process_that_would_close_a_cycle_is_not_created() -> None:
    node, control, _, _ = scene("selection")
    choose(control, "doubled")
    with pytest.raises(ProcessError, match="mediation 'cars': expected streams that do not depend on it"):
        node.add_refinement("doubled", Doubling(), of="cars")
    assert "doubled" not in node
    assert node.stream("cars").subscriptions[0].reader is None


def test_selection_takes_one_label_at_most() -> None:
    _, control, _, sources = scene("selection")
    with pytest.raises(ProcessError, match=r"selection 'cars': expected at most one label, got \['pos\[car1\]', 'pos"):
        choose(control, *sources)


@pytest.mark.parametrize("value", ["pos[car1]", None, {1, 2}])
def test_control_must_carry_sets_of_labels(value: object) -> None:
    _, control, _, _ = scene("selection")
    with pytest.raises(ProcessError, match="expected a set of labels on its control, got"):
        control.publish(Sample(0, 0, value))


def test_kind_must_be_one_of_two() -> None:
    with pytest.raises(ProcessError, match="mediation 'cars': expected one of selection, collection, got 'merge'"):
        scene("merge")


def test_control_cannot_be_removed_from_under_a_mediation() -> None:
    node, *_ = scene("selection")
    with pytest.raises(ProcessError, match=r"process 'chosen': expected no reader in the node, got \['cars'\]"):
        node.remove("chosen")


def test_control_is_no_stream_to_pass_on() -> None:
    _, control, _, _ = scene("collection")
    with pytest.raises(ProcessError, match="collection 'cars': expected other streams than its control, got 'chosen'"):
        choose(control, "chosen", "pos[car1]")


def test_refused_choice_changes_nothing() -> None:
    node, control, seen, sources = scene("collection")
    node.add_refinement("pairs", Pairing(), of="cars")
    choose(control, "pos[car1]")
    with pytest.raises(ProcessError, match="do not depend on it"):
        choose(control, "pos[car2]", "pairs")
    for k, source in enumerate(sources.values()):
        publish(source, k)
    assert seen.values == [Collected("pos[car1]", 0)]
    assert [one.waiting_for for one in node.report() if one.label == "cars"] == [()]


def test_stream_created_while_its_predecessor_is_removed_is_passed_on() -> None:
    node, control, seen, sources = scene("collection")
    node.add_refinement("pairs", Pairing(), of="pos[car1]")
    choose(control, "pairs")
    publish(sources["pos[car1]"], 1)
    node.subscribe("pairs", lambda _: node.add_source("pairs"))
    node.remove("pairs")
    publish(node.stream("pairs"), 5)
    assert [one.value for one in seen.values] == [[1], 5]


def test_stream_that_is_chosen_again_begins_with_its_oldest() -> None:
    node, control, seen, _ = scene("selection", Policy(oldest_us=10))
    choose(control, "pos[car3]")
    source = node.add_source("pos[car3]")
    publish(source, 1)
    choose(control)
    publish(source, 2)
    choose(control, "pos[car3]")
    assert seen.values == [1, 1, 2]
