"""How do the processes of a node hang together? Its report drawn as a graph, as text for Graphviz or as SVG.

Both are functions of `Node.report()` and of the names that a text gives. The SVG needs nothing but a browser: processes
stand in layers from left to right, each behind everything that it reads, in the manner of Sugiyama, Tagawa and Toda
(1981), *Methods for visual understanding of hierarchical system structures*: a line that passes a layer takes a place
of its own in it, and each layer is sorted once by the mean place of what its members read. There is no second sweep:
graphs here are small. Left of each box a strip is kept free, where every line comes in level, under the words of its
policy.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from graphlib import TopologicalSorter
from html import escape
from itertools import pairwise
from types import MappingProxyType
from unicodedata import east_asian_width

from dyknow.streams.stream_report import StreamReport

_CHARACTER_PX, _LINE_PX = 7.3, 16  # of a monospaced font of 12 px; none of the usual ones is wider
_SMALL_PX, _SMALL_LINE_PX = 6.1, 13  # of one of 10 px
_MARGIN_PX, _LAYER_GAP_PX, _BOX_GAP_PX, _ENTRY_GAP_PX = 10, 36, 20, 8
_LONGEST_LINE, _LONGEST_POLICY = 28, 20  # characters
_NO_NAMES: Mapping[str, str] = MappingProxyType({})


def to_dot(reports: Sequence[StreamReport], *, made_of: Mapping[str, str] = _NO_NAMES, has_counts: bool = True) -> str:
    """Write the graph of a node in the language of Graphviz.

    Parameters
    ----------
    made_of : the name of the source, unit or configuration of each process, as `Deployment.made_of` gives it.
    has_counts : whether the processes have run; what was only declared has no counts to show.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node = Node()
    >>> _ = node.add_source("frames")
    >>> print(to_dot(node.report(), made_of={"frames": "video"}))
    digraph node {
      rankdir=LR;
      node [shape=box, fontname=monospace];
      "frames" [label="frames\\lsource video\\l0 samples\\l"];
    }
    <BLANKLINE>
    """
    lines = ["digraph node {", "  rankdir=LR;", "  node [shape=box, fontname=monospace];"]
    for report in reports:
        text = "".join(f"{_dot(line)}\\l" for line in _facts(report, made_of, has_counts=has_counts))
        lines.append(f'  "{_dot(report.label)}" [label="{text}"];')
    for report in reports:
        for label, policy in zip(report.inputs, report.policies, strict=True):
            lines.append(f'  "{_dot(label)}" -> "{_dot(report.label)}" [label="{_dot(policy)}"];')
    return "\n".join([*lines, "}", ""])


def to_svg(reports: Sequence[StreamReport], *, made_of: Mapping[str, str] = _NO_NAMES, has_counts: bool = True) -> str:
    """Draw the graph of a node; the policies under which a process reads stand on the lines that enter it.

    Parameters
    ----------
    made_of, has_counts : as for `to_dot`.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node = Node()
    >>> _ = node.add_source("frames")
    >>> to_svg(node.report()).count("<rect class='process'")
    1
    """
    texts = {report.label: tuple(_box_lines(report, made_of, has_counts=has_counts)) for report in reports}
    boxes = _place(reports, texts)
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
.policy {{ font-size: 10px; fill: #48525c; }}
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
class _Entry:
    """Where one input comes in: the label that is read, and its policy over a level line."""

    label: str
    lines: tuple[str, ...]
    y_px: float


@dataclass(frozen=True, slots=True)
class _Box:
    """A box, and the strip left of it from `strip_px` where its inputs come in; or the place of a line that passes."""

    strip_px: float
    left_px: float
    top_px: float
    width_px: float
    height_px: float
    lines: tuple[str, ...] = ()
    entries: tuple[_Entry, ...] = ()

    @property
    def right_px(self) -> float:
        return self.left_px + self.width_px

    @property
    def bottom_px(self) -> float:
        return self.top_px + self.height_px

    @property
    def middle_px(self) -> float:
        return (self.top_px + self.bottom_px) / 2


def _facts(report: StreamReport, made_of: Mapping[str, str], *, has_counts: bool) -> list[str]:
    """Say in a few lines what a process is and what it has done."""
    name = made_of.get(report.label, report.kind)
    facts = [report.label, report.kind if name == report.kind else f"{report.kind} {name}"]
    if report.waiting_for:
        facts.append(f"waits for {', '.join(report.waiting_for)}")
    return [*facts, *_counts(report)] if has_counts else facts


def _counts(report: StreamReport) -> Iterable[str]:
    rate = f", {report.rate_hz:.1f}/s" if report.rate_hz else ""
    lag = f", lag {report.lag_us / 1000:.0f} ms" if report.lag_us is not None else ""
    yield f"{report.published:,} samples{rate}{lag}"
    if report.dropped:
        yield "dropped " + ", ".join(f"{count:,} ({cause})" for cause, count in sorted(report.dropped.items()))
    if report.queued:
        yield f"queued {', '.join(map(str, report.queued))}"
    if report.busy_ns:
        yield f"busy {report.busy_ns / 1e6:,.1f} ms, {report.busy_ns / 1e6 / max(1, report.updates):.3f} ms each"


def _box_lines(report: StreamReport, made_of: Mapping[str, str], *, has_counts: bool) -> Iterable[str]:
    for text in _facts(report, made_of, has_counts=has_counts):
        yield from _wrap(text, _LONGEST_LINE)


def _wrap(text: str, longest: int) -> Iterable[str]:
    """Break a text behind commas; a part that is too long by itself stays whole, as names must be legible."""
    line = ""
    for part in text.split(", "):
        if line and len(line) + len(part) > longest:
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


def _place(reports: Sequence[StreamReport], texts: Mapping[str, tuple[str, ...]]) -> dict[_Slot, _Box]:
    """Give every process, and every line that passes a layer, a place."""
    layers = _layers(reports)
    columns = _columns(reports, layers)
    policies = {report.label: [tuple(_wrap(one, _LONGEST_POLICY)) for one in report.policies] for report in reports}
    by_label = {report.label: report for report in reports}
    heights_px = {slot: _slot_height_px(slot, texts, policies) for column in columns for slot in column}
    column_px = [sum(heights_px[slot] + _BOX_GAP_PX for slot in column) for column in columns]
    places: dict[_Slot, _Box] = {}
    strip_px: float = _MARGIN_PX
    for column, height_px in zip(columns, column_px, strict=True):
        here = [slot.label for slot in column if not slot.reader]
        words = [line for label in here for lines in policies[label] for line in lines]
        left_px = strip_px + (_width_px(words, _SMALL_PX) if words else 0)
        width_px = max(_width_px(texts[label], _CHARACTER_PX) for label in here)
        top_px = _MARGIN_PX + (max(column_px) - height_px) / 2
        for slot in column:
            lines = () if slot.reader else texts[slot.label]
            place = _Box(strip_px, left_px, top_px, width_px, heights_px[slot], lines)
            if not slot.reader:
                place = replace(place, entries=tuple(_entries(by_label[slot.label], policies, place, places, layers)))
            places[slot] = place
            top_px += heights_px[slot] + _BOX_GAP_PX
        strip_px = left_px + width_px + _LAYER_GAP_PX
    return places


def _slot_height_px(
    slot: _Slot, texts: Mapping[str, tuple[str, ...]], policies: Mapping[str, list[tuple[str, ...]]]
) -> float:
    if slot.reader:
        return 0
    return max(_height_px(texts[slot.label]), sum(map(_entry_height_px, policies[slot.label])))


def _entry_height_px(policy: tuple[str, ...]) -> float:
    return len(policy) * _SMALL_LINE_PX + _ENTRY_GAP_PX


def _entries(
    report: StreamReport,
    policies: Mapping[str, list[tuple[str, ...]]],
    place: _Box,
    places: Mapping[_Slot, _Box],
    layers: Mapping[str, int],
) -> Iterable[_Entry]:
    """Let inputs come in one below another, in the order in which they come from the layer before."""
    inputs = list(zip(report.inputs, policies[report.label], strict=True))
    inputs.sort(key=lambda one: places[_slots_on_the_way(one[0], report.label, layers)[-2]].middle_px)
    y_px = place.middle_px - sum(_entry_height_px(policy) for _, policy in inputs) / 2
    for label, policy in inputs:
        y_px += _entry_height_px(policy)
        yield _Entry(label, policy, y_px - _ENTRY_GAP_PX / 2)


def _columns(reports: Sequence[StreamReport], layers: Mapping[str, int]) -> list[list[_Slot]]:
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


def _slots_on_the_way(label: str, reader: str, layers: Mapping[str, int]) -> list[_Slot]:
    passed = [_Slot(label, reader, layer) for layer in range(layers[label] + 1, layers[reader])]
    return [_Slot(label), *passed, _Slot(reader)]


def _routes(report: StreamReport, boxes: dict[_Slot, _Box]) -> Iterable[list[tuple[float, float]]]:
    end = boxes[_Slot(report.label)]
    for entry in end.entries:
        start = boxes[_Slot(entry.label)]
        passed = sorted(
            (slot.layer, box) for slot, box in boxes.items() if (slot.label, slot.reader) == (entry.label, report.label)
        )
        bends = [(x_px, box.middle_px) for _, box in passed for x_px in (box.strip_px, box.right_px)]
        here = [(end.strip_px, entry.y_px), (end.left_px, entry.y_px)]
        yield [(start.right_px, start.middle_px), *bends, *here]


def _draw_route(points_px: Iterable[tuple[float, float]]) -> str:
    points = " ".join(f"{x_px:.1f},{y_px:.1f}" for x_px, y_px in points_px)
    return f"<polyline class='route' points='{points}' marker-end='url(#tip)'/>"


def _draw_box(box: _Box) -> str:
    place = f"x='{box.left_px:.1f}' y='{box.top_px:.1f}' width='{box.width_px:.1f}' height='{box.height_px:.1f}'"
    texts = [
        f"<text{' class=' + repr('label') if index == 0 else ''} x='{box.left_px + 8:.1f}' "
        f"y='{box.top_px + _LINE_PX * (index + 1) + 2:.1f}'>{_xml(line)}</text>"
        for index, line in enumerate(box.lines)
    ]
    policies = [
        f"<text class='policy' x='{box.strip_px + 4:.1f}' "
        f"y='{entry.y_px - 3 - _SMALL_LINE_PX * (len(entry.lines) - 1 - index):.1f}'>{_xml(line)}</text>"
        for entry in box.entries
        for index, line in enumerate(entry.lines)
    ]
    return "\n".join([f"<rect class='process' {place} rx='3'/>", *texts, *policies])


def _width_px(lines: Iterable[str], character_px: float) -> float:
    return max((_cells(line) for line in lines), default=0) * character_px + 16


def _cells(text: str) -> int:
    """Count the cells that a text takes in a monospaced font: Chinese, for one, takes two for each character."""
    return sum(2 if east_asian_width(one) in "WF" else 1 for one in text)


def _height_px(lines: Sequence[str]) -> int:
    return len(lines) * _LINE_PX + 10


def _mean(numbers: Sequence[int]) -> float:
    return sum(numbers) / len(numbers) if numbers else 0.0


def _xml(text: str) -> str:
    return escape(_printable(text))


def _dot(text: str) -> str:
    return _printable(text).replace("\\", "\\\\").replace('"', '\\"')


def _printable(text: str) -> str:
    """Replace characters that neither language may contain."""
    return "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in text)
