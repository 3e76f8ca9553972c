"""`dyknow check`, `format` and `test`: is anything wrong in chronicle files, in their layout, or in their examples?"""

import difflib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli import options
from service.cli.printing import BELOW_THRESHOLD, INVALID, counted, print_json, show, tell
from service.errors import InputError

if TYPE_CHECKING:
    from chronicles.examples import ExampleResult
    from dyknow.language.diagnostics import Diagnostic
    from service.texts.chronicle_files import Checked
    from service.texts.text_streams import Stream


LINKAGE_SUFFIX = ".linkage"
CheckFormat = Literal["text", "json", "github"]


def check(
    files: options.Texts = None,
    output: Annotated[
        CheckFormat, typer.Option("--format", help="text, json, or github (annotations of a pull request).")
    ] = "text",
    cost: Annotated[bool, typer.Option("--cost", help="Also bound how many instances can wait at once.")] = False,
    rates: Annotated[
        list[str] | None,
        typer.Option("--rate", metavar="NAME=HZ", help="For --cost: most events a second of a name; else 1."),
    ] = None,
    keys: Annotated[
        int, typer.Option(min=1, help="For --cost: how many values an argument can have; rates are per value.")
    ] = 1,
    explain: Annotated[str | None, typer.Option(metavar="CODE", help="Say what a code such as C0201 means.")] = None,
    stream: options.StreamOption = None,
    monitors: Annotated[
        list[Path] | None,
        typer.Option(help="File of monitors that run with the chronicles; repeat for several."),
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Check chronicle files, taken together as `process` takes them, and linkage files; exit with 3 on an error."""
    if explain is not None:
        from chronicles.language.codes import explain_code

        said = explain_code(explain)
        show({"code": explain, "text": said}, said, as_json=as_json)
        return
    if not files:
        raise typer.BadParameter("expected at least one chronicle file, got none", param_hint="FILE")
    if rates and not cost:
        raise typer.BadParameter("expected --cost to go with it, got no --cost", param_hint="--rate")
    import msgspec

    from dyknow.language.diagnostics import TextError
    from dyknow.language.rendering import render_json
    from service.texts.chronicle_files import read_text_or_input, with_relations

    rates_hz = read_rates(rates or ())
    every = [(name, read_text_or_input(name)) for name in files]
    linkages = [one for one in every if one[0].endswith(LINKAGE_SUFFIX)]
    texts = [one for one in every if one not in linkages]
    if monitors and stream == "own":
        raise typer.BadParameter("expected traffic to go with --monitors, got own", param_hint="--stream")
    chosen: Stream | None = "traffic" if monitors else stream
    try:
        checked = _checked(texts, chosen, monitors or ())
    except TextError as error:
        if output == "text" and not as_json:
            raise  # told where all refused files are told
        _print_findings(error.diagnostics, "json" if as_json else output)
        raise typer.Exit(INVALID) from None
    if linkages:
        from service.texts.linkage_files import check_linkages  # loads what anchors

        checked = replace(checked, findings=(*checked.findings, *check_linkages(linkages)))
    costs = _costs(with_relations(texts, checked.stream), rates_hz, keys) if cost and not checked.errors else []
    if as_json:
        findings = msgspec.Raw(render_json(checked.findings).encode())
        print_json({"stream": checked.stream, "findings": findings, "costs": costs})
    else:
        _print_findings(checked.findings, output)
        print(*costs, sep="\n", end="\n" if costs else "")
    _print_check_summary(files, checked)
    if chosen is None and len(checked.empty) < len(texts):
        options.tell_stream(
            checked.stream, is_doubtful=bool(options.STREAM_CODES & {one.code for one in checked.findings})
        )
    if checked.errors:
        raise typer.Exit(INVALID)


def _checked(texts: "Sequence[tuple[str, str]]", stream: "Stream | None", monitors: "Sequence[Path]") -> "Checked":
    """Check chronicles with the monitors that run with them; raises a `TextError` for those."""
    from chronicles.chronicle_set import load_texts
    from service.texts.chronicle_files import check_chronicles, with_relations
    from service.texts.monitor_files import load_monitor_files

    draft = load_monitor_files(monitors, None)
    checked = check_chronicles(texts, stream, draft.messages)
    if monitors and not checked.errors:
        chronicles = load_texts(with_relations(texts, "traffic", draft.events))
        load_monitor_files(monitors, chronicles.given).check_names(chronicles)
    return checked


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
    expected = "NAME=HZ, such as behind=0.5"
    rates_hz: dict[str, float] = {}
    for name, number in options.read_pairs(texts, "--rate", expected):
        try:
            rates_hz[name] = float(number)
        except ValueError:
            rates_hz[name] = 0.0
        if not 0 < rates_hz[name] < float("inf"):
            raise typer.BadParameter(f"expected {expected}, got {f'{name}={number}'!r}", param_hint="--rate")
    return rates_hz


def _print_findings(found: "Sequence[Diagnostic]", output: CheckFormat) -> None:
    from dyknow.language.diagnostics import render_all
    from dyknow.language.rendering import render_github, render_json

    render = {"text": render_all, "json": render_json, "github": render_github}[output]
    if found or output == "json":
        print(render(found))


def _costs(texts: "Sequence[tuple[str, str]]", rates_hz: "Mapping[str, float]", keys: int) -> list[str]:
    from chronicles.chronicle_set import load_texts
    from chronicles.compilation.cost import cost

    return [cost(plan, rates_hz, keys=keys).render() for plan in load_texts(texts).plans]


def _print_check_summary(files: "Sequence[str]", checked: "Checked") -> None:
    tell("warning", (f"{name}: expected a chronicle, got none" for name in checked.empty))
    warnings = len(checked.findings) - checked.errors
    counts = counted(checked.errors, "error"), counted(warnings, "warning")
    print(f"{counted(len(files), 'file')}: {', '.join(counts)}", file=sys.stderr)


def format_files(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Chronicle files; - lays out standard input on standard output."),
    ],
    check: Annotated[bool, typer.Option("--check", help="Write nothing; exit with 5 if a file would change.")] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Write nothing; print what would change.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Lay chronicle files out in the one way, comments kept; a file with a syntax error is left alone."""
    from chronicles.errors import ChronicleError
    from chronicles.language.formatter import format_text
    from service.texts.chronicle_files import read_text_or_input, replace_text

    if as_json and (diff or "-" in files):
        raise typer.BadParameter("expected files and no --diff beside it: both print a text", param_hint="--json")
    changed: list[str] = []
    broken: list[str] = []
    for name in files:
        try:
            text = read_text_or_input(name)
            laid_out = format_text(text, name)
        except (InputError, ChronicleError) as error:
            tell("error", [str(error)])
            broken.append(name)
            continue
        if laid_out != text:
            changed.append(name)
        if diff:
            lines = difflib.unified_diff(text.splitlines(), laid_out.splitlines(), name, name, lineterm="")
            print("".join(f"{line}\n" for line in lines), end="")
        elif name == "-" and not check:
            sys.stdout.write(laid_out)
        elif laid_out != text and not check:
            replace_text(Path(name), laid_out)
        if check and laid_out != text:
            print(name, file=sys.stderr)
    if as_json:
        print_json({"changed": changed, "broken": broken, "is_written": not check})
    done = "would change" if check or diff else "laid out anew"
    left = f", {len(broken)} with errors left alone" if broken else ""
    print(f"{counted(len(files), 'file')}: {len(changed)} {done}{left}", file=sys.stderr)
    if broken:
        raise typer.Exit(INVALID)
    if check and changed:
        raise typer.Exit(BELOW_THRESHOLD)


def run_examples(
    files: Annotated[
        list[str] | None,
        typer.Argument(metavar="FILE...", help="Chronicle files; - reads standard input. Default: the library."),
    ] = None,
    as_json: options.AsJson = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Name the examples that pass, too.")] = False,
    stream: options.StreamOption = None,
) -> None:
    """Run the examples in chronicle files; exit with 5 if one finds something else than it says."""
    from chronicles import examples, library
    from service.texts.chronicle_files import read_text_or_input, with_relations
    from service.texts.text_streams import stream_of

    own = [(name, read_text_or_input(name)) for name in files or ()]
    chosen = stream or stream_of(own)
    texts = with_relations(own, chosen) if own else library.texts()
    with options.hinting_at_stream(is_open=bool(own) and stream is None):
        results = examples.run_examples(texts)
    failed = [one for one in results if not one.passed]
    if as_json:
        print_json({"examples": [_example_record(one) for one in results]})
    else:
        for one in results if verbose else failed:
            print(examples.render(one))
    passed_count = len(results) - len(failed)
    print(f"{counted(len(results), 'example')}: {passed_count} passed, {len(failed)} failed", file=sys.stderr)
    if own and stream is None:
        options.tell_stream(chosen, is_doubtful=False)
    if failed:
        raise typer.Exit(BELOW_THRESHOLD)


def _example_record(one: "ExampleResult") -> dict[str, object]:
    from service.cli.asking.recognise import occurrence_record

    return {
        "title": one.title,
        "file": one.file,
        "line": one.line,
        "passed": one.passed,
        "matched": [occurrence_record(found) for found in one.matched],
        "missing": [
            {"chronicle": it.chronicle, "roles": dict(it.roles), "start_us": it.start_us, "end_us": it.end_us}
            for it in one.missing
        ],
        "unexpected": [occurrence_record(found) for found in one.unexpected],
    }
