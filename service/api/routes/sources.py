"""What can be processed by its name, and how does a video get here? Routes about sources."""

import time
from functools import partial
from pathlib import Path
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Request
from fastapi import Path as PathPart
from starlette.responses import Response

from service.api.messages.answers import VIDEO_BODY, answers, json_answer
from service.api.messages.asked import SOURCE_NAME, SourceOrder
from service.api.messages.bodies import SourceList
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import unfit_video
from service.api.routes.jobs import opened_jobs
from service.api.source_files import SourceFolders, Uploads
from service.errors import TakenError
from service.store.entries import UNDER_WAY, Source
from service.store.log import EventLog
from service.store.registers.sources import Sources
from service.texts.csv_table import ROW_SUFFIXES

SourceName = Annotated[str, PathPart(pattern=SOURCE_NAME)]
ContentDigest = Annotated[str, Header(description="`sha-256=:BASE64:` of the body, RFC 9530.")]
_SOURCE = "/sources/{name}"


def add_sources(router: APIRouter, log: EventLog, folders: SourceFolders, pool: ProcessPool) -> None:
    """Add the routes about sources.

    Parameters
    ----------
    folders : where they may lie.
    pool : whose processes look whether a file is a video.
    """
    sources = Sources(log)

    async def unfit(path: str) -> str:
        """Say why a file is no video, in a process."""
        return await pool.ask(unfit_video, path)

    uploads = None if folders.uploads is None else Uploads(folders.uploads, sources, unfit)
    created = answers(Source, 400, 403, 409, 413, 415, 422, 507, status=201)

    @router.get("/sources", name="sources", responses=answers(SourceList, 422))
    def list_sources() -> Response:
        """List what can be processed by its name."""
        return json_answer(SourceList(sources.listed(), sorted(folders.cameras)))

    @router.post("/sources", name="sources", status_code=201, responses=created)
    async def name_file(order: SourceOrder) -> Response:
        """Make a file in its place a source, if the operator allows its folder. No address is opened."""
        path = folders.permitted(order.file)
        if path.suffix.lower() not in ROW_SUFFIXES and (reason := await unfit(str(path))):
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
