"""`dyknow check`: is anything wrong in these chronicle files, and what would they cost?"""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import exit_codes
from service.cli.counted import counted
from service.cli.texts.stream_option import STREAM_CODES, StreamChoice, StreamOption, tell_stream

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from chronicles.language.diagnostics import Diagnostic
    from service.texts.chronicle_files import Checked
    from service.texts.text_streams import Stream


class CheckFormat(StrEnum):
    """How to print findings."""

    text = "text"
    json = "json"
    github = "github"


def check(
    files: Annotated[
        list[str] | None, typer.Argument(metavar="FILE...", help="Chronicle files; - reads standard input.")
    ] = None,
    output: Annotated[
        CheckFormat, typer.Option("--format", help="text, json, or github (annotations of a pull request).")
    ] = CheckFormat.text,
    cost: Annotated[bool, typer.Option("--cost", help="Also bound how many instances can wait at once.")] = False,
    rates: Annotated[
        list[str] | None,
        typer.Option("--rate", metavar="NAME=HZ", help="For --cost: most events a second of a name; else 1."),
    ] = None,
    keys: Annotated[
        int, typer.Option(min=1, help="For --cost: how many values an argument can have; rates are per value.")
    ] = 1,
    explain: Annotated[str | None, typer.Option(metavar="CODE", help="Say what a code such as C0201 means.")] = None,
    stream: StreamOption = None,
    monitors: Annotated[
        list[Path] | None,
        typer.Option("--monitors", help="File of monitors that give messages to the chronicles; repeat for several."),
    ] = None,
) -> None:
    """Check chronicle files, taken together as `process` takes them; exit with 3 if one has an error."""
    if explain is not None:
        _print_code(explain)
        return
    if not files:
        raise typer.BadParameter("expected at least one chronicle file, got none", param_hint="FILE")
    if rates and not cost:
        raise typer.BadParameter("expected --cost to go with it, got no --cost", param_hint="--rate")
    from service.monitoring.monitor_files import load_monitor_files
    from service.texts.chronicle_files import check_chronicles, read_text_or_input, with_relations

    rates_hz = read_rates(rates or ())
    texts = [(name, read_text_or_input(name)) for name in files]
    messages = load_monitor_files(monitors or ()).messages
    chosen = _chosen(stream, has_monitors=bool(monitors))
    checked = check_chronicles(texts, chosen, messages)
    _print_findings(checked.findings, output)
    if cost and not checked.errors:
        _print_costs(with_relations(texts, checked.stream), rates_hz, keys)
    _print_summary(files, checked)
    if chosen is None and len(checked.empty) < len(texts):
        tell_stream(checked.stream, is_doubtful=bool(STREAM_CODES & {one.code for one in checked.findings}))
    if checked.errors:
        raise typer.Exit(exit_codes.INVALID)


def _chosen(stream: StreamChoice | None, *, has_monitors: bool) -> "Stream | None":
    """Say what texts are about: monitors speak of traffic. None leaves it to the texts."""
    if has_monitors and stream is StreamChoice.own:
        raise typer.BadParameter("expected traffic to go with --monitors, got own", param_hint="--stream")
    if has_monitors:
        return "traffic"
    return None if stream is None else stream.value


def read_rates(texts: "Sequence[str]") -> dict[str, float]:
    """Read `NAME=HZ` texts.

    Raises
    ------
    typer.BadParameter
        If a text is not of this form, or the rate is not a number above 0.

    Examples
    --------
    >>> read_rates(["behind=0.5", "honk=2"])
    {'behind': 0.5, 'honk': 2.0}
    """
    rates_hz: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            rates_hz[name] = float(number)
        except ValueError:
            rates_hz[name] = 0.0
        if not name or not 0 < rates_hz[name] < float("inf"):
            raise typer.BadParameter(f"expected NAME=HZ, such as behind=0.5, got {text!r}", param_hint="--rate")
    return rates_hz


def _print_code(code: str) -> None:
    from chronicles.language.codes import explain_code

    print(explain_code(code))


def _print_findings(found: "Sequence[Diagnostic]", output: CheckFormat) -> None:
    from chronicles.language.diagnostics import render_all
    from chronicles.language.rendering import render_github, render_json

    render = {CheckFormat.text: render_all, CheckFormat.json: render_json, CheckFormat.github: render_github}[output]
    if found or output is CheckFormat.json:
        print(render(found))


def _print_costs(texts: "Sequence[tuple[str, str]]", rates_hz: "Mapping[str, float]", keys: int) -> None:
    from chronicles.chronicle_set import load_texts
    from chronicles.compilation.cost import cost

    for plan in load_texts(texts).plans:
        print(cost(plan, rates_hz, keys=keys).render())


def _print_summary(files: "Sequence[str]", checked: "Checked") -> None:
    for name in checked.empty:
        print(f"warning: {name}: expected a chronicle, got none", file=sys.stderr)
    warnings = len(checked.findings) - checked.errors
    counts = counted(checked.errors, "error"), counted(warnings, "warning")
    print(f"{counted(len(files), 'file')}: {', '.join(counts)}", file=sys.stderr)
