"""Delivery: a loop, in the order in which nested calls deliver, through chains of any length, in steps if wanted."""

import random
from collections.abc import Iterable, Iterator
from itertools import count
from typing import Any

import pytest

from dyknow.errors import StreamError
from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery
from dyknow.sample import Sample
from dyknow.streams.stream import StreamGenerator
from tests.dyknow.units import Doubling, Recorder

POLICIES = (
    Policy(),
    Policy(AnyChange()),
    Policy(order=Order.STRICT),
    Policy(SampleEvery(2), Approximation.MOST_RECENT, order=Order.MONOTONE),
)


class PassOn:
    """Answer with the same."""

    def update(self, sample: Sample[int]) -> list[Sample[int]]:
        return [sample]

    def finish(self) -> tuple[()]:
        return ()


class Several:
    """Answer a sample with none, one or two, of several inputs or one."""

    def update(self, *arguments: int | Sample[int]) -> Iterator[Sample[int]]:
        sample = arguments[-1]
        assert isinstance(sample, Sample)
        for k in range((sample.value + len(arguments)) % 3):
            yield Sample(sample.available_us, sample.valid_us, sample.value + k)

    def finish(self) -> tuple[()]:
        return ()


def chain(hops: int) -> tuple[Node, StreamGenerator]:
    node = Node()
    source = node.add_source("hop0")
    for hop in range(hops):
        node.add_refinement(f"hop{hop + 1}", PassOn(), of=f"hop{hop}")
    return node, source


@pytest.mark.long
def test_chain_of_five_thousand_processes_delivers_tells_the_time_ends_and_goes() -> None:
    node, source = chain(5_000)
    seen = Recorder()
    node.subscribe("hop5000", seen)
    for value in (1, 2):
        source.publish(Sample(value, value, value))
    node.advance(10)
    assert seen.values == [1, 2]
    node.finish()
    node.finish()
    for hop in range(5_000, 0, -1):
        node.remove(f"hop{hop}")
    assert node.labels == ("hop0",)


def test_chain_of_hundred_and_fifty_mediations_delivers() -> None:
    node, seen = Node(), Recorder()
    source, control = node.add_source("hop0"), [node.add_source(f"control{k}") for k in range(150)]
    for k, one in enumerate(control):
        node.add_mediation(f"hop{k + 1}", "selection", control=f"control{k}")
        one.publish(Sample(0, 0, {f"hop{k}"}))
    node.subscribe("hop150", seen)
    source.publish(Sample(1, 1, 7))
    assert seen.values == [7]


def random_node(seed: int, seen: list[tuple[str, int, object]]) -> tuple[Node, StreamGenerator]:
    """Build a graph whose processes have several readers under several policies, some of which change the graph."""
    rng, node, labels, new = random.Random(seed), Node(), ["s"], count()
    source = node.add_source("s")
    control = node.add_source("control")
    for k in range(12):
        of = tuple(rng.sample(labels, rng.randint(1, min(3, len(labels)))))
        node.add_refinement(f"p{k}", Several(), of=of, policy=tuple(rng.choice(POLICIES) for _ in of))
        labels.append(f"p{k}")
        node.subscribe(f"p{k}", lambda sample, k=k: seen.append((f"p{k}", sample.valid_us, sample.value)))
    node.add_mediation("m", "collection", control="control")
    node.subscribe("m", lambda sample: seen.append(("m", sample.valid_us, sample.value)))
    control.publish(Sample(0, 0, set(rng.sample(labels, 3))))

    def meddle(sample: Sample[int]) -> None:
        label = f"new{next(new)}"
        if sample.valid_us % 5 == 1 and len(labels) < 40:
            node.add_refinement(label, Several(), of="p0")
            node.subscribe(label, lambda sample: seen.append((label, sample.valid_us, sample.value)))
            labels.append(label)
        elif sample.valid_us % 5 == 3 and labels[-1].startswith("new"):
            node.remove(labels.pop())

    node.subscribe(rng.choice(labels), meddle)
    return node, source


def nested_calls(stream: StreamGenerator, samples: Iterable[Sample[Any]]) -> Iterator[None]:
    """Deliver in the obvious way: every process calls its subscribers, which call theirs."""
    for sample in samples:
        if not stream.is_closed:
            for subscription in stream.take_in(sample):
                subscription.deliver(subscription.passed(sample))
    return iter(())


def run_randomly(seed: int) -> tuple[list[tuple[str, int, object]], list[tuple[str, int, int, dict[str, int]]]]:
    """Give what was seen, in order, and what each process counted."""
    seen: list[tuple[str, int, object]] = []
    node, source = random_node(seed, seen)
    for t_us in range(60):
        source.publish(Sample(t_us, t_us - t_us % 4, t_us % 7))
    node.advance(1_000)
    node.finish()
    return seen, [(one.label, one.published, one.delivered, one.dropped) for one in node.report()]


def test_order_is_that_of_nested_calls() -> None:
    for seed in range(1, 21):
        by_loop = run_randomly(seed)
        with pytest.MonkeyPatch.context() as patch:
            for module in ("stream", "process"):
                patch.setattr(f"dyknow.streams.{module}.deliver", nested_calls)
            nested = run_randomly(seed)
        assert len(by_loop[0]) > 100, seed
        assert by_loop == nested, seed


def test_publication_by_a_consumer_at_the_end_of_a_long_chain_is_over_when_it_returns() -> None:
    node, source = chain(200)
    other, seen = node.add_source("other"), Recorder()
    for hop in range(100):
        node.add_refinement(f"other{hop}", Doubling(), of=f"other{hop - 1}" if hop else "other")
    node.subscribe("other99", seen)
    lengths = []

    def pass_over(sample: Sample[int]) -> None:
        other.publish(sample)
        lengths.append(len(seen.samples))

    node.subscribe("hop200", pass_over)
    for t_us in range(3):
        source.publish(Sample(t_us, t_us, 1))
    assert lengths == [1, 2, 3]


def test_what_a_consumer_raises_at_the_end_of_a_long_chain_comes_out_at_its_beginning() -> None:
    node, source = chain(300)

    def refuse(_: Sample[int]) -> None:
        raise OSError("disk full")

    node.subscribe("hop300", refuse)
    with pytest.raises(OSError, match="disk full"):
        source.publish(Sample(0, 0, 0))


def test_process_far_from_its_source_may_be_removed_by_its_reader() -> None:
    class Twice(Doubling):
        def update(self, sample: Sample[int]) -> list[Sample[int]]:
            return [sample, sample]

    node, source = chain(100)
    seen = Recorder()
    node.add_refinement("twice", Twice(), of="hop100")
    node.subscribe("twice", seen)
    node.subscribe("twice", lambda _: node.remove("twice"))
    source.publish(Sample(0, 0, 7))
    source.publish(Sample(1, 1, 8))
    assert (seen.values, "twice" in node) == ([7], False)


def test_nothing_is_delivered_into_a_stream_that_has_ended() -> None:
    node, source = chain(100)
    node.stream("hop80").finish()
    with pytest.raises(
        StreamError, match="stream 'hop80': expected an open stream to publish to, got one that was fin"
    ):
        source.publish(Sample(0, 0, 0))
