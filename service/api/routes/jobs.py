"""What is to be processed, and what has become of it? Routes about jobs, and the one that begins a run."""

import dataclasses
import math
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from typing import Annotated

from fastapi import APIRouter, HTTPException, Path, Query
from msgspec import convert
from msgspec.structs import replace
from starlette.responses import Response

from service.api.messages.answers import answers, json_answer, link_to_next, problems
from service.api.messages.asked import Paged, RunOrder
from service.api.messages.bodies import JobList, JobStatus
from service.api.messages.problems import without_folders
from service.api.source_files import SourceFolders
from service.errors import InputError, NotInLogError, QueryError
from service.questions.events.cursors import decode_cursor, encode_cursor
from service.records.runs import SourceText
from service.records.times import parse_utc_us
from service.runs.requests import LiveRequest, RunRequest, as_text, job_id
from service.store.entries import Job
from service.store.log import EventLog
from service.store.registers.chronicle_texts import ChronicleTexts
from service.store.registers.jobs import Jobs
from service.store.registers.sources import Sources

JobName = Annotated[str, Path(pattern="^[0-9a-f]{16}$")]
_JOB = "/jobs/{job}"


def add_jobs(router: APIRouter, log: EventLog, folders: SourceFolders) -> None:
    """Add the routes about jobs.

    Parameters
    ----------
    folders : where sources and site files may lie.
    """
    accepted = answers(JobStatus, 404, 409, 422, status=202)

    @router.post("/runs", name="runs", status_code=202, responses=accepted | problems(400, 413))
    def begin_run(order: RunOrder) -> Response:
        """Add a run, or a camera to watch, to the jobs. The same request is the same job, whenever it comes."""
        wanted = _request(order, log, folders)
        try:
            name = job_id(wanted)
        except OSError as error:
            raise InputError(f"{order.source}: expected its files, got {error.strerror}") from error
        with opened_jobs(log) as jobs:
            return _accepted(jobs.add(name, as_text(wanted), "run" if isinstance(wanted, RunRequest) else "live"))

    @router.get(_JOB, name="job", responses=answers(JobStatus, 404, 422))
    def get_job(job: JobName) -> Response:
        """Say what has become of a job."""
        with opened_jobs(log) as jobs:
            return json_answer(_status(jobs.find(job)))

    def change(job: str, how: Callable[[Jobs, str], Job]) -> Response:
        """Change the state of a job."""
        with opened_jobs(log) as jobs:
            try:
                return _accepted(how(jobs, job))
            except QueryError as error:  # the job is right, but not in a state for this
                raise HTTPException(409, str(error)) from error

    @router.post(f"{_JOB}/cancel", name="job_cancel", status_code=202, responses=accepted)
    def cancel(job: JobName) -> Response:
        """Cancel a job that waits or runs."""
        return change(job, Jobs.cancel)

    @router.post(f"{_JOB}/retry", name="job_retry", status_code=202, responses=accepted)
    def retry(job: JobName) -> Response:
        """Let a job wait again that failed or was cancelled."""
        return change(job, Jobs.retry)


def add_job_list(router: APIRouter, log: EventLog) -> None:
    """Add the list of all jobs."""

    @router.get("/jobs", name="jobs", responses=answers(JobList, 400, 422))
    def list_jobs(asked: Annotated[Paged, Query()]) -> Response:
        """List what was queued for the log, in its order."""
        after = 0 if asked.cursor is None else decode_cursor(asked.cursor, None)[0]
        with opened_jobs(log) as jobs:
            found = jobs.listed(after=after, most=asked.limit + 1)
        shown = found[: asked.limit]
        cursor = encode_cursor((shown[-1].number, 0), None) if len(found) > len(shown) else None
        headers = link_to_next("/api/v1/jobs", [("limit", str(asked.limit))], cursor)
        return json_answer(JobList([_status(one) for one in shown], cursor), headers=headers)


def opened_jobs(log: EventLog) -> AbstractContextManager[Jobs]:
    """Open the jobs of a log."""
    return closing(Jobs(log.place))


def _request(order: RunOrder, log: EventLog, folders: SourceFolders) -> RunRequest | LiveRequest:
    """Make a request, with the files, addresses and texts that its names stand for now."""
    address, recordings = folders.cameras.get(order.source), (folders.recordings / order.source).absolute()
    path = recordings if address else folders.path_of(Sources(log).find(order.source))
    known = {one.name: one.text or "" for one in ChronicleTexts(log).current()}
    for name in order.chronicles:
        if name not in known:
            raise NotInLogError(f"chronicles: expected names of chronicle texts of this log, got {name!r}")
    named = {"site": order.site, "kpl": order.kpl, "linkage": order.linkage}
    files = {what: None if name is None else folders.permitted(name, what) for what, name in named.items()}
    run = RunRequest(
        path,
        files["site"],
        log_url="",
        monitor_files=tuple(folders.permitted(one, "monitors") for one in order.monitors),
        kpl_file=files["kpl"],
        linkage_file=files["linkage"],
        detector=order.detector,
        rate_hz=math.inf if order.rate_hz == "full" else order.rate_hz,
        start_utc_us=None if order.start_utc is None else parse_utc_us(order.start_utc, parameter="start_utc"),
        final=order.final,
        min_confidence=order.min_confidence,
        workers=None,
        chronicle_texts=tuple(SourceText(name, known[name]) for name in order.chronicles),
    )
    if address is None:
        return run
    # A recording says itself when it began, and its run follows the texts of the log as they change.
    for what, came in (("start_utc", order.start_utc), ("chronicles", order.chronicles)):
        if came:
            raise QueryError(f"{what}: expected none with a camera, got {came!r}", parameter=what)
    return LiveRequest(address, dataclasses.replace(run, again=True, is_live=True), recordings)


def _status(job: Job) -> JobStatus:
    status = convert(job, JobStatus, from_attributes=True)
    return replace(status, input=without_folders(status.input), message=without_folders(status.message))


def _accepted(job: Job) -> Response:
    return json_answer(_status(job), 202, {"Location": f"/api/v1/jobs/{job.id}"})
