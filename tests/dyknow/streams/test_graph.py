"""The graph of a node names every process, what it has done, and under which policy it reads what."""

import re

from dyknow.streams.graph import to_dot, to_mermaid
from dyknow.streams.stream_report import StreamReport


def report(label: str, *inputs: str, policies: tuple[str, ...] = (), **facts: object) -> StreamReport:
    values: dict[str, object] = {
        "label": label, "kind": "refinement" if inputs else "source", "inputs": inputs,
        "policies": policies or ("any update",) * len(inputs), "waiting_for": (), "published": 0, "delivered": 0,
        "dropped": {}, "subscribers": 0, "queued": (), "rate_hz": 0.0, "lag_us": None, "last_valid_us": None,
        "last_value": None, "updates": 0, "busy_ns": 0,
    }  # fmt: skip
    return StreamReport(**(values | facts))  # type: ignore[arg-type]  # the fields above, by name


def test_mermaid_has_each_process_and_each_input_with_its_policy() -> None:
    reports = [report("c", "a", "b", policies=("any update", "any change")), report("a"), report("b")]
    assert to_mermaid(reports, has_counts=False).splitlines() == [
        "flowchart LR",
        '  n0["c<br/>refinement"]',
        '  n1["a<br/>source"]',
        '  n2["b<br/>source"]',
        '  n1 -->|"any update"| n0',
        '  n2 -->|"any change"| n0',
    ]


def test_dot_has_each_process_and_each_input_with_its_policy() -> None:
    dot = to_dot([report("a"), report("b"), report("c", "a", "b", policies=("any update", "any change"))])
    assert '  "a" -> "c" [label="any update"];\n  "b" -> "c" [label="any change"];\n' in dot
    assert dot.count("[label=") == 5


def test_labels_are_escaped() -> None:
    label = "<b> & \"q\" 'r' #1; `\\ \x00\n"
    mermaid, dot = to_mermaid([report(label)]), to_dot([report(label)])
    assert "n0[\"#60;b#62; #38; #34;q#34; 'r' #35;1; #96;\\ \ufffd\ufffd<br/>source<br/>" in mermaid
    assert '"<b> & \\"q\\" \'r\' #1; `\\\\ \ufffd\ufffd" [label=' in dot


def test_process_tells_unit_counts_and_cost() -> None:
    facts = {"published": 1200, "rate_hz": 25.0, "lag_us": 40_000, "dropped": {"order": 3}, "queued": (7,)}
    done = report("cars", "frames", policies=("strict order",), updates=4, busy_ns=10_000_000, **facts)
    lines = [
        "cars",
        "refinement anchoring",
        "1,200 samples, 25.0/s, lag 40 ms",
        "dropped 3 (order)",
        "queued 7",
        "busy 10.0 ms, 2.500 ms each",
    ]
    reports, names = [report("frames"), done], {"frames": "video", "cars": "anchoring"}
    assert f'n1["{"<br/>".join(lines)}"]' in to_mermaid(reports, made_of=names)
    assert "".join(f"{line}\\l" for line in lines) in to_dot(reports, made_of=names)


def test_what_was_only_declared_has_no_counts() -> None:
    reports = [report("frames"), report("cars", "frames")]
    for write in (to_mermaid, to_dot):
        assert "samples" not in write(reports, has_counts=False)


def test_mediation_shows_what_it_waits_for() -> None:
    assert "<br/>waits for pos[car9]<br/>" in to_mermaid([report("all", waiting_for=("pos[car9]",))])


def test_empty_node_is_an_empty_graph() -> None:
    assert to_mermaid([]) == "flowchart LR\n"
    assert "->" not in to_dot([])


def test_process_that_reads_a_stream_twice_has_a_line_for_each_policy() -> None:
    mermaid = to_mermaid([report("a"), report("b", "a", "a", policies=("any change", "strict order"))])
    assert re.findall(r'n0 -->\|"(.*)"\| n1', mermaid) == ["any change", "strict order"]
