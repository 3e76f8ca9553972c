"""`dyknow worker` and `dyknow jobs`: who processes what was queued, and what has become of it?"""

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, LogName
from service.cli.printing import format_table, show

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager

    from service.runs.requests import RunRequest
    from service.store.registers.jobs import Jobs

TITLES = ("job", "state", "attempts", "input", "message")
JobName = Annotated[str, typer.Argument(metavar="JOB", help="Identifier, as `dyknow jobs list` shows it.")]


def worker(
    log: LogName,
    once: Annotated[bool, typer.Option("--once", help="Leave when nothing waits.")] = False,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Place the jobs on a Ray cluster: auto, HOST:PORT or ray://HOST:PORT."),
    ] = None,
) -> None:
    """Process what `dyknow process --queue` added to a log, and wait for more until interrupted.

    Any number of workers may be at one log, on any machine that reaches it and the files.
    """
    if cluster is None:
        from service.runs.jobs.worker import work

        work(log, stays=not once, tell=tell_line)
    else:
        from service.runs.jobs.cluster import work_on_cluster

        work_on_cluster(log, cluster, stays=not once, tell=tell_line)


def tell_line(line: str) -> None:
    """Tell what a worker does, at once."""
    print(line, file=sys.stderr, flush=True)


def list_jobs(log: LogName, as_json: AsJson = False) -> None:
    """List what was queued for a log, in its order."""
    from service.runs.requests import read_request

    with _opened(log) as jobs:
        listed = jobs.listed()
    rows = [
        [
            one.id,
            one.state,
            str(one.attempts),
            str(read_request(one.request, log).input),
            one.message.partition("\n")[0],
        ]
        for one in listed
    ]
    show({"items": listed}, format_table(TITLES, rows), as_json=as_json)


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

    from service.store.databases.location import database_of
    from service.store.registers.jobs import Jobs

    database = database_of(log)
    database.check_readable()
    return closing(Jobs(database))


def add_jobs(requests: "Sequence[RunRequest]", log: str, *, as_json: bool) -> None:
    """Add requests to the jobs of a log, and say which jobs they are."""
    from service.errors import InputError
    from service.runs.requests import as_text, job_id
    from service.store.databases.location import database_of, shown
    from service.store.registers.jobs import Jobs

    database = database_of(log)
    database.check_writable()
    try:
        texts = {job_id(one): as_text(one) for one in requests}
    except OSError as error:
        raise InputError(f"{error.filename}: expected a file, got {error.strerror!r}") from error
    jobs = Jobs(database)
    added = [jobs.add(*one) for one in texts.items()]
    jobs.close()
    lines = [f"job {one.id} is {one.state}: {request.input}" for one, request in zip(added, requests, strict=True)]
    lines.append(f"process them:   dyknow worker {shown(log)}")
    show({"items": [{"id": one.id, "state": one.state} for one in added]}, "\n".join(lines), as_json=as_json)
