"""How are many inputs processed at once? As jobs of one log, by workers that stay as long as the command does."""

import glob
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from service.cli.making.jobs import added_jobs, jobs_table
from service.cli.printing import INVALID, OK, SIGNALLED, print_json, tell
from service.errors import QueryError
from service.runs.machine import Interrupts, cores

if TYPE_CHECKING:
    from service.runs.requests import RunRequest
    from service.store.entries import Job

VIDEO_SUFFIXES = {
    ".3gp", ".asf", ".avi", ".flv", ".m2ts", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".mxf", ".ogv",
    ".ts", ".webm", ".wmv",
}  # fmt: skip
QUEUE = "jobs.db"
"""Of logs in a folder: has the jobs of all, and is the log of an input of that name too."""
LOOK_EVERY_S = 0.2


def expanded(names: Sequence[Path]) -> list[Path]:
    """Take the videos in folders and the files that patterns fit; other names stay.

    Raises
    ------
    typer.BadParameter
        If a folder holds no video, or a pattern fits nothing.
    """
    from vision.video.recording import is_recording

    found: list[Path] = []
    for name in names:
        if name.is_dir() and not is_recording(name):
            here = sorted(one for one in name.iterdir() if one.suffix.lower() in VIDEO_SUFFIXES)
        elif not name.exists() and glob.has_magic(str(name)):
            here = sorted(map(Path, glob.glob(str(name), recursive=True)))
        else:
            here = [name]
        if not here:
            what = "videos in the folder" if name.is_dir() else "files that the pattern fits"
            raise typer.BadParameter(f"{name}: expected {what}, got none")
        found += [one for one in here if one not in found]
    return found


def site_beside(path: Path) -> Path | None:
    """Find the site file of an input: of its own name, or that of its folder; None if there is neither."""
    own, common = path.with_suffix(".toml"), path.parent / "site.toml"
    return own if own.exists() else common if common.exists() else None


def logs_of(inputs: Sequence[Path], folder: Path) -> list[str]:
    """Name a log in the folder for each input.

    Raises
    ------
    typer.BadParameter
        If two would have the same.
    """
    first: dict[Path, Path] = {}
    for one in inputs:
        if (other := first.setdefault((folder / f"{one.stem}.db").absolute(), one)) != one:
            raise typer.BadParameter(f"--logs: expected inputs of different names, got {other} and {one}")
    return list(map(str, first))


def process_many(requests: "Sequence[RunRequest]", log: str, *, at_once: int, as_json: bool) -> int:
    """Have all requests processed by so many workers; one that fails does not stop the others.

    Parameters
    ----------
    log : whose jobs they become. What is killed leaves them there for any worker, and the same again goes on with them.

    Returns
    -------
    The exit code.
    """
    from service.runs.jobs.worker import kept_working

    jobs, added = added_jobs(requests, log, "run")
    with closing(jobs), Interrupts() as interrupts, ExitStack() as working:
        todo = {one.id for one in added}
        names = frozenset(todo)
        for name in names:
            jobs.repeat(name)
        for _ in range(at_once):
            working.enter_context(kept_working(log, "run", _say_nothing, has_free_cores=at_once < cores()))
        show = working.enter_context(_shown(len(names), as_json=as_json))
        while True:
            now = [one for one in jobs.listed() if one.id in names]
            ended = [one for one in now if one.has_ended and one.id in todo]
            todo -= {one.id for one in ended}
            show(now, ended)
            if not todo:
                break
            if interrupts.came:  # what runs ends in the ordinary way, with what it has
                for name in todo:
                    with suppress(QueryError):  # it has ended meanwhile
                        jobs.cancel(name)
            time.sleep(LOOK_EVERY_S)
    finished = sum(one.state == "finished" for one in now)
    if as_json:
        print_json({"type": "summary", "inputs": len(now), "finished": finished})
    else:
        print(jobs_table(now), end="")
        for one in now:
            tell(one.input, one.message.splitlines()[1:])
        print(f"{finished} of {len(now)} finished")
    return SIGNALLED + interrupts.came if interrupts.came else OK if finished == len(now) else INVALID


def _say_nothing(line: str) -> None:
    """Take what a worker tells: the rows of the jobs say it too."""


@contextmanager
def _shown(count: int, *, as_json: bool) -> "Iterator[Callable[[Sequence[Job], Sequence[Job]], None]]":
    """Give what shows all jobs as they are now, and tells of those that have ended since the last time."""
    shown = 0

    def tell_ended(_: "Sequence[Job]", ended: "Sequence[Job]") -> None:
        nonlocal shown
        for one in ended:
            shown += 1
            if as_json:
                facts = ("id", "input", "state", "attempts", "run", "message")
                print_json({"type": "job", **{name: getattr(one, name) for name in facts}})
            else:
                print(f"{one.input} ({shown} of {count}): {one.state}", file=sys.stderr, flush=True)

    if as_json or not sys.stderr.isatty():
        yield tell_ended
        return
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    with Live(console=Console(stderr=True), transient=True) as live:

        def show(now: "Sequence[Job]", _: "Sequence[Job]") -> None:
            left = [one for one in now if not one.has_ended]
            running = jobs_table([one for one in left if one.state == "running"])
            live.update(Text(f"{running}{count - len(left)} of {count} have ended"))

        yield show
