"""Mediations and configurations that a text declares follow streams while these run."""

from collections.abc import Iterable
from typing import Any

import pytest

from dyknow.errors import KplError, ProcessError, RegistryError
from dyknow.kpl.loader import load_kpl
from dyknow.node import Node
from dyknow.registry import Registry
from dyknow.sample import Sample
from dyknow.streams.mediation import Collected
from tests.dyknow.units import Doubling, Recorder

HOST = """sort Car;
object Car car1, car2;
feature int pos(Car);
source int gps;
source set(string) operator;
compunit int twice(int);
configuration follow(set(string));
strmgen pos[car1] = gps;
strmgen pos[car2] = gps;
strmgen chosen = operator;
"""


class Follow:
    """Keep a stream of doubled positions for each label that is named."""

    made = 0

    def __init__(self) -> None:
        type(self).made += 1

    def wanted(self, labels: frozenset[str]) -> Iterable[str]:
        return sorted(labels)

    def build(self, node: Node, label: str) -> None:
        node.add_refinement(f"twice {label}", "twice", of=label)


def registry() -> Registry:
    offered = Registry()
    offered.source("gps", output="int")
    offered.source("operator", output="set(string)")
    offered.unit("twice", inputs=("int",), output="int")(Doubling)
    offered.configuration("follow", input="set(string)")(Follow)
    return offered


def loaded(text: str) -> tuple[Node, Any, Any]:
    """Load a text behind the head; return the node and what publishes to a label at a time."""
    offered = registry()
    node = Node(registry=offered)
    deployment = load_kpl(HOST + text, offered, node)

    def say(label: str, value: object, t_us: int = 0) -> None:
        node.stream(label).publish(Sample(t_us, t_us, value))

    return node, deployment, say


def codes(text: str) -> list[str]:
    with pytest.raises(KplError) as caught:
        loaded(text)
    return [found.code for found in caught.value.diagnostics]


def test_selection_passes_on_the_stream_that_is_named_now() -> None:
    _, deployment, say = loaded("strmgen near = selection of int by chosen; stream seen = near;")
    seen = deployment.streams["seen"].open()
    for label, value in [
        ("pos[car1]", 1), ("chosen", {"pos[car1]"}), ("pos[car1]", 2), ("pos[car2]", 3), ("chosen", {"pos[car2]"}),
        ("pos[car1]", 4), ("pos[car2]", 5), ("chosen", set()), ("pos[car2]", 6),
    ]:  # fmt: skip
        say(label, value)
    assert [sample.value for sample in seen.take()] == [2, 5]
    assert (deployment.made_of["near"], deployment.types["near"]) == ("selection", "int")


def test_collection_says_where_each_value_came_from_under_its_policy() -> None:
    node, deployment, say = loaded("strmgen all = collection of int with any change by chosen; stream seen = all;")
    seen = deployment.streams["seen"].open()
    say("chosen", {"pos[car1]", "pos[car2]"})
    for label, value in [("pos[car1]", 1), ("pos[car2]", 1), ("pos[car1]", 1), ("pos[car1]", 2)]:
        say(label, value)
    assert [sample.value for sample in seen.take()] == [
        Collected("pos[car1]", 1),
        Collected("pos[car2]", 1),
        Collected("pos[car1]", 2),
    ]
    assert deployment.types["all"] == "collected(int)"
    [report] = [one for one in node.report() if one.label == "all"]
    assert report.policies == ("any update", "any change", "any change")


def test_mediation_may_be_read_by_units_and_mediated_itself() -> None:
    text = "strmgen near = selection of int by chosen; strmgen double = twice(near); stream seen = double;"
    _, deployment, say = loaded(text)
    seen = deployment.streams["seen"].open()
    say("chosen", {"pos[car1]"})
    say("pos[car1]", 21)
    assert [sample.value for sample in seen.take()] == [42]


def test_mediation_gives_a_late_choice_the_samples_it_asks_for() -> None:
    _, deployment, say = loaded("strmgen near = selection of int with oldest 20us by chosen; stream seen = near;")
    seen = deployment.streams["seen"].open()
    for t_us in (0, 10, 20, 30):
        say("pos[car2]", t_us, t_us)
    say("chosen", {"pos[car2]"}, 30)
    assert [sample.value for sample in seen.take()] == [10, 20, 30]


def test_mediation_is_refused_what_depends_on_it() -> None:
    _, _, say = loaded("strmgen near = selection of int by chosen; strmgen double = twice(near); stream s = double;")
    with pytest.raises(ProcessError, match="expected streams that do not depend on it, got 'double'"):
        say("chosen", {"double"})


def test_configuration_creates_and_removes_while_samples_flow() -> None:
    node, deployment, say = loaded("configure followed = follow(chosen with any change);")
    seen = Recorder()
    say("chosen", {"pos[car1]"})
    node.subscribe("twice pos[car1]", seen)
    say("pos[car1]", 3)
    say("chosen", {"pos[car2]"})
    say("pos[car1]", 4)
    assert seen.values == [6]
    assert node.labels == ("pos[car1]", "pos[car2]", "chosen", "followed", "twice pos[car2]")
    assert deployment.made_of["followed"] == "follow"
    assert "followed" not in deployment.types


def test_mediation_passes_on_what_a_configuration_creates() -> None:
    """The label is chosen before it exists, and waited for."""
    text = """
    strmgen all = collection of int by wished;
    strmgen wished = operator;
    configure followed = follow(chosen);
    stream seen = all;
    """
    node, deployment, say = loaded(text)
    seen = deployment.streams["seen"].open()
    say("wished", {"twice pos[car1]"})
    assert [one.waiting_for for one in node.report() if one.label == "all"] == [("twice pos[car1]",)]
    say("chosen", {"pos[car1]"})
    say("pos[car1]", 5)
    say("chosen", set())
    say("pos[car1]", 6)
    assert [sample.value for sample in seen.take()] == [Collected("twice pos[car1]", 10)]


def test_removed_deployment_takes_along_what_its_configurations_created() -> None:
    text = "strmgen all = collection of int by chosen; configure followed = follow(chosen); stream seen = all;"
    node, deployment, say = loaded(text)
    say("chosen", {"pos[car1]", "pos[car2]"})
    assert len(node.labels) == 7
    deployment.remove()
    assert node.labels == ()


def test_each_configuration_process_has_code_of_its_own() -> None:
    before = Follow.made
    loaded("configure one = follow(chosen); configure other = follow(chosen with any change);")
    assert Follow.made == before + 2


def test_failing_configuration_leaves_nothing_behind() -> None:
    def fail() -> Follow:
        raise ValueError("no map")

    offered = Registry()
    offered.source("operator", output="set(string)")
    offered.configuration("follow", input="set(string)")(fail)
    node = Node()
    text = (
        "source set(string) operator; configuration follow(set(string)); strmgen c = operator; configure f = follow(c);"
    )
    with pytest.raises(ValueError, match="no map"):
        load_kpl(text, offered, node)
    assert node.labels == ()


def test_configuration_that_the_host_lacks_or_has_with_another_type_is_refused() -> None:
    assert codes("configuration other(int); configure a = other(pos[car1]);") == ["K0701"]
    offered = Registry()
    offered.configuration("follow", input="int")(Follow)
    with pytest.raises(KplError, match=r"expected 'configuration follow\(int\)' as the host has it") as caught:
        load_kpl("configuration follow(set(string));", offered, Node())
    assert [found.code for found in caught.value.diagnostics] == ["K0702"]


def test_label_of_a_configuration_must_be_new_in_the_node() -> None:
    offered = registry()
    node = Node(registry=offered)
    node.add_source("followed")
    with pytest.raises(KplError, match="expected a label that is new in the node, got 'followed'"):
        load_kpl(HOST + "configure followed = follow(chosen);", offered, node)
    assert node.labels == ("followed",)


def test_name_of_a_configuration_is_taken_once() -> None:
    offered = registry()
    with pytest.raises(RegistryError, match="'follow': expected a new name for host code"):
        offered.unit("follow", inputs=("int",), output="int")


def test_stream_may_ask_for_what_is_valid_just_now() -> None:
    _, deployment, say = loaded("stream latest = pos[car1] with oldest 0s;")
    for t_us in (0, 10):
        say("pos[car1]", t_us, t_us)
    assert [sample.value for sample in deployment.streams["latest"].open().take()] == [10]


def test_sampling_without_delay_gives_what_is_known_at_the_sampled_time() -> None:
    """In KPL as in Python: nothing is waited for, so a sample that comes later than its time is not used."""
    text = "stream seen = pos[car1] with sample every 100us, use most recent, max delay 0s;"
    _, deployment, say = loaded(text)
    seen = deployment.streams["seen"].open()
    node = deployment.node
    say("pos[car1]", 1, 0)
    say("pos[car1]", 2, 150)
    node.stream("pos[car1]").publish(Sample(210, 190, 3))
    node.advance(310)
    found = [(sample.available_us, sample.valid_us, sample.value) for sample in seen.take()]
    assert found == [(0, 0, 1), (100, 100, 1), (200, 200, 2), (300, 300, 3)]
