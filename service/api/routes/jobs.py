"""What can be processed, how does a video get here, and what has become of it? Routes about sources and jobs."""

import dataclasses
import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from functools import partial
from pathlib import Path
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Query, Request
from fastapi import Path as PathPart
from msgspec import convert
from msgspec.structs import replace
from starlette.responses import Response

from service.api.messages.answers import VIDEO_BODY, answers, json_answer, link_to_next, problems, without_folders
from service.api.messages.asked import SOURCE_NAME, Paged, RunOrder, SourceOrder
from service.api.messages.bodies import JobList, JobStatus, SourceList
from service.api.processes.questions import ProcessPool, unfit_video
from service.api.source_files import SourceFolders, Uploads
from service.errors import InputError, NotInLogError, QueryError, TakenError
from service.questions.events.cursors import decode_cursor, encode_cursor
from service.records.runs import SourceText
from service.records.times import parse_utc_us
from service.runs.requests import LiveRequest, RunRequest, as_text, job_id
from service.store.entries import UNDER_WAY, Job, Source
from service.store.log import EventLog
from service.store.registers.chronicle_texts import ChronicleTexts
from service.store.registers.jobs import Jobs
from service.store.registers.sources import Sources
from service.texts.csv_table import ROW_SUFFIXES

JobName = Annotated[str, PathPart(pattern="^[0-9a-f]{16}$")]
_JOB = "/jobs/{job}"
SourceName = Annotated[str, PathPart(pattern=SOURCE_NAME)]
ContentDigest = Annotated[str, Header(description="`sha-256=:BASE64:` of the body, RFC 9530.")]
_SOURCE = "/sources/{name}"


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


def add_sources(router: APIRouter, log: EventLog, folders: SourceFolders, pool: ProcessPool) -> None:
    """Add the routes about sources.

    Parameters
    ----------
    folders : where they may lie.
    pool : whose processes look whether a file is a video.
    """
    sources = Sources(log)

    uploads = (
        None if folders.uploads is None else Uploads(folders.uploads, sources, lambda path: pool.ask(unfit_video, path))
    )
    created = answers(Source, 400, 403, 409, 413, 415, 422, 507, status=201)

    @router.get("/sources", name="sources", responses=answers(SourceList, 422))
    def list_sources() -> Response:
        """List what can be processed by its name."""
        return json_answer(SourceList(sources.listed(), sorted(folders.cameras)))

    @router.post("/sources", name="sources", status_code=201, responses=created)
    async def name_file(order: SourceOrder) -> Response:
        """Make a file in its place a source, if the operator allows its folder. No address is opened."""
        path = folders.permitted(order.file)
        if path.suffix.lower() not in ROW_SUFFIXES and (reason := await pool.ask(unfit_video, str(path))):
            raise HTTPException(415, f"file: expected a video, or trajectories {ROW_SUFFIXES}, got {reason}")
        source = Source(order.name, str(path), "", path.stat().st_size, time.time_ns() // 1_000)
        await to_thread.run_sync(sources.add, source)
        return _created(source)

    @router.put(
        f"{_SOURCE}/video",
        name="source_video",
        status_code=201,
        responses=created,
        openapi_extra=VIDEO_BODY,
        max_body_size=int(folders.upload_gb * 1e9),
    )
    async def upload(name: SourceName, request: Request, content_digest: ContentDigest = "") -> Response:
        """Receive a video, which becomes a source when it is whole; what is refused leaves nothing."""
        if uploads is None:
            raise HTTPException(403, "video: expected a server that takes uploads (--uploads), got one that does not")
        return _created(await uploads.receive(name, request.stream(), content_digest))

    @router.get(_SOURCE, name="source", responses=answers(Source, 404, 422))
    def get_source(name: SourceName) -> Response:
        """Get a source."""
        return json_answer(sources.find(name))

    @router.delete(_SOURCE, name="source", status_code=204, responses=answers(Source, 404, 409, 422, status=204))
    def remove_source(name: SourceName) -> Response:
        """Remove a source that no job needs, with what was uploaded; runs, their events and other files stay."""
        source = sources.find(name)
        path = folders.path_of(source)
        with opened_jobs(log) as jobs:
            under_way = (one for state in UNDER_WAY for one in jobs.in_state(state, "run"))
            if any(Path(one.input) == path for one in under_way):
                raise TakenError(f"source {name!r}: expected one that no job needs, got one that a job waits for")
        sources.remove(name, partial(path.unlink, missing_ok=True) if source.digest else lambda: None)
        return Response(status_code=204)


def _created(source: Source) -> Response:
    return json_answer(source, 201, {"Location": f"/api/v1/sources/{source.name}"})
