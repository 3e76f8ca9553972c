"""The drawing of a node shows every process behind what it reads, without overlap, whatever the labels are."""

import random
import re
from dataclasses import replace
from itertools import combinations, pairwise
from xml.etree import ElementTree

import pytest

from dyknow.graph import to_dot, to_svg
from dyknow.streams.stream_report import StreamReport

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


def texts(svg: str, kind: str = "") -> list[str]:
    """Read what is written in boxes, or with ``policy`` on lines."""
    return [element.text or "" for element in text_elements(svg) if (element.get("class") == "policy") == bool(kind)]


def text_elements(svg: str) -> list[ElementTree.Element]:
    return ElementTree.fromstring(svg).findall(f"{SVG}text")


def rectangle_of(text: ElementTree.Element) -> Rectangle:
    """Measure a text in a wide monospaced font: DejaVu Sans Mono has 0.602 em for a character."""
    size = 10 if text.get("class") == "policy" else 12
    x, y = float(text.attrib["x"]), float(text.attrib["y"])
    return (x, y - 0.8 * size, x + 0.602 * size * len(text.text or ""), y + 0.2 * size)


def overlap(one: Rectangle, other: Rectangle) -> bool:
    return not (one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1])


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
    assert not any(overlap(one, other) for one, other in combinations(drawn.values(), 2))


@pytest.mark.parametrize("seed", range(60))
def test_lines_join_their_processes_and_cross_no_other(seed: int) -> None:
    reports = random_graph(seed)
    svg = to_svg(reports)
    drawn = boxes(svg)
    ends = [(route[0], route[-1]) for route in routes(svg)]
    for one in reports:
        left, top, _, bottom = drawn[one.label]
        arrivals = [start for start, (x, y) in ends if x == left and top < y < bottom]
        begins = [(drawn[label][2], (drawn[label][1] + drawn[label][3]) / 2) for label in one.inputs]
        for arrival, begin in zip(sorted(arrivals), sorted(begins), strict=True):
            assert arrival == pytest.approx(begin, abs=0.11)  # coordinates are written with one decimal
    for route in routes(svg):
        for (x, y), (next_x, next_y) in pairwise(route):
            for step in range(1, 20):
                at_x, at_y = x + (next_x - x) * step / 20, y + (next_y - y) * step / 20
                assert not any(
                    left < at_x < right and top < at_y < bottom for left, top, right, bottom in drawn.values()
                )


POLICIES = (
    "any update",
    "any change, max delay 1s",
    "sample every 200ms, use most recent, max delay 400ms, from 5s to 90min, oldest 10s, strict order",
)


@pytest.mark.parametrize("seed", range(40))
def test_no_text_leaves_its_box_or_meets_a_line_or_another_text(seed: int) -> None:
    rng = random.Random(seed)
    reports = [
        report(
            one.label * rng.choice([1, 1, 12]),
            *one.inputs,
            policies=tuple(rng.choice(POLICIES) for _ in one.inputs),
            dropped=rng.choice([{}, {"order": 123456, "not sampled": 98765, "late": 10**9, "delay": 1}]),
            published=rng.choice([0, 10**9]),
            queued=rng.choice([(), (7, 1024)]),
        )
        for one in random_graph(seed)
    ]
    longer = {one.label: other.label for one, other in zip(random_graph(seed), reports, strict=True)}
    reports = [replace(one, inputs=tuple(longer[label] for label in one.inputs)) for one in reports]
    svg = to_svg(reports)
    drawn = boxes(svg).values()
    for text in text_elements(svg):
        place = rectangle_of(text)
        around = [box for box in drawn if overlap(box, place)]
        if text.get("class") == "policy":
            assert not around
            assert not any(cut(route, place) for route in routes(svg))
        else:
            [box] = around
            assert box[0] < place[0] < place[2] < box[2]
            assert box[1] < place[1] < place[3] < box[3]
    assert not any(overlap(one, other) for one, other in combinations(map(rectangle_of, text_elements(svg)), 2))


def cut(route: list[tuple[float, float]], rectangle: Rectangle) -> bool:
    """Tell whether a line runs through a rectangle, by trying many of its points."""
    left, top, right, bottom = rectangle
    return any(
        left < x + (next_x - x) * step / 60 < right and top < y + (next_y - y) * step / 60 < bottom
        for (x, y), (next_x, next_y) in pairwise(route)
        for step in range(61)
    )


def test_wide_characters_fit_into_their_box() -> None:
    [(left, _, right, _)] = boxes(to_svg([report("\u8eca" * 30)])).values()
    assert right - left > 30 * 12


def test_policy_stands_over_the_end_of_its_line() -> None:
    svg = to_svg([report("a"), report("b"), report("c", "a", "b", policies=("any change", "max delay 1s"))])
    for route, policy in zip(routes(svg), ("any change", "max delay 1s"), strict=True):
        [text] = [one for one in text_elements(svg) if one.text == policy]
        (from_x, from_y), (to_x, to_y) = route[-2:]
        assert from_y == to_y
        assert from_x < float(text.attrib["x"]) < to_x
        assert 0 < to_y - float(text.attrib["y"]) < 5


def test_labels_are_escaped() -> None:
    label = "<b> & \"q\" 'r' \\ \x00\n"
    svg, dot = to_svg([report(label)]), to_dot([report(label)])
    assert texts(svg)[0] == "<b> & \"q\" 'r' \\ \ufffd\ufffd"
    assert '"<b> & \\"q\\" \'r\' \\\\ \ufffd\ufffd" [label=' in dot


def test_box_tells_unit_counts_and_cost_and_the_line_its_policy() -> None:
    facts = {"published": 1200, "rate_hz": 25.0, "lag_us": 40_000, "dropped": {"order": 3}, "queued": (7,)}
    done = report("cars", "frames", policies=("strict order",), updates=4, busy_ns=10_000_000, **facts)
    svg = to_svg([report("frames"), done], made_of={"frames": "video", "cars": "anchoring"})
    assert texts(svg) == [
        "frames",
        "source video",
        "0 samples",
        "cars",
        "refinement anchoring",
        "1,200 samples, 25.0/s,",
        "  lag 40 ms",
        "dropped 3 (order)",
        "queued 7",
        "busy 10.0 ms, 2.500 ms each",
    ]
    assert texts(svg, "policy") == ["strict order"]


def test_what_was_only_declared_has_no_counts() -> None:
    reports = [report("frames"), report("cars", "frames")]
    assert texts(to_svg(reports, has_counts=False)) == ["frames", "source", "cars", "refinement"]
    assert "samples" not in to_dot(reports, has_counts=False)


def test_long_policy_is_wrapped_at_a_comma() -> None:
    policy = "sample every 200ms, use most recent, max delay 400ms, strict order"
    lines = texts(to_svg([report("a"), report("b", "a", policies=(policy,))]), "policy")
    assert lines == ["sample every 200ms,", "  use most recent,", "  max delay 400ms,", "  strict order"]


def test_dot_has_each_process_and_each_input_with_its_policy() -> None:
    dot = to_dot([report("a"), report("b"), report("c", "a", "b", policies=("any update", "any change"))])
    assert '  "a" -> "c" [label="any update"];\n  "b" -> "c" [label="any change"];\n' in dot
    assert dot.count("[label=") == 5


def test_mediation_shows_what_it_waits_for() -> None:
    assert "waits for pos[car9]" in texts(to_svg([report("all", waiting_for=("pos[car9]",))]))


def test_empty_node_is_an_empty_drawing() -> None:
    assert boxes(to_svg([])) == {}
    assert "->" not in to_dot([])


def test_process_that_reads_a_stream_twice_has_a_line_for_each_policy() -> None:
    svg = to_svg([report("a"), report("b", "a", "a", policies=("any change", "strict order"))])
    assert len({route[-1] for route in routes(svg)}) == 2
    assert texts(svg, "policy") == ["any change", "strict order"]


def test_long_chain_is_no_problem() -> None:
    chain = [report("p0"), *(report(f"p{index}", f"p{index - 1}") for index in range(1, 1500))]
    assert len(boxes(to_svg(chain))) == 1500
