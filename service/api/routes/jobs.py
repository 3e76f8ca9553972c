"""What is to be processed, and what has become of it? Routes about jobs, and the one that begins a run."""

import json
import math
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, HTTPException, Request
from fastapi import Path as PathPart
from starlette.responses import Response

from service.api.bodies import JobList, JobStatus, RunOrder
from service.api.openapi import answers, takes
from service.api.routes.answering import json_answer, read_json, refuse_parameters
from service.api.source_files import SourceFolders
from service.errors import InputError, NotInLogError, QueryError
from service.records import SourceText
from service.runs.requests import RunRequest, as_text, job_id
from service.store.chronicle_texts import ChronicleTexts
from service.store.databases.location import database_of
from service.store.jobs import Job, Jobs
from service.store.log import EventLog
from service.store.sources import Sources
from service.times import parse_utc_us

JobName = Annotated[str, PathPart(pattern="^[0-9a-f]{16}$")]
_JOB = "/api/v1/jobs/{job}"


def add_jobs(router: APIRouter, log: EventLog, folders: SourceFolders) -> None:
    """Add the routes about jobs.

    Parameters
    ----------
    folders : where sources and site files may lie.
    """
    url = log.place.url

    @router.post(
        "/api/v1/runs",
        name="runs",
        summary="Begin a run",
        description="Adds a job, which a worker processes. The same request is the same job, whenever it comes.",
        status_code=202,
        responses=answers(JobStatus, 404, 409, 413, 422, status=202),
        openapi_extra=takes(RunOrder),
    )
    async def begin_run(request: Request) -> Response:
        """Add a source to the jobs of the log."""
        refuse_parameters(request)
        order = await read_json(request, RunOrder)

        def add() -> Job:
            wanted = _request(order, url, folders)
            try:
                name = job_id(wanted)
            except OSError as error:
                raise InputError(f"{order.source}: expected its files, got {error.strerror}") from error
            with opened_jobs(url) as jobs:
                return jobs.add(name, as_text(wanted))

        return _answer(await to_thread.run_sync(add), 202)

    @router.get("/api/v1/jobs", name="jobs", summary="List jobs", responses=answers(JobList, 422))
    def list_jobs(request: Request) -> Response:
        """List what was queued for the log, in its order."""
        refuse_parameters(request)
        with opened_jobs(url) as jobs:
            return json_answer(JobList([_status(one) for one in jobs.listed()]))

    @router.get(_JOB, name="job", summary="Get a job", responses=answers(JobStatus, 404, 422))
    def get_job(job: JobName, request: Request) -> Response:
        """Answer with what has become of a job."""
        refuse_parameters(request)
        with opened_jobs(url) as jobs:
            return _answer(jobs.find(job))

    _add_change(router, url, Jobs.cancel, "Cancel a job that waits or runs")
    _add_change(router, url, Jobs.retry, "Let a job wait again that failed or was cancelled")


def _add_change(router: APIRouter, url: str, change: Callable[[Jobs, str], Job], summary: str) -> None:
    @router.post(
        f"{_JOB}/{change.__name__}",
        name=f"job_{change.__name__}",
        summary=summary,
        status_code=202,
        responses=answers(JobStatus, 404, 409, 422, status=202),
    )
    def change_job(job: JobName, request: Request) -> Response:
        """Answer with the job as it is from then on."""
        refuse_parameters(request)
        with opened_jobs(url) as jobs:
            try:
                return _answer(change(jobs, job), 202)
            except QueryError as error:  # the job is right, but not in a state for this
                raise HTTPException(409, str(error)) from error


def opened_jobs(url: str) -> AbstractContextManager[Jobs]:
    """Open the jobs of a log."""
    return closing(Jobs(database_of(url)))


def input_of(job: Job) -> str:
    """Name the file that a job is about."""
    return str(json.loads(job.request)["input"])


def _request(order: RunOrder, url: str, folders: SourceFolders) -> RunRequest:
    """Make the request for a run, with the files and texts that its names stand for now."""
    with Sources(url) as sources:
        path = folders.path_of(sources.find(order.source))
    with ChronicleTexts(url) as texts:
        known = {one.name: one.text or "" for one in texts.current()}
    for name in order.chronicles:
        if name not in known:
            raise NotInLogError(f"chronicles: expected names of chronicle texts of this log, got {name!r}")
    return RunRequest(
        path.absolute(),
        None if order.site is None else folders.permitted(order.site, "site"),
        log_url="",
        detector=order.detector,
        rate_hz=math.inf if order.rate_hz == "full" else order.rate_hz,
        start_utc_us=None if order.start_utc is None else parse_utc_us(order.start_utc, parameter="start_utc"),
        final=order.final,
        min_confidence=order.min_confidence,
        workers=None,
        chronicle_texts=tuple(SourceText(name, known[name]) for name in order.chronicles),
    )


def _status(job: Job) -> JobStatus:
    shown = Path(input_of(job)).name
    return JobStatus(job.id, job.state, shown, job.run, job.attempts, job.cancel_requested, job.message)


def _answer(job: Job, status: int = 200) -> Response:
    answer = json_answer(_status(job))
    answer.status_code = status
    if status != 200:
        answer.headers["Location"] = _JOB.format(job=job.id)
    return answer
