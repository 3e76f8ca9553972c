"""`dyknow streams`: which streams ran in a run, or are declared to run, and what did they carry?"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, RunName, open_log
from service.cli.printing import format_table, show
from service.errors import InputError
from service.records.times import format_media

if TYPE_CHECKING:
    from service.records.runs import ProcessRecord, StreamInput
    from service.runs.graph.declared_streams import DeclaredStreams
    from service.runs.graph.stored_streams import RanStream, StoredStreams

GRAPHS = (".mmd", ".dot")


def streams(
    log: Annotated[
        str | None,
        typer.Argument(metavar="[LOG]", help="Event log: PATH.db, or a URL. Without: what is declared."),
    ] = None,
    run: RunName = None,
    kpl: Annotated[Path | None, typer.Option(help="KPL file to list instead of the shipped one.")] = None,
    graph: Annotated[Path | None, typer.Option(help="Write a graph too, into a file .mmd or .dot.")] = None,
    as_json: AsJson = False,
) -> None:
    """List the processes of a run and what their streams carried; without a log, what is declared."""
    _check_options(log, run=run, kpl=kpl, graph=graph)
    if log is None:
        from service.runs.graph.declared_streams import read_declared_streams

        declared = read_declared_streams(kpl)
        _draw(graph, declared.processes, has_run=False)
        _print_declared(declared, as_json=as_json)
    else:
        from service.runs.graph.stored_streams import streams_of

        with open_log(log) as opened:
            stored = streams_of(opened, opened.run(run))
        _draw(graph, stored.streams, has_run=True)
        _print_stored(stored, as_json=as_json)


def _check_options(log: str | None, *, run: str | None, kpl: Path | None, graph: Path | None) -> None:
    if log is None and run is not None:
        raise typer.BadParameter(f"expected a LOG that holds the run, got none with {run!r}", param_hint="--run")
    if log is not None and kpl is not None:
        raise typer.BadParameter(f"expected no LOG beside a text, got {log!r}", param_hint="--kpl")
    if graph is not None and graph.suffix.lower() not in GRAPHS:
        expected = "expected a path ending in .mmd (Mermaid) or .dot (Graphviz), which other programs draw"
        raise InputError(f"--graph: {expected}, got {str(graph)!r}")


def _draw(path: Path | None, processes: "Sequence[ProcessRecord]", *, has_run: bool) -> None:
    if path is None:
        return
    from dyknow.streams.graph import to_dot, to_mermaid
    from service.runs.graph.stored_streams import as_report

    write = to_dot if path.suffix.lower() == ".dot" else to_mermaid
    made_of = {one.label: one.made_of for one in processes if one.made_of}
    drawn = write([as_report(one) for one in processes], made_of=made_of, has_counts=has_run)
    path.write_text(drawn, encoding="utf-8")
    print(f"graph: {path}", file=sys.stderr)


def _print_stored(stored: "StoredStreams", *, as_json: bool) -> None:
    titles = ["label", "made of", "reads", "published", "dropped", "queued", "rate", "lag", "cost"]
    titles += ["last time", "last value"]
    show(stored, format_table(titles, [_stored_row(one) for one in stored.streams]), as_json=as_json)


def _stored_row(stream: "RanStream") -> list[str]:
    return [
        stream.label,
        stream.made_of,
        _reads(stream.inputs) + (f"; waits for {', '.join(stream.waiting_for)}" if stream.waiting_for else ""),
        str(stream.published),
        ", ".join(f"{count} ({cause})" for cause, count in stream.dropped.items()) or "0",
        ", ".join(map(str, stream.queued)) or "0",
        f"{stream.rate_hz:.1f}/s",
        "" if stream.lag_us is None else f"{stream.lag_us / 1000:.0f} ms",
        _cost(stream),
        "" if stream.last_valid_us is None else format_media(stream.last_valid_us),
        stream.last_value or "",
    ]


def _cost(stream: "RanStream") -> str:
    """Say how long the code of the process took, in all and each time; empty for a source, which has none."""
    if stream.busy_us is None or not stream.updates:
        return ""
    return f"{stream.busy_us / 1e6:.2f} s, {stream.busy_us / 1e3 / stream.updates:.2f} ms each"


def _print_declared(declared: "DeclaredStreams", *, as_json: bool) -> None:
    for warning in declared.warnings:
        print(warning, file=sys.stderr)
    processes = [[one.label, one.kind, one.made_of, one.type, _reads(one.inputs)] for one in declared.processes]
    handed_out = [[one.name, "stream", "", "", f"{one.label} with {one.policy}"] for one in declared.streams]
    table = format_table(["label", "kind", "made of", "type", "reads"], [*processes, *handed_out])
    show(declared, table, as_json=as_json)


def _reads(inputs: "Sequence[StreamInput]") -> str:
    return "; ".join(f"{one.label} with {one.policy}" for one in inputs)
