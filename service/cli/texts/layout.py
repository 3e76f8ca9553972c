"""`dyknow format`: are chronicle files laid out in the one way?"""

import difflib
import sys
from pathlib import Path
from typing import Annotated

import typer

from service.cli import exit_codes


def format_files(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Chronicle files; - lays out standard input on standard output."),
    ],
    check: Annotated[bool, typer.Option("--check", help="Write nothing; exit with 5 if a file would change.")] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Write nothing; print what would change.")] = False,
) -> None:
    """Lay chronicle files out in the one way, comments kept; a file with a syntax error is left alone."""
    from chronicles.errors import ChronicleError
    from chronicles.language.formatter import format_text
    from service.errors import InputError
    from service.texts.chronicle_files import read_text_or_input, replace_text

    changed = broken = 0
    for name in files:
        try:
            text = read_text_or_input(name)
            laid_out = format_text(text, name)
        except (InputError, ChronicleError) as error:
            said = str(error)  # findings begin with their own `error[C0101]:`
            print(said if said.startswith("error[") else f"error: {said}", file=sys.stderr)
            broken += 1
            continue
        changed += laid_out != text
        if diff:
            _print_diff(name, text, laid_out)
        elif name == "-" and not check:
            sys.stdout.write(laid_out)
        elif laid_out != text and not check:
            replace_text(Path(name), laid_out)
        if check and laid_out != text:
            print(name, file=sys.stderr)
    _print_summary(changed, broken, len(files), is_written=not (check or diff))
    if broken:
        raise typer.Exit(exit_codes.INVALID)
    if check and changed:
        raise typer.Exit(exit_codes.BELOW_THRESHOLD)


def _print_diff(name: str, before: str, after: str) -> None:
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), name, name, lineterm="")
    for line in lines:
        print(line)


def _print_summary(changed: int, broken: int, count: int, *, is_written: bool) -> None:
    done = "laid out anew" if is_written else "would change"
    left = f", {broken} with errors left alone" if broken else ""
    print(f"{count} file{'' if count == 1 else 's'}: {changed} {done}{left}", file=sys.stderr)
