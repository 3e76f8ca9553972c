"""How does `dyknow` find its commands, and what does it print when one fails?

Each command is a function in a module of its own that imports what it needs when it is called, so that
`dyknow --help` loads no video, no database and no web server.
"""

import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

import typer

from service.cli import texts
from service.cli.asking import cars, evaluate, events, log, recognise, streams
from service.cli.making import demo, detector, generate, jobs, process, site, watch
from service.cli.operating import clients, doctor, serve
from service.cli.printing import BUSY, INTERNAL, INTERRUPTED, INVALID, OK, USAGE, tell
from service.cli.settings import show_config, take_settings
from service.errors import QueryError, RunBusyError
from service.runs.machine import look_seldom

# A new command: write its function in its own module and add it here with the arguments of an example; the order is
# that of `dyknow --help`. Two words are a command of a group; groups come last.
COMMANDS: Mapping[str, tuple[Callable[..., None], str]] = {
    "demo": (demo.demo, "--out out/demo --seconds 30"),
    "generate": (generate.generate, "rural_overtaking --out scene --seed 7 --seconds 60"),
    "trajectories": (generate.trajectories, "junction --out tracks/tracks.csv --gap 0.5:2 --seconds 60"),
    "process": (process.process, "scene/video.mp4 --site scene/site.toml --log scene.db"),
    "watch": (watch.watch, "rtsp://camera.example/1 --site site.toml --log road.db --recordings recordings"),
    "worker": (jobs.worker, "scene.db --once"),
    "events": (events.events, "scene.db --type overtake --from 00:10 --to 02:00"),
    "objects": (cars.objects, "scene.db car7"),
    "tracks": (cars.tracks, "scene.db --car car7 --from 10s"),
    "draw": (cars.draw, "scene/video.mp4 scene.db --out drawn.mp4 --from 10s --to 20s"),
    "clip": (cars.clip, "scene.db fb5840f804056320-1 --out overtake.mp4 --pad 3s"),
    "evaluate": (evaluate.evaluate, "scene.db scene --what detection,tracks,events"),
    "explain": (recognise.explain, "scene.db fb5840f804056320-1"),
    "why-not": (recognise.why_not, "scene.db overtake --role overtaker=car7 --limit 3"),
    "recognise": (recognise.recognise, "scene.db --chronicles mine.chronicle"),
    "monitor": (recognise.monitor, "scene.db rules.monitors"),
    "streams": (streams.streams, "scene.db"),
    "check": (texts.check, "mine.chronicle --cost"),
    "format": (texts.format_files, "mine.chronicle --check"),
    "test": (texts.run_examples, "mine.chronicle --verbose"),
    "serve": (serve.serve, "scene.db --port 8420"),
    "doctor": (doctor.doctor, "scene.db"),
    "token make": (clients.make, "scene.db office --scope read --expires 90d"),
    "token list": (clients.list_all, "scene.db"),
    "token revoke": (clients.revoke, "scene.db office"),
    "config show": (show_config, "serve --origin"),
    "jobs list": (jobs.list_jobs, "scene.db"),
    "jobs cancel": (jobs.cancel, "scene.db 6b1e64c1a2d0f3b7"),
    "jobs retry": (jobs.retry, "scene.db 6b1e64c1a2d0f3b7"),
    "webhooks list": (clients.list_webhooks, "scene.db"),
    "webhooks retry": (clients.retry_webhook, "scene.db office"),
    "log info": (log.info, "scene.db"),
    "log verify": (log.verify, "scene.db"),
    "log backup": (log.backup, "scene.db backup/scene.db"),
    "log restore": (log.restore, "backup/scene.db scene.db"),
    "log audit": (log.audit, "scene.db --limit 20"),
    "log prune": (log.prune, "scene.db --keep seen_objects=1d --keep car_states=7d --dry-run"),
    "site new": (site.new, "clip.mp4 --points points.csv --lanes lanes.csv"),
    "site check": (site.check, "site.toml --clip clip.mp4 --out check.png"),
    "detector add": (detector.add, "traffic.onnx"),
    "detector list": (detector.list_installed, ""),
    "detector try": (detector.try_on_clip, "clip.mp4 --detector onnx:traffic --at 4s --out boxes.png"),
}

GROUPS = {
    "config": "See what options are where the command line does not give them.",
    "token": "Say who may ask a log over HTTP, and what each may do.",
    "jobs": "See what was queued for a log, and end or repeat it.",
    "webhooks": "See how far the webhooks of a log are, and let what they gave up be tried again.",
    "log": "See what a log holds, who wrote over HTTP, whether all can be read, copy it, and remove what is old.",
    "site": "Make a site file for a camera, and look at how good it is.",
    "detector": "Install a network that finds vehicles, and look at what it finds.",
}

PACKAGES = ("service", "gis", "vision", "anchoring", "qsr", "chronicles", "dyknow", "data_gen")
# An error whose class comes from one of these says something about the user's input.
INPUT_ERROR_MODULES = frozenset(f"{package}.errors" for package in PACKAGES)


def main() -> None:
    """Run the command line of this process and leave with its exit code."""
    look_seldom()
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="surrogateescape")  # a file name that is no text is printed as its bytes
    if foreign := foreign_package():
        fix = "install dyknow anew, into an environment of its own (python -m venv)"
        tell("error", [f"{foreign}, so another program's package has the same name; {fix}"])
        sys.exit(INVALID)
    sys.exit(run(sys.argv[1:]))


def foreign_package() -> str:
    """Say which of our packages Python would not take from the folder that this file is in; empty if it takes all.

    Another distribution may have a package of the same name; installed over ours, its removal deletes our file.
    """
    parent = Path(__file__).parents[2]
    for name in PACKAGES:
        spec = find_spec(name)
        came = spec.origin if spec else None
        if came is None or Path(came).parents[1] != parent:
            return f"package {name!r}: expected {str(parent / name / '__init__.py')!r}, got {came!r}"
    ours = sys.modules["service"]
    if "open_log" not in getattr(ours, "__all__", ()):
        return f"package 'service': expected our names in {ours.__file__!r}, got others"
    return ""


def run(arguments: Sequence[str]) -> int:
    """Run one command line; errors go to stderr as `error: ...`, never as a traceback.

    Returns
    -------
    The exit code; see `service.cli.printing`.
    """
    code = _run(arguments)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader has seen enough. The interpreter flushes once more when it ends, which must go somewhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


def _run(arguments: Sequence[str]) -> int:
    try:
        make_app()(list(arguments), prog_name="dyknow")
    except SystemExit as leaving:
        if isinstance(leaving.__context__, BrokenPipeError):
            return OK  # typer leaves with 1 here, which is our own fault's code
        return leaving.code if isinstance(leaving.code, int) else OK
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        return report(error)
    return OK


def make_app() -> typer.Typer:
    """Put the commands together."""
    app = typer.Typer(
        name="dyknow",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # plain help: it pipes well, and loads in half the time
    )
    app.callback(invoke_without_command=True)(_program)
    groups = {"": app}
    for name, (command, example) in COMMANDS.items():
        group, _, word = name.rpartition(" ")
        if group not in groups:
            groups[group] = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help=GROUPS[group])
            app.add_typer(groups[group], name=group)
        groups[group].command(word, epilog=f"Example: dyknow {name} {example}".rstrip())(command)
    return app


def report(error: Exception) -> int:
    """Print an error for the user; return the exit code."""
    if "DYKNOW_TRACEBACK" in os.environ:
        traceback.print_exception(error)
    if isinstance(error, OSError) and error.filename is not None:
        tell("error", [f"{error.filename}: expected a path that can be used, got {error.strerror!r}"])
        return INVALID
    if not {kind.__module__ for kind in type(error).__mro__} & INPUT_ERROR_MODULES:
        came = f"{type(error).__name__}: {error}"
        tell("error", [f"dyknow: expected to finish, got {came!r} (DYKNOW_TRACEBACK=1 shows where)"])
        return INTERNAL
    tell("error", [str(error)])
    return USAGE if isinstance(error, QueryError) else BUSY if isinstance(error, RunBusyError) else INVALID


def _program(
    context: typer.Context,
    config: Annotated[Path | None, typer.Option(envvar="DYKNOW_CONFIG", help="Settings (else: dyknow.toml).")] = None,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Recognise what happens between vehicles in traffic video, and ask for it."""
    if version:
        from service.records.runs import software_version

        print(software_version())
        raise typer.Exit
    take_settings(context)


if __name__ == "__main__":
    main()
