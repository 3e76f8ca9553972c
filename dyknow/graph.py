"""How do the processes of a node hang together? Its report drawn as a graph, as text for Graphviz or as SVG.

Both are functions of `Node.report()` alone. The SVG needs nothing but a browser: processes stand in layers from left to
right, each behind everything that it reads, in the manner of Sugiyama, Tagawa and Toda (1981), *Methods for visual
understanding of hierarchical system structures*: a line that passes a layer takes a place of its own in it, and each
layer is sorted once by the mean place of what its members read. There is no second sweep: graphs here are small.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from html import escape
from itertools import pairwise

from dyknow.stream_report import StreamReport

_CHARACTER_PX, _LINE_PX = 7.2, 16  # of a monospaced font of 12 px
_MARGIN_PX, _LAYER_GAP_PX, _BOX_GAP_PX = 10, 56, 20
_LONGEST_LINE = 44  # characters
_DEFAULT_POLICY = "any update"


def to_dot(reports: Sequence[StreamReport]) -> str:
    """Write the graph of a node in the language of Graphviz.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node = Node()
    >>> _ = node.add_source("frames")
    >>> print(to_dot(node.report()))
    digraph node {
      rankdir=LR;
      node [shape=box, fontname=monospace];
      "frames" [label="frames\\lsource\\l0 samples\\l"];
    }
    <BLANKLINE>
    """
    lines = ["digraph node {", "  rankdir=LR;", "  node [shape=box, fontname=monospace];"]
    for report in reports:
        text = "".join(f"{_dot(line)}\\l" for line in _facts(report))
        lines.append(f'  "{_dot(report.label)}" [label="{text}"];')
    for report in reports:
        for label, policy in zip(report.inputs, report.policies, strict=True):
            shown = f' [label="{_dot(policy)}"]' if policy != _DEFAULT_POLICY else ""
            lines.append(f'  "{_dot(label)}" -> "{_dot(report.label)}"{shown};')
    return "\n".join([*lines, "}", ""])


def to_svg(reports: Sequence[StreamReport]) -> str:
    """Draw the graph of a node; the policies under which a process reads are written into its box.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node = Node()
    >>> _ = node.add_source("frames")
    >>> to_svg(node.report()).count("<rect class='process'")
    1
    """
    boxes = _place(reports)
    routes = [route for report in reports for route in _routes(report, boxes)]
    width = max((box.right_px for box in boxes.values()), default=0) + _MARGIN_PX
    height = max((box.bottom_px for box in boxes.values()), default=0) + _MARGIN_PX
    drawn = [_draw_route(route) for route in routes]
    drawn += [_draw_box(boxes[_Slot(report.label)]) for report in reports]
    return _SVG.format(width=f"{width:.0f}", height=f"{height:.0f}", body="\n".join(drawn))


_SVG = """<svg xmlns='http://www.w3.org/2000/svg' xml:space='preserve'
width='{width}' height='{height}' viewBox='0 0 {width} {height}'>
<style>
text {{ font-family: monospace; font-size: 12px; fill: #1c1c1c; }}
.label {{ font-weight: bold; }}
.process {{ fill: #f4f6f8; stroke: #48525c; }}
.route {{ fill: none; stroke: #48525c; }}
</style>
<defs><marker id='tip' viewBox='0 0 8 8' refX='8' refY='4' markerWidth='8' markerHeight='8' orient='auto'>\
<path d='M0 0 L8 4 L0 8 z' fill='#48525c'/></marker></defs>
<rect width='100%' height='100%' fill='#ffffff'/>
{body}
</svg>
"""


@dataclass(frozen=True, slots=True)
class _Slot:
    """A place in a layer: of a process, or with a reader of the line from the process to it that passes."""

    label: str
    reader: str = ""
    layer: int = 0


@dataclass(frozen=True, slots=True)
class _Box:
    left_px: float
    top_px: float
    width_px: float
    lines: tuple[str, ...]

    @property
    def right_px(self) -> float:
        return self.left_px + self.width_px

    @property
    def bottom_px(self) -> float:
        return self.top_px + _height_px(self.lines)

    @property
    def middle_px(self) -> float:
        return (self.top_px + self.bottom_px) / 2


def _facts(report: StreamReport) -> list[str]:
    """Say in a few lines what a process is and what it has done."""
    facts = [report.label, report.kind]
    if report.waiting_for:
        facts.append(f"waits for {', '.join(report.waiting_for)}")
    rate = f", {report.rate_hz:.1f}/s" if report.rate_hz else ""
    lag = f", lag {report.lag_us / 1000:.0f} ms" if report.lag_us else ""
    facts.append(f"{report.published:,} samples{rate}{lag}")
    if report.dropped:
        facts.append("dropped " + ", ".join(f"{count:,} ({cause})" for cause, count in sorted(report.dropped.items())))
    if any(report.queued):
        facts.append(f"queued {', '.join(map(str, report.queued))}")
    if report.busy_ns:
        facts.append(
            f"busy {report.busy_ns / 1e6:,.1f} ms, {report.busy_ns / 1e6 / max(1, report.updates):.3f} ms each"
        )
    return facts


def _lines(report: StreamReport) -> tuple[str, ...]:
    reads = [
        f"{label}: {policy}"
        for label, policy in zip(report.inputs, report.policies, strict=True)
        if policy != _DEFAULT_POLICY
    ]
    return tuple(line for text in (*_facts(report), *reads) for line in _wrap(text))


def _wrap(text: str) -> Iterable[str]:
    """Break a text behind commas; a part that is too long by itself stays whole, as names must be legible."""
    line = ""
    for part in text.split(", "):
        if line and len(line) + len(part) > _LONGEST_LINE:
            yield f"{line},"
            line = f"  {part}"
        else:
            line = f"{line}, {part}" if line else part
    yield line


def _layers(reports: Sequence[StreamReport]) -> dict[str, int]:
    """Count the processes on the longest path before each."""
    inputs = {report.label: report.inputs for report in reports}
    layers: dict[str, int] = {}
    for label in TopologicalSorter(inputs).static_order():
        layers[label] = max((layers[one] + 1 for one in inputs[label]), default=0)
    return layers


def _place(reports: Sequence[StreamReport]) -> dict[_Slot, _Box]:
    """Give every process, and every line that passes a layer, a place."""
    texts = {_Slot(report.label): _lines(report) for report in reports}
    places: dict[_Slot, _Box] = {}
    columns = _columns(reports)
    heights_px = [sum(_height_px(texts.get(slot, ())) + _BOX_GAP_PX for slot in column) for column in columns]
    left_px: float = _MARGIN_PX
    for column, height_px in zip(columns, heights_px, strict=True):
        width_px = max(_width_px(texts.get(slot, ())) for slot in column)
        top_px = _MARGIN_PX + (max(heights_px) - height_px) / 2
        for slot in column:
            lines = texts.get(slot, ())
            places[slot] = _Box(left_px, top_px, width_px, lines)
            top_px += _height_px(lines) + _BOX_GAP_PX
        left_px += width_px + _LAYER_GAP_PX
    return places


def _columns(reports: Sequence[StreamReport]) -> list[list[_Slot]]:
    layers = _layers(reports)
    columns: list[list[_Slot]] = [[] for _ in range(max(layers.values(), default=-1) + 1)]
    before: dict[_Slot, list[_Slot]] = {}
    for report in reports:
        columns[layers[report.label]].append(_Slot(report.label))
        for label in dict.fromkeys(report.inputs):
            route = _slots_on_the_way(label, report.label, layers)
            for slot in route[1:-1]:
                columns[slot.layer].append(slot)
            for one, other in pairwise(route):
                before.setdefault(other, []).append(one)
    rank: dict[_Slot, int] = {}
    for column in columns:
        column.sort(key=lambda slot: _mean([rank[one] for one in before.get(slot, ())]))
        rank.update({slot: index for index, slot in enumerate(column)})
    return columns


def _slots_on_the_way(label: str, reader: str, layers: dict[str, int]) -> list[_Slot]:
    passed = [_Slot(label, reader, layer) for layer in range(layers[label] + 1, layers[reader])]
    return [_Slot(label), *passed, _Slot(reader)]


def _routes(report: StreamReport, boxes: dict[_Slot, _Box]) -> Iterable[list[tuple[float, float]]]:
    for label in dict.fromkeys(report.inputs):
        start, end = boxes[_Slot(label)], boxes[_Slot(report.label)]
        passed = sorted(
            (slot.layer, boxes[slot]) for slot in boxes if (slot.label, slot.reader) == (label, report.label)
        )
        bends = [(x_px, box.middle_px) for _, box in passed for x_px in (box.left_px, box.right_px)]
        yield [(start.right_px, start.middle_px), *bends, (end.left_px, end.middle_px)]


def _draw_route(points_px: Iterable[tuple[float, float]]) -> str:
    points = " ".join(f"{x_px:.1f},{y_px:.1f}" for x_px, y_px in points_px)
    return f"<polyline class='route' points='{points}' marker-end='url(#tip)'/>"


def _draw_box(box: _Box) -> str:
    place = f"x='{box.left_px:.1f}' y='{box.top_px:.1f}' width='{box.width_px:.1f}' height='{_height_px(box.lines)}'"
    texts = [
        f"<text{' class=' + repr('label') if index == 0 else ''} x='{box.left_px + 8:.1f}' "
        f"y='{box.top_px + _LINE_PX * (index + 1) + 2:.1f}'>{_xml(line)}</text>"
        for index, line in enumerate(box.lines)
    ]
    return "\n".join([f"<rect class='process' {place} rx='3'/>", *texts])


def _width_px(lines: Sequence[str]) -> float:
    return max((len(line) for line in lines), default=0) * _CHARACTER_PX + 16


def _height_px(lines: Sequence[str]) -> int:
    return len(lines) * _LINE_PX + 10 if lines else 0


def _mean(numbers: Sequence[int]) -> float:
    return sum(numbers) / len(numbers) if numbers else 0.0


def _xml(text: str) -> str:
    return escape(_printable(text))


def _dot(text: str) -> str:
    return _printable(text).replace("\\", "\\\\").replace('"', '\\"')


def _printable(text: str) -> str:
    """Replace characters that neither language may contain."""
    return "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in text)
