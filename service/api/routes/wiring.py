"""Which routes are there? All of them, each with what it needs, and an index of them."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from fastapi import APIRouter, Depends, Request
from fastapi.routing import APIRoute
from starlette.responses import PlainTextResponse, Response

from service.api.delivery.event_stream import EventStream
from service.api.messages.answers import answers, json_answer
from service.api.messages.asked import take_none
from service.api.messages.bodies import Index
from service.api.processes.pool import ProcessPool
from service.api.routes.cars import add_cars
from service.api.routes.chronicles import add_chronicles
from service.api.routes.events import add_events
from service.api.routes.explanations import add_explanations
from service.api.routes.jobs import add_job_list, add_jobs
from service.api.routes.media import add_media
from service.api.routes.relations import add_relations
from service.api.routes.runs import add_runs
from service.api.routes.sources import add_sources
from service.api.routes.webhooks import add_webhooks
from service.api.source_files import SourceFolders
from service.questions.events.queries import DEFAULT_LIMIT, MAX_LIMIT, find_last_seq
from service.questions.observations.coverage import Coverage
from service.records.runs import ChronicleRecord, software_version
from service.store.log import EventLog

HELLO = """\
DyKnow: what happened in the traffic, recognised from video.

curl '{base}api/v1/events?type=overtake&from=00:10&to=02:00'     all overtakes between two times
curl '{base}api/v1'                                              everything else there is to ask
"""


def add_routes(
    router: APIRouter,
    log: EventLog,
    stream: EventStream,
    pool: ProcessPool,
    shipped: Iterable[ChronicleRecord],
    *,
    folders: SourceFolders,
    media_folders: Sequence[Path],
) -> None:
    """Add the routes of one event log to those of an application.

    Parameters
    ----------
    stream, pool : of the same log.
    shipped : the chronicles that come with DyKnow.
    folders : where sources may lie.
    media_folders : whose videos may be sent.
    """
    coverage = Coverage(log)
    asked = APIRouter(prefix="/api/v1", default_response_class=Response)
    add_events(asked, log, stream, coverage, pool)
    add_explanations(asked, pool)
    add_cars(asked, log, coverage)
    add_relations(asked, pool)
    add_runs(asked, log, pool, coverage)
    add_media(asked, log, pool, media_folders)
    add_job_list(asked, log)
    plain = APIRouter(prefix="/api/v1", dependencies=[Depends(take_none)])
    add_chronicles(plain, log, pool, shipped)
    add_sources(plain, log, folders, pool)
    add_jobs(plain, log, folders)
    add_webhooks(plain, log)
    router.routes.extend([*asked.routes, *plain.routes])  # `include_router` would hide them from the index
    _add_index(router, log)


def _add_index(router: APIRouter, log: EventLog) -> None:
    """Add the first page and the index.

    The index links to every described route, by its name.
    """
    version = software_version()

    @router.get("/", include_in_schema=False, response_class=PlainTextResponse)
    def hello(request: Request) -> PlainTextResponse:
        return PlainTextResponse(HELLO.format(base=request.base_url))

    @router.get("/api/v1", name="index", responses=answers(Index))
    def index() -> Response:
        """Say what can be asked: link to all routes by their names."""
        described = (one for one in router.routes if isinstance(one, APIRoute) and one.include_in_schema)
        links = {one.name: one.path for one in described} | {"openapi": "/openapi.json"}
        return json_answer(Index("dyknow", version, find_last_seq(log), DEFAULT_LIMIT, MAX_LIMIT, links))
