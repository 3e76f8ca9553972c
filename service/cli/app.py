"""How does `dyknow` find its commands, and what does it print when one fails?

Each command is a function in a module of its own that imports what it needs when it is called, so that
`dyknow --help` loads no video, no database and no web server.
"""

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from service.cli import exit_codes
from service.cli.check import check
from service.cli.demo import demo
from service.cli.draw import draw
from service.cli.evaluate import evaluate
from service.cli.events import events
from service.cli.generate import generate
from service.cli.process import process
from service.cli.serve import serve
from service.cli.tracks import tracks
from service.errors import QueryError

# A new command: write its function in its own module and add it here; the order is that of `dyknow --help`.
COMMANDS: tuple[Callable[..., None], ...] = (
    demo,
    generate,
    process,
    events,
    tracks,
    draw,
    evaluate,
    check,
    serve,
)

# An error whose class comes from one of these says something about the user's input.
INPUT_ERROR_MODULES = frozenset(
    f"{package}.errors"
    for package in ("service", "gis", "vision", "anchoring", "qsr", "chronicles", "dyknow", "data_gen")
)


def main() -> None:
    """Run the command line of this process and leave with its exit code."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Run one command line; errors go to stderr as `error: ...`, never as a traceback.

    Returns
    -------
    The exit code; see `service.cli.exit_codes`.
    """
    try:
        make_app()(list(arguments), prog_name="dyknow")
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else exit_codes.OK
    except KeyboardInterrupt:
        return exit_codes.INTERRUPTED
    except Exception as error:
        return report(error)
    return exit_codes.OK


def make_app() -> typer.Typer:
    """Put the commands together."""
    app = typer.Typer(
        name="dyknow",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # plain help: it pipes well, and loads in half the time
    )
    app.callback(invoke_without_command=True)(_program)
    for command in COMMANDS:
        app.command()(command)
    return app


def report(error: Exception) -> int:
    """Print an error for the user; return the exit code."""
    if "DYKNOW_TRACEBACK" in os.environ:
        traceback.print_exception(error)
    if isinstance(error, QueryError):
        print(f"error: {error}", file=sys.stderr)
        return exit_codes.USAGE
    if isinstance(error, OSError) and error.filename is not None:
        print(f"error: {error.filename}: expected a path that can be used, got {error.strerror!r}", file=sys.stderr)
        return exit_codes.INVALID
    if not {kind.__module__ for kind in type(error).__mro__} & INPUT_ERROR_MODULES:
        came = f"{type(error).__name__}: {error}"
        print(f"error: dyknow: expected to finish, got {came!r} (DYKNOW_TRACEBACK=1 shows where)", file=sys.stderr)
        return exit_codes.INTERNAL
    text = str(error)
    # The diagnostics of a chronicle text begin with their own `error[C0201]:`.
    print(text if text.startswith("error[") else f"error: {text}", file=sys.stderr)
    return exit_codes.INVALID


def _program(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Recognise what happens between vehicles in traffic video, and ask for it."""
    if version:
        from importlib.metadata import PackageNotFoundError
        from importlib.metadata import version as version_of

        try:
            print(version_of("dyknow"))
        except PackageNotFoundError:
            print("0")
        raise typer.Exit
