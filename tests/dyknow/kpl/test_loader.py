"""A text begins to run in a node, or is refused and leaves the node as it was."""

from collections.abc import Iterable
from typing import Any

import pytest

from dyknow.errors import KplError
from dyknow.kpl.loader import load_kpl
from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Order, Policy
from dyknow.registry import Registry
from dyknow.sample import NO_VALUE, Sample

HOST = """sort Point = <float, float>;
source float gps;
compunit float step(float);
compunit float distance(float, float);
"""
CHAIN = HOST + "strmgen pos = gps; strmgen far = step(pos); stream seen = far;"


class Step:
    """Count its own samples, so that shared state would show."""

    def __init__(self, size: float = 1.0) -> None:
        self.size = size
        self.total = 0.0

    def update(self, sample: Sample[Any]) -> Iterable[Sample[Any]]:
        self.total += self.size
        return [Sample(sample.available_us, sample.valid_us, sample.value + self.total)]

    def finish(self) -> Iterable[Sample[Any]]:
        return []


class Distance:
    """Subtract the newest value of the second input from that of the first."""

    def __init__(self) -> None:
        self.values = [0.0, 0.0]

    def update(self, index: int, sample: Sample[Any], /) -> Iterable[Sample[Any]]:
        self.values[index] = sample.value
        return [Sample(sample.available_us, sample.valid_us, self.values[0] - self.values[1])]

    def finish(self) -> Iterable[Sample[Any]]:
        return []


def host() -> Registry:
    registry = Registry()
    registry.source("gps", output="float")
    registry.unit("step", inputs=("float",), output="float")(Step)
    registry.unit("distance", inputs=("float", "float"), output="float")(Distance)
    return registry


def values(samples: Iterable[Sample[Any]]) -> list[Any]:
    return [sample.value for sample in samples]


def codes(text: str, registry: Registry, node: Node) -> list[tuple[str, str, str]]:
    with pytest.raises(KplError) as caught:
        load_kpl(text, registry, node)
    return [(found.code, found.message, found.hint) for found in caught.value.diagnostics]


def test_statements_may_stand_in_any_order() -> None:
    deployment = load_kpl("stream seen = far; strmgen far = step(pos); strmgen pos = gps;" + HOST, host(), Node())
    stream = deployment.streams["seen"].open()
    deployment.sources["pos"].publish(Sample(0, 0, 10.0))
    assert dict(deployment.made_of) == {"pos": "gps", "far": "step"}
    assert deployment.labels == ("pos", "far")
    assert values(stream.take()) == [11.0]


def test_processes_are_created_in_the_same_order_every_time() -> None:
    text = HOST + "".join(
        f"strmgen s{i} = distance(a{i}, b{i}); strmgen b{i} = gps; strmgen a{i} = gps;" for i in range(3)
    )
    labels = load_kpl(text, host(), Node()).labels
    assert labels == ("a0", "b0", "a1", "b1", "a2", "b2", "s0", "s1", "s2")


def test_inputs_keep_their_places_and_their_own_policies() -> None:
    text = (
        HOST
        + "strmgen a = gps; strmgen b = gps; strmgen d = distance(b with any change, strict order, a); stream e = d;"
    )
    deployment = load_kpl(text, host(), Node())
    stream = deployment.streams["e"].open()
    for t_us, (label, value) in enumerate([("a", 1.0), ("b", 5.0), ("b", 5.0), ("a", 1.0)]):
        deployment.sources[label].publish(Sample(t_us, t_us, value))
    assert values(stream.take()) == [-1.0, 4.0, 4.0]
    [report] = [one for one in deployment.node.report() if one.label == "d"]
    assert report.inputs == ("b", "a")
    assert report.policies == (str(Policy(AnyChange(), order=Order.STRICT)), str(Policy()))


def test_each_process_has_a_unit_of_its_own() -> None:
    text = HOST + "strmgen pos = gps; strmgen one = step(pos); strmgen two = step(one); stream seen = two;"
    deployment = load_kpl(text, host(), Node())
    stream = deployment.streams["seen"].open()
    for t_us in (0, 1):
        deployment.sources["pos"].publish(Sample(t_us, t_us, 0.0))
    assert values(stream.take()) == [2.0, 4.0]


def test_settings_of_a_unit_are_in_its_factory() -> None:
    registry = Registry()
    registry.source("gps", output="float")
    registry.unit("step", inputs=("float",), output="float")(lambda: Step(size=100.0))
    deployment = load_kpl(CHAIN.replace("compunit float distance(float, float);", ""), registry, Node())
    stream = deployment.streams["seen"].open()
    deployment.sources["pos"].publish(Sample(0, 0, 1.0))
    assert values(stream.take()) == [101.0]


def test_one_source_may_have_several_labels() -> None:
    text = "sort Car; object Car car1, car2; feature float pos(Car); source float gps;"
    text += "strmgen pos[car1] = gps; strmgen pos[car2] = gps; stream seen = pos[car2];"
    deployment = load_kpl(text, host(), Node())
    stream = deployment.streams["seen"].open()
    for t_us, label in enumerate(["pos[car1]", "pos[car2]"]):
        deployment.sources[label].publish(Sample(t_us, t_us, label))
    assert values(stream.take()) == ["pos[car2]"]
    assert [one.label for one in deployment.publishers("gps")] == ["pos[car1]", "pos[car2]"]
    assert deployment.publishers("radar") == ()


def test_stream_is_sampled_as_its_policy_says() -> None:
    text = HOST + "strmgen pos = gps; stream seen = pos with sample every 10us, linear interpolation, strict order;"
    deployment = load_kpl(text, host(), Node())
    stream = deployment.streams["seen"].open()
    for t_us, value in [(0, 0.0), (15, 15.0), (25, 25.0)]:
        deployment.sources["pos"].publish(Sample(t_us, t_us, value))
    assert [(sample.valid_us, sample.value) for sample in stream.take()] == [(0, 0.0), (10, 10.0), (20, 20.0)]


def test_changing_a_sample_period_changes_what_comes() -> None:
    def count(period: str) -> int:
        policy = f"sample every {period}, use most recent, strict order"
        text = HOST + f"strmgen pos = gps; strmgen far = step(pos with {policy}); stream seen = far;"
        deployment = load_kpl(text, host(), Node())
        stream = deployment.streams["seen"].open()
        for t_us in range(0, 1_000_001, 40_000):
            deployment.sources["pos"].publish(Sample(t_us, t_us, 0.0))
        return len(stream.take())

    assert [count("40ms"), count("80ms"), count("200ms")] == [26, 13, 6]


def test_samples_are_stored_for_a_stream_that_wants_the_oldest() -> None:
    text = HOST + "strmgen pos = gps; stream late = pos with oldest 20us; stream other = pos with oldest 5us;"
    deployment = load_kpl(text, host(), Node())
    for t_us in (0, 10, 20, 30):
        deployment.sources["pos"].publish(Sample(t_us, t_us, float(t_us)))
    assert values(deployment.streams["late"].open().take()) == [10.0, 20.0, 30.0]
    assert values(deployment.streams["other"].open().take()) == [30.0]


def test_time_without_exact_sample_has_no_value_unless_it_is_approximated() -> None:
    text = HOST + "strmgen pos = gps; stream seen = pos with sample every 10us, strict order;"
    deployment = load_kpl(text, host(), Node())
    stream = deployment.streams["seen"].open()
    for t_us in (0, 15, 25):
        deployment.sources["pos"].publish(Sample(t_us, t_us, 1.0))
    assert values(stream.take()) == [1.0, NO_VALUE, NO_VALUE]


def test_what_the_host_lacks_is_refused() -> None:
    registry = Registry()
    registry.source("gsp", output="float")
    registry.unit("distance", inputs=("float", "float"), output="float")(Distance)
    assert codes(CHAIN, registry, Node()) == [
        ("K0701", "expected a source that the host offers, got 'gps'", "did you mean 'gsp'?"),
        ("K0701", "expected a unit that the host offers, got 'step'", "known: 'distance'"),
    ]


def test_what_the_host_has_with_other_types_is_refused() -> None:
    registry = Registry()
    registry.source("gps", output="<float, float>")
    registry.unit("step", inputs=("Point",), output="float")(Step)
    registry.unit("distance", inputs=("float",), output="float")(Distance)
    assert [message for code, message, _ in codes(CHAIN, registry, Node()) if code == "K0702"] == [
        "expected 'source <float, float> gps' as the host has it, got 'source float gps'",
        "expected 'compunit float step(Point)' as the host has it, got 'compunit float step(float)'",
        "expected 'compunit float distance(float)' as the host has it, got 'compunit float distance(float, float)'",
    ]


def test_type_that_the_host_misspelled_is_named() -> None:
    registry = Registry()
    registry.source("gps", output="<float")
    with pytest.raises(KplError, match="type of gps in the registry:1:2"):
        load_kpl("source float gps;", registry, Node())


def test_types_are_compared_by_what_the_sorts_stand_for() -> None:
    registry = Registry()
    registry.source("gps", output="<float,float>")
    deployment = load_kpl("sort Point = <float, float>; source Point gps; strmgen pos = gps;", registry, Node())
    assert deployment.labels == ("pos",)


def test_label_in_use_is_refused_and_the_node_is_left_alone() -> None:
    node = Node()
    node.add_source("far")
    assert codes(CHAIN, host(), node) == [("K0703", "expected a label that is new in the node, got 'far'", "")]
    assert node.labels == ("far",)


def test_failing_factory_leaves_nothing_behind() -> None:
    def fail() -> Step:
        raise ValueError("no model file")

    registry = Registry()
    registry.source("gps", output="float")
    registry.unit("step", inputs=("float",), output="float")(fail)
    registry.unit("distance", inputs=("float", "float"), output="float")(Distance)
    node = Node()
    with pytest.raises(ValueError, match="no model file"):
        load_kpl(CHAIN, registry, node)
    assert node.labels == ()


def test_deployment_can_be_removed_and_loaded_again() -> None:
    node = Node()
    for _ in range(3):
        load_kpl(CHAIN, host(), node).remove()
    assert node.labels == ()
    assert load_kpl(CHAIN, host(), node).labels == node.labels == ("pos", "far")


def test_two_texts_run_side_by_side() -> None:
    node = Node()
    load_kpl(CHAIN, host(), node)
    load_kpl(CHAIN.replace("pos", "pos2").replace("far", "far2"), host(), node).remove()
    assert node.labels == ("pos", "far")


def test_warnings_come_with_the_deployment() -> None:
    text = "source float gps; strmgen pos = gps;"
    [found] = load_kpl(text, host(), Node()).warnings
    assert found.code == "K0601"
