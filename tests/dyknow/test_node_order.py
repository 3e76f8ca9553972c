"""The order of processes, in which time and the end of the input reach them."""

from dyknow.node import depends_on, inputs_first
from dyknow.policies.policy import Policy
from dyknow.streams.process import Process
from dyknow.streams.stream import StreamGenerator


def graph(reads: dict[str, str]) -> dict[str, Process]:
    """Make processes that read those named by single letters."""
    processes = {label: Process(StreamGenerator(label)) for label in reads}
    for label, inputs in reads.items():
        for one in inputs:
            processes[label].read(processes[one].output, print, Policy())
    return processes


def test_processes_keep_the_order_of_creation_where_it_fits() -> None:
    assert [one.label for one in inputs_first(graph({"a": "", "b": "a", "c": "", "d": "ab"}))] == ["a", "b", "c", "d"]


def test_process_comes_after_an_input_that_was_created_later() -> None:
    assert [one.label for one in inputs_first(graph({"a": "c", "b": "", "c": "d", "d": ""}))] == ["d", "c", "a", "b"]


def test_dependence_goes_through_other_processes() -> None:
    processes = graph({"a": "", "b": "a", "c": "b", "d": "aa"})
    assert [label for label in processes if depends_on(processes, label, "b")] == ["b", "c"]


def test_process_that_is_just_being_removed_is_left_out() -> None:
    processes = graph({"a": "", "b": "a"})
    del processes["a"]
    assert [one.label for one in inputs_first(processes)] == ["b"]
    assert not depends_on(processes, "b", "a")
