"""How do the processes of a node hang together? Its report as a graph, in the words of Mermaid or of Graphviz.

Both are functions of `Node.report()` and of the names that a text gives. Programs that draw them lay out any graph;
Mermaid is drawn by the pages of most code hosts as it stands.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from dyknow.streams.stream_report import StreamReport

_NO_NAMES: Mapping[str, str] = {}
_MERMAID_CODES: Mapping[int, str] = str.maketrans({one: f"#{ord(one)};" for one in '#"&<>`'})


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
    for label, policy, reader in _readings(reports):
        lines.append(f'  "{_dot(label)}" -> "{_dot(reader)}" [label="{_dot(policy)}"];')
    return "\n".join([*lines, "}", ""])


def to_mermaid(
    reports: Sequence[StreamReport], *, made_of: Mapping[str, str] = _NO_NAMES, has_counts: bool = True
) -> str:
    """Write the graph of a node as a flowchart of Mermaid.

    Parameters
    ----------
    made_of, has_counts : as for `to_dot`.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node = Node()
    >>> _ = node.add_source("frames")
    >>> print(to_mermaid(node.report(), made_of={"frames": "video"}))
    flowchart LR
      n0["frames<br/>source video<br/>0 samples"]
    <BLANKLINE>
    """
    names = {report.label: f"n{number}" for number, report in enumerate(reports)}
    lines = ["flowchart LR"]
    for report in reports:
        text = "<br/>".join(map(_mermaid, _facts(report, made_of, has_counts=has_counts)))
        lines.append(f'  {names[report.label]}["{text}"]')
    for label, policy, reader in _readings(reports):
        lines.append(f'  {names[label]} -->|"{_mermaid(policy)}"| {names[reader]}')
    return "\n".join([*lines, ""])


def _readings(reports: Iterable[StreamReport]) -> Iterator[tuple[str, str, str]]:
    """Say who reads what: the label that is read, the policy, the reader."""
    for report in reports:
        for label, policy in zip(report.inputs, report.policies, strict=True):
            yield label, policy, report.label


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


def _mermaid(text: str) -> str:
    return _printable(text).translate(_MERMAID_CODES)


def _dot(text: str) -> str:
    return _printable(text).replace("\\", "\\\\").replace('"', '\\"')


def _printable(text: str) -> str:
    """Replace characters that neither language may contain."""
    return "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in text)
