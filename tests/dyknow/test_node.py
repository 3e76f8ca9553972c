"""Nodes: labelled streams and processes."""

from collections.abc import Iterable

import pytest

from dyknow.errors import StreamError
from dyknow.node import Node
from dyknow.policy import Order, Policy
from dyknow.sample import Sample
from dyknow.stream import StreamGenerator


class Pairing:
    """Answer every second sample with the last two values; hold an odd one until the end."""

    def __init__(self) -> None:
        self.held: list[Sample[int]] = []

    def update(self, sample: Sample[int]) -> Iterable[Sample[list[int]]]:
        self.held.append(sample)
        return self.finish() if len(self.held) == 2 else ()

    def finish(self) -> Iterable[Sample[list[int]]]:
        if not self.held:
            return ()
        last = self.held[-1]
        values = [sample.value for sample in self.held]
        self.held = []
        return (Sample(last.available_us, last.valid_us, values),)


def numbers(node: Node, count: int) -> None:
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    for t in range(count):
        source.publish(Sample(t, t, t))


def test_refinement_publishes_what_its_unit_returns() -> None:
    node, seen = Node(), []
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.subscribe("pairs", lambda sample: seen.append(sample.value))
    for t in range(5):
        source.publish(Sample(t, t, t))
    assert seen == [[0, 1], [2, 3]]
    node.finish()
    assert seen == [[0, 1], [2, 3], [4]]


def test_finish_flushes_inputs_before_what_refines_them() -> None:
    node, seen = Node(), []
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.add_refinement("pairs of pairs", Pairing(), of="pairs")
    node.subscribe("pairs of pairs", lambda sample: seen.append(sample.value))
    for t in range(3):
        source.publish(Sample(t, t, t))
    node.finish()
    assert seen == [[[0, 1], [2]]]


def test_two_subscribers_of_one_stream_have_their_own_policies() -> None:
    stream = StreamGenerator("s")
    everything: list[int] = []
    ordered: list[int] = []
    stream.subscribe(lambda sample: everything.append(sample.value))
    stream.subscribe(lambda sample: ordered.append(sample.value), Policy(order=Order.STRICT))
    for t in (1, 3, 2):
        stream.publish(Sample(5, t, t))
    assert everything == [1, 3, 2]
    assert ordered == [1, 3]


def test_consumer_may_leave_while_it_is_served() -> None:
    stream = StreamGenerator("s")
    seen: list[int] = []
    subscription = stream.subscribe(lambda sample: (seen.append(sample.value), stream.unsubscribe(subscription)))
    stream.subscribe(lambda sample: seen.append(-sample.value))
    stream.publish(Sample(1, 1, 1))
    stream.publish(Sample(2, 2, 2))
    assert seen == [1, -1, -2]


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


def test_leaving_a_foreign_stream_is_refused() -> None:
    subscription = StreamGenerator("a").subscribe(print)
    with pytest.raises(StreamError, match="stream 'b'"):
        StreamGenerator("b").unsubscribe(subscription)


def test_report_counts_samples_updates_and_time() -> None:
    ticks = iter(range(0, 1_000, 10))
    node = Node(clock=lambda: next(ticks))
    numbers(node, 3)
    node.finish()
    source, pairs = node.report()
    assert (source.label, source.published, source.updates) == ("numbers", 3, 0)
    assert (pairs.label, pairs.inputs, pairs.published, pairs.updates) == ("pairs", ("numbers",), 2, 3)
    assert pairs.busy_ns == 4 * 10
