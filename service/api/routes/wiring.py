"""Which routes are there? All of them, each with what it needs."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from fastapi import APIRouter, Depends
from starlette.responses import Response

from service.api.delivery.event_stream import EventStream
from service.api.messages.asked import take_none
from service.api.processes.pool import ProcessPool
from service.api.routes.cars import add_cars
from service.api.routes.chronicle_texts import add_chronicle_texts
from service.api.routes.chronicles import add_chronicles
from service.api.routes.events import add_events
from service.api.routes.explanations import add_explanations
from service.api.routes.index import add_index
from service.api.routes.jobs import add_job_list, add_jobs
from service.api.routes.media import add_media
from service.api.routes.relations import add_relations
from service.api.routes.runs import add_runs
from service.api.routes.sources import add_sources
from service.api.routes.webhooks import add_webhooks
from service.api.source_files import SourceFolders
from service.questions.observations.coverage import Coverage
from service.records.runs import ChronicleRecord
from service.store.log import EventLog


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
    add_chronicles(asked, log, tuple(shipped))
    plain = APIRouter(prefix="/api/v1", dependencies=[Depends(take_none)])
    add_chronicle_texts(plain, log, pool)
    add_sources(plain, log, folders, pool)
    add_jobs(plain, log, folders)
    add_webhooks(plain, log)
    router.routes.extend([*asked.routes, *plain.routes])  # `include_router` would hide them from the index
    add_index(router, log)
