"""How are many inputs processed at once? Each by the same command in a process of its own, into a log of its own."""

import glob
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer

from service.cli.printing import OK, SIGNALLED, format_table, print_json, tell

VIDEO_SUFFIXES = {
    ".3gp", ".asf", ".avi", ".flv", ".m2ts", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".mts", ".mxf", ".ogv",
    ".ts", ".webm", ".wmv",
}  # fmt: skip
COMMAND = (sys.executable, "-c", "from service.cli.app import main; main()", "process")
LOOK_EVERY_S = 0.2


@dataclass(slots=True)
class Job:
    """One input on its way.

    Attributes
    ----------
    input, log : what is processed, and into which log.
    told : the newest record of the command (`--json`), of its progress or its end; empty before the first.
    messages : what else it said.
    code : with which it ended; None as long as it has not.
    """

    input: Path
    log: Path
    told: dict[str, Any] = field(default_factory=dict)  # Any: JSON
    messages: list[str] = field(default_factory=list)
    code: int | None = None
    child: "subprocess.Popen[str] | None" = None

    @property
    def status(self) -> str:
        """Say in a word how far it has come."""
        if self.code is None:
            return "waits" if self.child is None else "runs"
        return "failed" if self.told.get("type") != "summary" else str(self.told["status"])


def expanded(names: Sequence[Path]) -> list[Path]:
    """Take the videos in folders and the files that patterns fit; other names stay.

    Raises
    ------
    typer.BadParameter
        If a folder holds no video, or a pattern fits nothing.
    """
    found: list[Path] = []
    for name in names:
        if name.is_dir():
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


def repeated_options(context: typer.Context, *without: str) -> list[str]:
    """Write the options that a command was given once more, but for some."""
    words: list[str] = []
    for one in context.command.params:
        value = context.params.get(one.name or "")
        if one.param_type_name != "option" or one.name in without or value in (None, False):
            continue
        for part in value if isinstance(value, list | tuple) else (value,):
            words += [one.opts[0]] if part is True else [one.opts[0], str(part)]
    return words


def jobs_of(inputs: Sequence[Path], folder: Path) -> list[Job]:
    """Give each input a log in the folder.

    Raises
    ------
    typer.BadParameter
        If two would have the same log.
    """
    jobs = [Job(one, folder / f"{one.stem}.db") for one in inputs]
    first: dict[Path, Path] = {}
    for job in jobs:
        if (other := first.setdefault(job.log, job.input)) != job.input:
            raise typer.BadParameter(f"--logs: expected inputs of different names, got {other} and {job.input}")
    return jobs


def process_many(jobs: Sequence[Job], options: Sequence[str], *, site: Path | None, at_once: int, as_json: bool) -> int:
    """Run all jobs, so many at once; one that fails does not stop the others.

    Returns
    -------
    The worst exit code.
    """
    from service.runs.machine import Interrupts

    jobs[0].log.parent.mkdir(parents=True, exist_ok=True)
    with Interrupts() as interrupts, _shown(jobs, as_json=as_json) as show, ThreadPoolExecutor(at_once) as pool:
        todo = {pool.submit(_run, job, [*COMMAND, *_arguments(job, options, site)]) for job in jobs}
        while todo:
            done, todo = wait(todo, timeout=LOOK_EVERY_S, return_when=FIRST_COMPLETED)
            for one in done:
                one.result()  # raises what kept the command from being run at all
            show()
            if interrupts.came:  # those that run end in the ordinary way, with what they have
                pool.shutdown(wait=False, cancel_futures=True)
                for job in jobs:
                    if job.child is not None and job.code is None:
                        job.child.terminate()
                todo = {one for one in todo if not one.cancelled()}
    _print_summary(jobs, as_json=as_json)
    return SIGNALLED + interrupts.came if interrupts.came else max(job.code or OK for job in jobs)


def _arguments(job: Job, options: Sequence[str], site: Path | None) -> list[str]:
    site = site or site_beside(job.input)
    known = () if site is None else ("--site", str(site))
    return [*options, *known, "--log", str(job.log), "--json", "--", str(job.input)]


def _run(job: Job, command: Sequence[str]) -> None:
    import msgspec

    # Messages come between the records: whatever is no record is one.
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    ) as job.child:
        assert job.child.stdout is not None
        for line in job.child.stdout:
            if line.startswith("{"):
                job.told = msgspec.json.decode(line)
            else:
                job.messages.append(line.rstrip())
    code = job.child.returncode
    job.code = code if code >= 0 else SIGNALLED - code


@contextmanager
def _shown(jobs: Sequence[Job], *, as_json: bool) -> Iterator[Callable[[], None]]:
    """Tell how far all jobs are: bars on a terminal, elsewhere a line for each that has ended."""
    told: set[Path] = set()

    def tell_ended() -> None:
        """Tell of those that have ended since the last time."""
        for job in jobs:
            if job.code is None or job.input in told:
                continue
            told.add(job.input)
            if as_json:
                print_json({"type": "job", **_record(job)})
            else:
                print(f"{job.input} ({len(told)} of {len(jobs)}): {job.status}", file=sys.stderr, flush=True)

    if as_json or not sys.stderr.isatty():
        yield tell_ended
        tell_ended()
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} % {task.fields[status]}"),
    )
    with RichProgress(*columns, console=Console(stderr=True)) as bars:
        tasks = [bars.add_task(job.input.name, total=None, status=job.status) for job in jobs]

        def show() -> None:
            """Move all bars."""
            for task, job in zip(tasks, jobs, strict=True):
                done, total = job.told.get("frames", 0), job.told.get("frame_count")
                bars.update(task, completed=done, total=done if job.code is not None else total, status=job.status)

        yield show
        show()


def _record(job: Job) -> dict[str, object]:
    facts = {name: value for name, value in job.told.items() if name not in ("type", "status")}
    return {
        "input": str(job.input),
        "log": str(job.log),
        "status": job.status,
        "code": job.code,
        "messages": job.messages,
        **facts,
    }


def _print_summary(jobs: Sequence[Job], *, as_json: bool) -> None:
    finished = sum(job.status == "finished" for job in jobs)
    if as_json:
        print_json({"type": "summary", "inputs": len(jobs), "finished": finished})
        return
    rows = []
    for job in jobs:
        counts = [job.told.get(name) for name in ("frames", "cars", "events", "real_time_factor")]
        rows.append([str(job.input), job.status, *("" if one is None else str(one) for one in counts), str(job.log)])
    print(format_table(["input", "status", "frames", "cars", "events", "x real time", "log"], rows), end="")
    for job in jobs:
        tell(f"{job.input}", (*job.told.get("warnings", ()), *job.messages))
    print(f"{finished} of {len(jobs)} finished")
