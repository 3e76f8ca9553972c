"""The drawing of a node shows every process behind what it reads, without overlap, whatever the labels are."""

import random
import re
from itertools import combinations, pairwise
from xml.etree import ElementTree

import pytest

from dyknow.graph import to_dot, to_svg
from dyknow.stream_report import StreamReport

SVG = "{http://www.w3.org/2000/svg}"
Rectangle = tuple[float, float, float, float]  # left, top, right, bottom


def report(label: str, *inputs: str, policies: tuple[str, ...] = (), **facts: object) -> StreamReport:
    values: dict[str, object] = {
        "label": label, "kind": "refinement" if inputs else "source", "inputs": inputs,
        "policies": policies or ("any update",) * len(inputs), "waiting_for": (), "published": 0, "delivered": 0,
        "dropped": {}, "subscribers": 0, "queued": (), "rate_hz": 0.0, "lag_us": None, "last_valid_us": None,
        "last_value": None, "updates": 0, "busy_ns": 0,
    }  # fmt: skip
    return StreamReport(**(values | facts))  # type: ignore[arg-type]  # the fields above, by name


def boxes(svg: str) -> dict[str, Rectangle]:
    """Read the rectangle of each process; its label is the text that follows it."""
    found: dict[str, Rectangle] = {}
    elements = list(ElementTree.fromstring(svg))
    for index, element in enumerate(elements):
        if element.get("class") == "process":
            left, top, width, height = (float(element.attrib[name]) for name in ("x", "y", "width", "height"))
            found[elements[index + 1].text or ""] = (left, top, left + width, top + height)
    return found


def routes(svg: str) -> list[list[tuple[float, float]]]:
    lines = ElementTree.fromstring(svg).findall(f"{SVG}polyline")
    return [
        [(float(x), float(y)) for x, y in re.findall(r"([\d.]+),([\d.]+)", line.attrib["points"])] for line in lines
    ]


def texts(svg: str) -> list[str]:
    return [element.text or "" for element in ElementTree.fromstring(svg).findall(f"{SVG}text")]


def random_graph(seed: int) -> list[StreamReport]:
    rng = random.Random(seed)
    labels = [f"p{index}" for index in range(rng.randrange(1, 14))]
    inputs = [rng.sample(labels[:index], min(index, rng.randrange(4))) for index in range(len(labels))]
    reports = [report(label, *inputs[index]) for index, label in enumerate(labels)]
    rng.shuffle(reports)
    return reports


def longest_path(label: str, reports: dict[str, StreamReport]) -> int:
    return max((longest_path(one, reports) + 1 for one in reports[label].inputs), default=0)


@pytest.mark.parametrize("seed", range(60))
def test_layers_are_longest_paths_and_boxes_do_not_overlap(seed: int) -> None:
    reports = random_graph(seed)
    drawn = boxes(to_svg(reports))
    assert drawn.keys() == {one.label for one in reports}
    by_label = {one.label: one for one in reports}
    columns = sorted({left for left, _, _, _ in drawn.values()})
    for label, (left, _, _, _) in drawn.items():
        assert columns.index(left) == longest_path(label, by_label)
    for (left, top, right, bottom), other in combinations(drawn.values(), 2):
        assert right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top


@pytest.mark.parametrize("seed", range(60))
def test_lines_join_their_processes_and_cross_no_other(seed: int) -> None:
    reports = random_graph(seed)
    svg = to_svg(reports)
    drawn = boxes(svg)
    ends = {(route[0], route[-1]) for route in routes(svg)}
    for one in reports:
        for label in one.inputs:
            start, end = drawn[label], drawn[one.label]
            from_there, to_here = (start[2], (start[1] + start[3]) / 2), (end[0], (end[1] + end[3]) / 2)
            assert (from_there, to_here) in ends
    for route in routes(svg):
        for (x, y), (next_x, next_y) in pairwise(route):
            for step in range(1, 20):
                at_x, at_y = x + (next_x - x) * step / 20, y + (next_y - y) * step / 20
                assert not any(
                    left < at_x < right and top < at_y < bottom for left, top, right, bottom in drawn.values()
                )


def test_text_fits_into_its_box() -> None:
    long = report("a", dropped={"order": 123456, "not sampled": 98765, "delay": 1}, published=10**9)
    svg = to_svg(
        [long, report("b", "a", policies=("sample every 200ms, use most recent, max delay 400ms, strict order",))]
    )
    for left, top, right, bottom in boxes(svg).values():
        inside = [
            element
            for element in ElementTree.fromstring(svg).findall(f"{SVG}text")
            if left < float(element.attrib["x"]) < right and top < float(element.attrib["y"]) < bottom
        ]
        assert len(inside) >= 3
        assert all(float(one.attrib["x"]) + 7.2 * len(one.text or "") <= right for one in inside)


def test_labels_are_escaped() -> None:
    label = "<b> & \"q\" 'r' \\ \x00\n"
    svg, dot = to_svg([report(label)]), to_dot([report(label)])
    assert texts(svg)[0] == "<b> & \"q\" 'r' \\ \ufffd\ufffd"
    assert '"<b> & \\"q\\" \'r\' \\\\ \ufffd\ufffd" [label=' in dot


def test_box_tells_counts_cost_and_policy() -> None:
    facts = {"published": 1200, "rate_hz": 25.0, "lag_us": 40_000, "dropped": {"order": 3}, "queued": (7,)}
    done = report("cars", "frames", policies=("strict order",), updates=4, busy_ns=10_000_000, **facts)
    assert texts(to_svg([report("frames"), done]))[3:] == [
        "cars",
        "refinement",
        "1,200 samples, 25.0/s, lag 40 ms",
        "dropped 3 (order)",
        "queued 7",
        "busy 10.0 ms, 2.500 ms each",
        "frames: strict order",
    ]


def test_long_policy_is_wrapped_at_a_comma() -> None:
    policy = "sample every 200ms, use most recent, max delay 400ms, strict order"
    lines = texts(to_svg([report("a"), report("b", "a", policies=(policy,))]))
    assert lines[-2:] == ["a: sample every 200ms, use most recent,", "  max delay 400ms, strict order"]


def test_dot_has_each_process_and_each_input_with_its_policy() -> None:
    dot = to_dot([report("a"), report("b"), report("c", "a", "b", policies=("any update", "any change"))])
    assert '  "a" -> "c";\n  "b" -> "c" [label="any change"];\n' in dot
    assert dot.count("[label=") == 4


def test_mediation_shows_what_it_waits_for() -> None:
    assert "waits for pos[car9]" in texts(to_svg([report("all", waiting_for=("pos[car9]",))]))


def test_empty_node_is_an_empty_drawing() -> None:
    assert boxes(to_svg([])) == {}
    assert "->" not in to_dot([])


def test_process_that_reads_a_stream_twice_has_one_line() -> None:
    assert len(routes(to_svg([report("a"), report("b", "a", "a")]))) == 1


def test_long_chain_is_no_problem() -> None:
    chain = [report("p0"), *(report(f"p{index}", f"p{index - 1}") for index in range(1, 1500))]
    assert len(boxes(to_svg(chain))) == 1500
