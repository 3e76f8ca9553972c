"""`dyknow check`: is anything wrong in these chronicle files?"""

import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import exit_codes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chronicles.language.diagnostics import Diagnostic


class CheckFormat(StrEnum):
    """How to print diagnostics."""

    text = "text"
    json = "json"


def check(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Chronicle files; - reads standard input.")],
    output: Annotated[CheckFormat, typer.Option("--format", help="text or json.")] = CheckFormat.text,
) -> None:
    """Check chronicle files, taken together as `process` takes them; exit with 3 if one has an error."""
    from chronicles.chronicle_set import check_texts
    from service.chronicle_files import with_relations

    found = check_texts(with_relations([(name, _read(name)) for name in files]))
    errors = sum(one.severity == "error" for one in found)
    if output is CheckFormat.json:
        _print_json(found)
    else:
        _print_text(found)
    plural = "" if len(files) == 1 else "s"
    print(f"{len(files)} file{plural}: {errors} errors, {len(found) - errors} warnings", file=sys.stderr)
    if errors:
        raise typer.Exit(exit_codes.INVALID)


def _read(name: str) -> str:
    from pathlib import Path

    from service.chronicle_files import read_text

    return sys.stdin.read() if name == "-" else read_text(Path(name))


def _print_text(found: "Sequence[Diagnostic]") -> None:
    from chronicles.language.diagnostics import render_all

    if found:
        print(render_all(found))


def _print_json(found: "Sequence[Diagnostic]") -> None:
    import msgspec

    print(msgspec.json.encode({"diagnostics": found}).decode())
