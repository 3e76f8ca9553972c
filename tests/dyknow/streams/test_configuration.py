"""Configuration: processes that exist as long as a stream says so."""

from collections.abc import Iterable

import pytest

from dyknow.errors import ProcessError
from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Approximation, Policy, SampleEvery
from dyknow.sample import Sample
from dyknow.streams.stream import StreamGenerator
from tests.dyknow.units import Doubling, Recorder

Pair = tuple[str, str]


class Gap:
    """Answer the positions of all cars with how far one is ahead of another."""

    def __init__(self, pair: Pair) -> None:
        self.pair = pair

    def update(self, sample: Sample[dict[str, int]]) -> Iterable[Sample[int]]:
        ahead, behind = self.pair
        return (Sample(sample.available_us, sample.valid_us, sample.value[ahead] - sample.value[behind]),)

    def finish(self) -> Iterable[Sample[int]]:
        return ()


def add_relation(node: Node, pair: Pair) -> None:
    label = f"gap[{pair[0]}, {pair[1]}]"
    node.add_refinement(label, Gap(pair), of="cars")
    node.add_refinement(f"twice {label}", Doubling(), of=label)


def pairs_node() -> tuple[Node, StreamGenerator, StreamGenerator]:
    node = Node()
    cars, pairs = node.add_source("cars"), node.add_source("near pairs")
    node.add_configuration("relations", of="near pairs", wanted=lambda value: value, build=add_relation)
    return node, cars, pairs


def say(stream: StreamGenerator, value: object, t_us: int = 0) -> None:
    stream.publish(Sample(t_us, t_us, value))


def test_processes_come_and_go_with_the_pairs() -> None:
    node, cars, pairs = pairs_node()
    say(pairs, [("a", "b")])
    seen = Recorder()
    node.subscribe("twice gap[a, b]", seen)
    say(cars, {"a": 9, "b": 4})
    say(pairs, [("a", "b"), ("b", "a")])
    say(cars, {"a": 10, "b": 4})
    assert node.labels[3:] == ("gap[a, b]", "twice gap[a, b]", "gap[b, a]", "twice gap[b, a]")
    say(pairs, [("b", "a")])
    say(cars, {"a": 11, "b": 4})
    assert node.labels[3:] == ("gap[b, a]", "twice gap[b, a]")
    assert seen.values == [10, 12]


def test_pair_that_stays_keeps_its_process() -> None:
    node, _, pairs = pairs_node()
    say(pairs, [("a", "b")])
    before = node.stream("gap[a, b]")
    say(pairs, [("c", "d"), ("a", "b")])
    assert node.stream("gap[a, b]") is before


def test_configuration_reads_under_its_policy() -> None:
    node, built = Node(), list[str]()
    source = node.add_source("s")
    node.add_configuration(
        "c", of="s", wanted=lambda value: [value], build=lambda _, key: built.append(key), policy=Policy(AnyChange())
    )
    for value in ("x", "x", "y"):
        say(source, value)
    assert (built, node.report()[-1].updates) == (["x", "y"], 2)


def test_removed_configuration_takes_along_what_it_created() -> None:
    node, _, pairs = pairs_node()
    say(pairs, [("a", "b"), ("b", "a")])
    node.remove("relations")
    assert node.labels == ("cars", "near pairs")


def test_configuration_may_change_the_stream_that_is_just_delivered() -> None:
    """The new process reads from the next sample on; the removed one does not see the sample that ends it."""
    node, seen = Node(), Recorder()
    cars = node.add_source("cars")

    def follow(node: Node, car: str) -> None:
        node.add_refinement(f"pos[{car}]", Gap((car, "origin")), of="cars")
        node.subscribe(f"pos[{car}]", seen)

    node.add_configuration("followed", of="cars", wanted=lambda cars: sorted(cars.keys() - {"origin"}), build=follow)
    say(cars, {"origin": 0, "a": 1})
    say(cars, {"origin": 0, "a": 2})
    say(cars, {"origin": 0})
    assert seen.values == [2]
    assert node.labels == ("cars", "followed")


def test_configurations_may_create_configurations() -> None:
    node = Node()
    roads, cars = node.add_source("roads"), node.add_source("cars")

    def watch(node: Node, road: str) -> None:
        node.add_configuration(
            f"cars on {road}",
            of="cars",
            wanted=lambda cars: [car for car, place in cars.items() if place == road],
            build=lambda node, car: node.add_source(f"{car} on {road}"),
        )

    node.add_configuration("watched", of="roads", wanted=lambda value: value, build=watch)
    say(roads, ["E6"])
    say(cars, {"a": "E6", "b": "E4"})
    assert node.labels[3:] == ("cars on E6", "a on E6")
    say(roads, [])
    assert node.labels == ("roads", "cars", "watched")


def test_failed_build_leaves_nothing_behind() -> None:
    node = Node()
    source = node.add_source("s")

    def build(node: Node, key: str) -> None:
        node.add_source(key)
        raise OSError("no such camera")

    node.add_configuration("c", of="s", wanted=lambda value: [value], build=build)
    with pytest.raises(OSError, match="no such camera"):
        say(source, "x")
    assert node.labels == ("s", "c")


def test_removed_configuration_leaves_nothing_that_a_held_back_sample_wants() -> None:
    node = Node()
    source = node.add_source("s")
    held_back = Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=50)
    node.add_configuration(
        "c", of="s", wanted=lambda value: value, build=lambda node, key: node.add_source(key), policy=held_back
    )
    for t_us, keys in ((5, ["x"]), (12, ["x", "y"])):
        say(source, keys, t_us)
    node.remove("c")
    assert node.labels == ("s",)


def test_what_could_not_be_removed_is_removed_when_it_can_be() -> None:
    node, _, pairs = pairs_node()
    say(pairs, [("a", "b")])
    node.add_refinement("own", Doubling(), of="gap[a, b]")
    with pytest.raises(ProcessError, match=r"process 'gap\[a, b\]': expected no reader in the node, got \['own'\]"):
        say(pairs, [])
    node.remove("own")
    say(pairs, [])
    assert node.labels == ("cars", "near pairs", "relations")


def test_configuration_that_is_removed_by_what_it_builds_leaves_nothing() -> None:
    node = Node()
    source = node.add_source("s")

    def build(node: Node, key: str) -> None:
        node.add_source(key)
        node.remove("c")

    node.add_configuration("c", of="s", wanted=lambda value: value, build=build)
    say(source, ["x", "y"])
    assert node.labels == ("s",)
