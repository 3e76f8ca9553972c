"""Nodes: labelled streams and processes that come and go."""

import gc
import weakref

import pytest

from dyknow.errors import ProcessError, StreamError
from dyknow.node import Node
from dyknow.policies.policy import Approximation, Order, Policy, SampleEvery
from dyknow.policies.synchroniser import Synchroniser
from dyknow.sample import Sample
from tests.dyknow.units import Doubling, Pairing, Recorder, Silence


def test_finish_flushes_inputs_before_what_refines_them() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.add_refinement("pairs of pairs", Pairing(), of="pairs")
    node.subscribe("pairs of pairs", seen)
    for t in range(3):
        source.publish(Sample(t, t, t))
    node.finish()
    assert seen.values == [[[0, 1], [2]]]


def test_finish_flushes_what_policies_hold_back() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    policy = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=50)
    node.add_refinement("doubled", Doubling(), of="numbers", policy=policy)
    node.subscribe("doubled", seen, policy)
    for t_us, value in ((8, 1), (21, 2)):
        source.publish(Sample(t_us, t_us, value))
    node.finish()
    assert seen.values == [2, 2]


def test_end_is_told_once_and_nothing_comes_after_it() -> None:
    class Ending(Doubling):
        ends = 0

        def finish(self) -> tuple[Sample[int], ...]:
            self.ends += 1
            return (Sample(9, 9, self.ends),)

    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("ending", Ending(), of="numbers")
    node.subscribe("ending", seen)
    node.finish()
    node.finish()
    node.advance(20)
    with pytest.raises(
        StreamError, match="stream 'numbers': expected an open stream to publish to, got one that was fin"
    ):
        source.publish(Sample(10, 10, 10))
    node.remove("ending")
    assert seen.values == [1]


def test_end_reaches_what_is_created_by_it() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    source.remember(100)

    def build(node: Node, _: int) -> None:
        node.add_refinement("pairs", Pairing(), of="numbers", policy=Policy(oldest_us=100))
        node.subscribe("pairs", seen)

    held_back = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=500)
    node.add_configuration("c", of="numbers", wanted=lambda value: [value], build=build, policy=held_back)
    for t_us in (8, 12, 14):
        source.publish(Sample(t_us, t_us, t_us))
    node.finish()
    assert seen.values == [[14]]


def test_states_of_several_streams_are_a_stream_of_the_node() -> None:
    node, seen = Node(), Recorder()
    held = Policy(approximation=Approximation.MOST_RECENT, order=Order.STRICT)
    speed, road = node.add_source("speed"), node.add_source("road")
    states = Synchroniser({"speed": held, "road": held}, period_us=100, max_delay_us=50)
    node.add_refinement("states", states, of=("speed", "road"), policy=held)
    node.subscribe("states", seen)
    speed.publish(Sample(0, 0, 12.5))
    road.publish(Sample(5, 0, "E6"))
    node.advance(200)
    assert [(one.available_us, one.valid_us, dict(one.value)) for one in seen.samples] == [
        (5, 0, {"speed": 12.5, "road": "E6"}),
        (150, 100, {"speed": 12.5, "road": "E6"}),
    ]


def test_removed_process_publishes_what_it_holds_and_lets_its_subscribers_go() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    subscription = node.subscribe("pairs", seen)
    source.publish(Sample(0, 0, 0))
    node.remove("pairs")
    assert seen.values == [[0]]
    assert not subscription.is_open
    assert (source.subscriptions, node.labels) == ((), ("numbers",))


def test_removed_process_takes_in_what_the_policy_of_its_input_holds() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    policy = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=50)
    node.add_refinement("doubled", Doubling(), of="numbers", policy=policy)
    node.subscribe("doubled", seen)
    for t_us in (8, 21):
        source.publish(Sample(t_us, t_us, t_us))
    node.remove("doubled")
    assert seen.values == [16, 16]


def test_process_may_be_removed_while_its_input_is_delivered() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.subscribe("numbers", lambda sample: node.remove("doubled") if sample.value == 2 else None)
    node.add_refinement("doubled", Doubling(), of="numbers")
    node.subscribe("doubled", seen)
    for t in range(4):
        source.publish(Sample(t, t, t))
    assert seen.values == [0, 2]


def test_process_that_is_removed_by_a_reader_says_nothing_more() -> None:
    class Twice(Doubling):
        def update(self, sample: Sample[int]) -> list[Sample[int]]:
            return [sample, sample]

    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("twice", Twice(), of="numbers")
    node.subscribe("twice", seen)
    node.subscribe("twice", lambda _: node.remove("twice"))
    source.publish(Sample(0, 0, 7))
    assert (seen.values, node.labels) == ([7], ("numbers",))


def test_process_may_be_removed_while_time_is_told() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    policy = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=0)
    node.subscribe("numbers", lambda _: node.remove("silence"), policy)
    node.add_refinement("silence", Silence(), of="numbers")
    node.subscribe("silence", seen)
    source.publish(Sample(5, 5, 5))
    node.advance(11)
    assert (node.labels, seen.values) == (("numbers",), [])


def test_source_that_was_removed_takes_no_samples() -> None:
    node = Node()
    source = node.add_source("numbers")
    node.remove("numbers")
    with pytest.raises(StreamError, match="stream 'numbers': expected an open stream"):
        source.publish(Sample(0, 0, 0))


def test_stream_that_is_read_cannot_be_removed() -> None:
    node = Node()
    node.add_source("numbers")
    node.add_refinement("doubled", Doubling(), of="numbers")
    with pytest.raises(ProcessError, match=r"process 'numbers': expected no reader in the node, got \['doubled'\]"):
        node.remove("numbers")


def test_label_is_free_when_the_last_words_are_heard() -> None:
    node = Node()
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.subscribe("pairs", lambda _: node.add_refinement("pairs", Doubling(), of="numbers"))
    source.publish(Sample(0, 0, 0))
    node.remove("pairs")
    assert node.labels == ("numbers", "pairs")
    assert [one.reader for one in source.subscriptions] == ["pairs"]


def test_process_whose_last_words_fail_is_removed_all_the_same() -> None:
    class Failing(Doubling):
        def finish(self) -> tuple[Sample[int], ...]:
            raise OSError("disk full")

    node = Node()
    source = node.add_source("numbers")
    node.add_refinement("failing", Failing(), of="numbers")
    with pytest.raises(OSError, match="disk full"):
        node.remove("failing")
    assert (node.labels, source.subscriptions) == (("numbers",), ())


def test_removed_process_reads_nothing_more_even_if_an_input_fails_to_flush() -> None:
    class Failing(Pairing):
        def update(self, index: int, sample: Sample[int]) -> tuple[()]:  # type: ignore[override]  # of two inputs
            raise OSError("disk full")

    node, policy = Node(), Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=50)
    sources = [node.add_source(label) for label in "ab"]
    node.add_refinement("failing", Failing(), of=("a", "b"), policy=policy)
    for source in sources:
        for t_us in (5, 11):
            source.publish(Sample(t_us, t_us, t_us))
    with pytest.raises(OSError, match="disk full"):
        node.remove("failing")
    assert [source.subscriptions for source in sources] == [(), ()]


def test_thousand_processes_may_come_and_go_within_one_delivery() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")

    def churn(_: Sample[int]) -> None:
        for k in range(1_000):
            node.add_refinement(f"pairs{k}", Pairing(), of="numbers")
        for k in range(1_000):
            node.remove(f"pairs{k}")

    node.subscribe("numbers", churn)
    node.subscribe("numbers", seen)
    source.publish(Sample(0, 0, 7))
    assert (node.labels, seen.values, len(source.subscriptions)) == (("numbers",), [7], 2)


@pytest.mark.long
def test_thousand_cycles_of_creation_and_removal_leak_nothing() -> None:
    node, alive = Node(), weakref.WeakSet[object]()
    source, control = node.add_source("numbers"), node.add_source("chosen")
    node.add_mediation("collected", "collection", control="chosen")

    def cycle(k: int) -> None:
        unit = Pairing()
        created = [
            node.add_refinement(f"pairs{k}", unit, of="numbers", policy=Policy(SampleEvery(10), order=Order.STRICT)),
            node.add_mediation(f"selected{k}", "selection", control="chosen"),
            node.add_configuration(
                f"configuration{k}",
                of="numbers",
                wanted=lambda value: [value],
                build=lambda node, key: node.add_refinement(f"{key} in {k}", Doubling(), of="numbers"),
            ),
        ]
        alive.update((unit, *created, *(one.output for one in created)))
        control.publish(Sample(k, k, {f"pairs{k}"}))
        source.publish(Sample(k, k, k))
        for process in reversed(created):
            node.remove(process.label)

    cycle(0)
    gc.collect()
    objects_before = len(gc.get_objects())
    for k in range(1, 1_001):
        cycle(k)
    control.publish(Sample(1_001, 1_001, set()))
    gc.collect()
    assert node.labels == ("numbers", "chosen", "collected")
    assert (len(source.subscriptions), len(control.subscriptions)) == (0, 1)
    assert len(alive) == 0
    assert len(gc.get_objects()) - objects_before < 100


def test_unknown_label_names_the_known_ones() -> None:
    node = Node()
    node.add_source("frames")
    with pytest.raises(StreamError, match=r"stream 'frame': expected one of the declared streams \(frames\)"):
        node.subscribe("frame", print)


def test_label_in_use_is_refused() -> None:
    node = Node()
    node.add_source("frames")
    with pytest.raises(StreamError, match="expected a new label"):
        node.add_source("frames")


def test_node_knows_its_labels() -> None:
    node = Node()
    node.add_source("frames")
    assert ("frames" in node, "objects" in node) == (True, False)
