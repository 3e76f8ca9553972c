"""`dyknow worker` and `dyknow jobs`: who processes what was queued, and what has become of it?"""

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, LogName
from service.cli.printing import format_table, show
from service.errors import InputError
from service.runs.machine import Interrupts
from service.store.databases.location import database_of, shown

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from service.runs.requests import LiveRequest, RunRequest
    from service.store.entries import Job, JobKind
    from service.store.registers.jobs import Jobs

TITLES = ("job", "state", "attempts", "input", "message")
LiveSources = Annotated[
    int, typer.Option("--live", min=0, metavar="N", help="Watch so many live sources of the log, a process for each.")
]
JobName = Annotated[str, typer.Argument(metavar="JOB", help="Identifier, as `dyknow jobs list` shows it.")]


def worker(
    log: LogName,
    once: Annotated[bool, typer.Option("--once", help="Leave when nothing waits.")] = False,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Place the jobs on a Ray cluster: auto, HOST:PORT or ray://HOST:PORT."),
    ] = None,
    live: LiveSources = 0,
) -> None:
    """Process what `dyknow process --queue` added to a log, and wait for more until interrupted.

    Any number of workers may be at one log, on any machine that reaches it and the files. With --live they watch what
    `dyknow watch --queue` added, and nothing else; on a cluster all jobs have their place.
    """
    if live and (once or cluster is not None):
        raise typer.BadParameter("goes with neither --once nor --cluster", param_hint="--live")
    if cluster is not None:
        from service.runs.jobs.cluster import work_on_cluster

        work_on_cluster(log, cluster, stays=not once, tell=tell_line)
    elif live:
        watch_sources(log, live)
    else:
        from service.runs.jobs.worker import work

        work(log, stays=not once, tell=tell_line)


def watch_sources(log: str, most: int) -> None:
    """Watch so many live sources of a log at a time, each in a process that is looked after, until interrupted."""
    from contextlib import ExitStack

    from service.runs.jobs.worker import LOOK_EVERY_S, kept_working

    database = database_of(log)
    database.check_readable()  # a name that was mistyped makes no new log
    database.check_writable()
    with Interrupts() as interrupts, ExitStack() as processes:
        for _ in range(most):
            processes.enter_context(kept_working(log, "live", tell_line))
        while interrupts.came is None:
            time.sleep(LOOK_EVERY_S)
    raise KeyboardInterrupt


def tell_line(line: str) -> None:
    """Tell what a worker does, at once."""
    print(line, file=sys.stderr, flush=True)


def jobs_table(jobs: "Sequence[Job]") -> str:
    """Lay out jobs, each with the first line of its message."""
    rows = [[one.id, one.state, str(one.attempts), one.input, one.message.partition("\n")[0]] for one in jobs]
    return format_table(TITLES, rows)


def list_jobs(log: LogName, as_json: AsJson = False) -> None:
    """List what was queued for a log, in its order."""
    with _opened(log) as jobs:
        listed = jobs.listed()
    show({"items": listed}, jobs_table(listed), as_json=as_json)


def cancel(log: LogName, job: JobName, as_json: AsJson = False) -> None:
    """Do not begin a job that waits; stop one that runs, with what it has told kept."""
    with _opened(log) as jobs:
        found = jobs.cancel(job)
    show(found, f"job {found.id} is {'being stopped' if found.cancel_requested else found.state}", as_json=as_json)


def retry(log: LogName, job: JobName, as_json: AsJson = False) -> None:
    """Let a job wait again that failed or was cancelled."""
    with _opened(log) as jobs:
        found = jobs.retry(job)
    show(found, f"job {found.id} is {found.state}", as_json=as_json)


def _opened(log: str) -> "AbstractContextManager[Jobs]":
    from contextlib import closing

    from service.store.registers.jobs import Jobs

    database = database_of(log)
    database.check_readable()
    return closing(Jobs(database))


def added_jobs(requests: "Sequence[RunRequest | LiveRequest]", log: str, kind: "JobKind") -> "tuple[Jobs, list[Job]]":
    """Add requests of one kind to the jobs of a log, which is made if need be; close what is returned.

    Raises
    ------
    InputError
        If a file of one is missing; nothing has been added then.
    LogError
        If the log cannot be written.
    """
    from service.runs.requests import as_text, job_id
    from service.store.registers.jobs import Jobs

    database = database_of(log)
    database.check_writable()
    try:
        texts = {job_id(one): as_text(one) for one in requests}
    except OSError as error:
        raise InputError(f"{error.filename}: expected a file, got {error.strerror!r}") from error
    jobs = Jobs(database)
    return jobs, [jobs.add(*one, kind) for one in texts.items()]


def add_jobs(requests: "Sequence[RunRequest | LiveRequest]", log: str, kind: "JobKind", *, as_json: bool) -> None:
    """Add requests of one kind to the jobs of a log, and say which jobs they are."""
    jobs, added = added_jobs(requests, log, kind)
    jobs.close()
    lines = [f"job {one.id} is {one.state}: {one.input}" for one in added]
    lines.append(f"process them:   dyknow worker {shown(log)}{' --live 1' if kind == 'live' else ''}")
    show({"items": [{"id": one.id, "state": one.state} for one in added]}, "\n".join(lines), as_json=as_json)
