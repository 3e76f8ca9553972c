"""Processes: one input or several, each under its own policy, with state of their own."""

from collections.abc import Iterable, Iterator

import pytest

from dyknow.errors import ProcessError, RegistryError, StreamError
from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery
from dyknow.registry import Registry
from dyknow.sample import NOT_YET, Sample
from dyknow.streams.stream import StreamGenerator
from dyknow.streams.testing import samples_of
from tests.dyknow.units import Doubling, Latest, Pairing, Recorder, Silence


def test_refinement_publishes_what_its_unit_returns() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.subscribe("pairs", seen)
    for t in range(5):
        source.publish(Sample(t, t, t))
    assert seen.values == [[0, 1], [2, 3]]
    node.finish()
    assert seen.values == [[0, 1], [2, 3], [4]]


def test_unit_with_several_inputs_learns_which_one_a_sample_came_from() -> None:
    node, seen = Node(), Recorder()
    left, right = node.add_source("left"), node.add_source("right")
    node.add_refinement("both", Latest(), of=("left", "right"))
    node.subscribe("both", seen)
    left.publish(Sample(0, 0, 1))
    right.publish(Sample(1, 1, 2))
    assert seen.values == [{0: 1}, {0: 1, 1: 2}]


def test_each_input_is_read_under_its_own_policy() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement(
        "both", Latest(), of=("numbers", "numbers"), policy=(Policy(AnyChange()), Policy(order=Order.STRICT))
    )
    node.subscribe("both", seen)
    for sample in samples_of((0, 0, 7), (1, 1, 7), (2, 1, 8)):
        source.publish(sample)
    assert seen.values == [{0: 7}, {0: 7, 1: 7}, {0: 7, 1: 7}, {0: 8, 1: 7}]


def test_units_with_the_same_code_do_not_share_their_state() -> None:
    registry, seen = Registry(), Recorder()
    registry.unit("pairs", inputs=("Number",), output="Numbers")(Pairing)
    node = Node(registry=registry)
    left, right = node.add_source("left"), node.add_source("right")
    for label in ("left", "right"):
        node.add_refinement(f"pairs of {label}", "pairs", of=label)
        node.subscribe(f"pairs of {label}", seen)
    for t, source in enumerate((left, right, left)):
        source.publish(Sample(t, t, t))
    assert seen.values == [[0, 2]]


def test_unit_with_a_sense_of_time_is_told_it() -> None:
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("silence", Silence(), of="numbers")
    node.subscribe("silence", seen)
    source.publish(Sample(10, 10, 0))
    node.advance(35)
    assert seen.samples == samples_of((35, 35, 25))


def test_time_is_told_to_inputs_before_what_reads_them() -> None:
    """The sampled value that the told time releases reaches the unit before the time does."""
    node, seen = Node(), Recorder()
    source = node.add_source("numbers")
    policy = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=2)
    node.add_refinement("doubled", Doubling(), of="numbers", policy=policy)
    node.add_refinement("silence", Silence(), of="doubled")
    node.subscribe("silence", seen)
    source.publish(Sample(9, 9, 0))
    node.advance(20)
    assert seen.values == [20 - 12]


def test_cost_is_measured_without_that_of_the_subscribers() -> None:
    now_ns = 0

    class Slow(Doubling):
        def update(self, sample: Sample[int]) -> list[Sample[int]]:
            nonlocal now_ns
            now_ns += 7
            return [sample]

    class SlowWhileTaken(Doubling):
        def update(self, sample: Sample[int]) -> Iterator[Sample[int]]:
            nonlocal now_ns
            for _ in range(2):
                now_ns += 5
                yield sample

    def reader(_: Sample[int]) -> None:
        nonlocal now_ns
        now_ns += 1_000

    node = Node(clock=lambda: now_ns)
    source = node.add_source("numbers")
    slow = node.add_refinement("slow", Slow(), of="numbers")
    node.subscribe("slow", reader)
    while_taken = node.add_refinement("slow while taken", SlowWhileTaken(), of="numbers")
    node.subscribe("slow while taken", reader)
    for t in range(3):
        source.publish(Sample(t, t, t))
    assert (slow.updates, slow.busy_ns) == (3, 21)
    assert (while_taken.updates, while_taken.busy_ns) == (3, 30)


@pytest.mark.parametrize(
    ("of", "policy"), [((), Policy()), (("numbers", "numbers"), (Policy(),)), ("numbers", (Policy(), Policy()))]
)
def test_inputs_and_policies_must_agree(of: tuple[str, ...] | str, policy: Policy | tuple[Policy, ...]) -> None:
    node = Node()
    node.add_source("numbers")
    with pytest.raises(ProcessError, match="refinement 'r': expected one input or more with a policy each"):
        node.add_refinement("r", Latest(), of=of, policy=policy)


def test_registered_unit_is_given_as_many_inputs_as_it_takes() -> None:
    registry = Registry()
    registry.unit("latest", inputs=("Number", "Number"), output="Numbers")(Latest)
    node = Node(registry=registry)
    node.add_source("numbers")
    with pytest.raises(ProcessError, match="refinement 'r': unit 'latest' expected 2 inputs, got 1"):
        node.add_refinement("r", "latest", of="numbers")
    with pytest.raises(RegistryError, match="unit 'newest'"):
        node.add_refinement("r", "newest", of="numbers")


def test_process_that_cannot_begin_leaves_nothing_behind() -> None:
    node = Node()
    left, right = node.add_source("left"), node.add_source("right")
    right.publish(Sample(0, 0, 0))
    with pytest.raises(StreamError, match="expected to remember at least 5 us for 'oldest', got 0 us"):
        node.add_refinement("r", Latest(), of=("left", "right"), policy=Policy(oldest_us=5))
    assert node.labels == ("left", "right")
    assert (left.subscriptions, right.subscriptions) == ((), ())


class Holding:
    """Hold the first samples; answer them, one at a time, when there are enough of them or no more."""

    def __init__(self, enough: int) -> None:
        self.enough = enough
        self.held: list[Sample[int]] = []
        self.made: list[int] = []

    def update(self, sample: Sample[int]) -> Iterable[Sample[int]]:
        self.held.append(sample)
        if len(self.held) < self.enough:
            return NOT_YET
        self.enough = 1
        return self.finish()

    def finish(self) -> Iterable[Sample[int]]:
        now_us = self.held[-1].available_us if self.held else 0
        while self.held:
            sample = self.held.pop(0)
            self.made.append(sample.value)
            yield Sample(now_us, sample.valid_us, sample.value)


def holding_node(enough: int) -> tuple[Node, StreamGenerator, Holding, Recorder]:
    node, unit, seen = Node(), Holding(enough), Recorder()
    source = node.add_source("numbers")
    node.add_refinement("held", unit, of="numbers")
    node.add_refinement("doubled", Doubling(), of="held")
    node.subscribe("doubled", seen)
    return node, source, unit, seen


def test_control_comes_back_between_two_answers_each_delivered_before_the_next_but_one_is_made() -> None:
    node, source, unit, seen = holding_node(4)
    for t_us in (10, 20, 30):
        source.publish(Sample(t_us, t_us, t_us))
    told = [(len(unit.made), list(seen.values), node.owes_from_us)]
    for _ in source.publish_in_steps(Sample(40, 40, 40)):
        told.append((len(unit.made), list(seen.values), node.owes_from_us))
    assert told == [
        (0, [], 10),
        (2, [20], 20),
        (3, [20, 40], 30),
        (4, [20, 40, 60], None),
    ]
    assert (seen.values, node.owes_from_us) == ([20, 40, 60, 80], None)


def test_unit_that_owes_answers_is_asked_for_them_at_the_end_in_steps_too() -> None:
    node, source, _, seen = holding_node(9)
    for t_us in (10, 20, 30):
        source.publish(Sample(t_us, t_us, t_us))
    told = [(len(seen.values), node.owes_from_us) for _ in node.finish_in_steps()]
    assert told == [(1, 20), (2, 30)]
    assert (len(seen.values), node.owes_from_us) == (3, None)


def test_answer_of_nothing_pays_what_is_owed() -> None:
    class Forgetful(Doubling):
        def update(self, sample: Sample[int]) -> Iterable[Sample[int]]:
            return NOT_YET if sample.value < 2 else ()

    node = Node()
    source = node.add_source("numbers")
    node.add_refinement("forgotten", Forgetful(), of="numbers")
    for value, owed in enumerate((0, 0, None)):
        source.publish(Sample(value, value, value))
        assert node.owes_from_us == owed


def test_forgiven_unit_is_not_asked_at_the_end_and_the_others_are() -> None:
    node, source, unit, seen = holding_node(9)
    node.add_refinement("pairs", Pairing(), of="numbers")
    node.subscribe("pairs", seen)
    source.publish(Sample(10, 10, 10))
    node.forgive()
    node.finish()
    assert (unit.made, seen.values, node.owes_from_us) == ([], [[10]], 10)


def test_who_leaves_off_between_two_answers_drops_the_rest_and_can_end_the_node() -> None:
    node, source, unit, seen = holding_node(3)
    for t_us in (10, 20):
        source.publish(Sample(t_us, t_us, t_us))
    steps = source.publish_in_steps(Sample(30, 30, 30))
    next(steps)
    del steps
    node.forgive()
    node.finish()
    assert (unit.made, seen.values, node.owes_from_us) == ([10, 20], [20], 20)
