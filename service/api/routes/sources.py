"""What can be processed by its name, and how does a video get here? Routes about sources."""

import time
from functools import partial
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Request
from fastapi import Path as PathPart
from starlette.responses import Response

from service.api.bodies import SOURCE_NAME, SourceList, SourceRequest
from service.api.explanations import Explanations
from service.api.openapi import answers, takes
from service.api.routes.answering import json_answer, read_json, refuse_parameters
from service.api.routes.jobs import input_of, opened_jobs
from service.api.source_files import SourceFolders, Uploads
from service.errors import TakenError
from service.store.log import EventLog
from service.store.sources import Source, Sources

SourceName = Annotated[str, PathPart(pattern=SOURCE_NAME)]
ContentDigest = Annotated[str, Header(description="`sha-256=:BASE64:` of the body, RFC 9530.")]
_SOURCE = "/api/v1/sources/{name}"


def add_sources(router: APIRouter, log: EventLog, folders: SourceFolders, explanations: Explanations) -> None:
    """Add the routes about sources.

    Parameters
    ----------
    folders : where they may lie.
    explanations : whose processes look whether an upload is a video.
    """
    url = log.place.url
    opened = partial(Sources, url)
    uploads = None if folders.uploads is None else Uploads(folders.uploads, opened, explanations.unfit)

    @router.get("/api/v1/sources", name="sources", summary="List sources", responses=answers(SourceList, 422))
    def list_sources(request: Request) -> Response:
        """List what can be processed by its name."""
        refuse_parameters(request)
        with opened() as sources:
            return json_answer(SourceList(sources.listed()))

    @router.post(
        "/api/v1/sources",
        name="sources",
        summary="Make a file a source",
        description="By its whole path, which must lead into a folder that the operator allows. No address is opened.",
        status_code=201,
        responses=answers(Source, 409, 413, 415, 422, status=201),
        openapi_extra=takes(SourceRequest),
    )
    async def name_file(request: Request) -> Response:
        """Give a file in its place a name."""
        refuse_parameters(request)
        asked = await read_json(request, SourceRequest)
        path = folders.permitted(asked.file)
        if path.suffix.lower() != ".csv" and (reason := await explanations.unfit(str(path))):
            raise HTTPException(415, f"file: expected a video, or trajectories (.csv), got {reason}")
        source = Source(asked.name, str(path), "", path.stat().st_size, time.time_ns() // 1_000)

        def add() -> None:
            with opened() as sources:
                sources.add(source)

        await to_thread.run_sync(add)
        return _created(source)

    @router.put(
        f"{_SOURCE}/video",
        name="source_video",
        summary="Upload a video",
        description="The body is the video. It becomes a source when it is whole; what is refused leaves nothing.",
        status_code=201,
        responses=answers(Source, 400, 403, 409, 413, 415, 422, 507, status=201),
        openapi_extra=takes(bytes),
        max_body_size=int(folders.upload_gb * 1e9),
    )
    async def upload(name: SourceName, request: Request, content_digest: ContentDigest = "") -> Response:
        """Receive a video and make it a source."""
        refuse_parameters(request)
        if uploads is None:
            raise HTTPException(403, "video: expected a server that takes uploads (--uploads), got one that does not")
        return _created(await uploads.receive(name, request.stream(), content_digest))

    @router.get(_SOURCE, name="source", summary="Get a source", responses=answers(Source, 404, 422))
    def get_source(name: SourceName, request: Request) -> Response:
        """Answer with a source."""
        refuse_parameters(request)
        with opened() as sources:
            return json_answer(sources.find(name))

    @router.delete(
        _SOURCE,
        name="source",
        summary="Remove a source",
        description="With what was uploaded; a file that lay in its place stays, and so do runs and their events.",
        status_code=204,
        responses=answers(Source, 404, 409, 422, status=204),
    )
    def remove_source(name: SourceName, request: Request) -> Response:
        """Remove a source that no job needs."""
        refuse_parameters(request)
        with opened() as sources:
            source = sources.find(name)
            path = folders.path_of(source)
            with opened_jobs(url) as jobs:
                if str(path.absolute()) in map(input_of, (*jobs.first("waiting"), *jobs.first("running"))):
                    raise TakenError(f"source {name!r}: expected one that no job needs, got one that a job waits for")
            sources.remove(name, partial(path.unlink, missing_ok=True) if source.digest else lambda: None)
        return Response(status_code=204)


def _created(source: Source) -> Response:
    answer = json_answer(source)
    answer.status_code = 201
    answer.headers["Location"] = _SOURCE.format(name=source.name)
    return answer
