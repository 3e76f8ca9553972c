"""`dyknow test`: do chronicles find in their examples what these say they find?"""

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import exit_codes
from service.cli.counted import counted
from service.cli.texts.stream_option import StreamOption, hinting_at_stream, tell_stream

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chronicles.examples import ExampleResult


def run_examples(
    files: Annotated[
        list[str] | None,
        typer.Argument(metavar="FILE...", help="Chronicle files; - reads standard input. Default: the library."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Name the examples that pass, too.")] = False,
    stream: StreamOption = None,
) -> None:
    """Run the examples in chronicle files; exit with 5 if one finds something else than it says."""
    from chronicles import examples, library
    from service.texts.chronicle_files import read_text_or_input, with_relations
    from service.texts.text_streams import stream_of

    own = [(name, read_text_or_input(name)) for name in files or ()]
    chosen = stream.value if stream else stream_of(own)
    texts = with_relations(own, chosen) if own else library.texts()
    with hinting_at_stream(is_open=bool(own) and stream is None):
        results = examples.run_examples(texts)
    failed = [one for one in results if not one.passed]
    if as_json:
        _print_json(results)
    else:
        for one in results if verbose else failed:
            print(examples.render(one))
    passed_count = len(results) - len(failed)
    print(f"{counted(len(results), 'example')}: {passed_count} passed, {len(failed)} failed", file=sys.stderr)
    if own and stream is None:
        tell_stream(chosen, is_doubtful=False)
    if failed:
        raise typer.Exit(exit_codes.BELOW_THRESHOLD)


def _print_json(results: "Sequence[ExampleResult]") -> None:
    import msgspec

    from service.cli.asking.recognise import occurrence_record

    records = [
        {
            "title": one.title,
            "file": one.file,
            "line": one.line,
            "passed": one.passed,
            "matched": [occurrence_record(found) for found in one.matched],
            "missing": [
                {
                    "chronicle": wanted.chronicle,
                    "roles": dict(wanted.roles),
                    "start_us": wanted.start_us,
                    "end_us": wanted.end_us,
                }
                for wanted in one.missing
            ],
            "unexpected": [occurrence_record(found) for found in one.unexpected],
        }
        for one in results
    ]
    print(msgspec.json.encode({"examples": records}).decode())
