"""Does the server live, can it answer, and what has it done? For what watches over it.

These answer however busy the server is: they use no thread that answers questions, and wait for the log a few seconds
at most.
"""

import logging
import shutil

from anyio import CapacityLimiter, move_on_after, to_thread
from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST
from starlette.responses import PlainTextResponse, Response

from service.api.messages.answers import problems
from service.api.messages.bodies import ProblemDetail
from service.api.messages.problems import problem
from service.api.metrics import Metrics
from service.errors import LogError
from service.questions.events.queries import find_last_seq
from service.store.databases.location import log_files
from service.store.log import EventLog
from service.store.registers.jobs import count_jobs
from service.store.schema import SCHEMA_VERSION
from service.store.versions import read_version

LOOKED_WITHIN_S = 5.0
LEAST_FREE_BYTES = 100_000_000
"""Less is soon used up: a minute of traffic takes some hundred kilobytes, a migration as much as the log."""

_LOGGER = logging.getLogger(__name__)


def add_health(router: APIRouter, log: EventLog, metrics: Metrics) -> None:
    """Add the routes that tell how a server is."""
    limiter = CapacityLimiter(2)

    @router.get("/healthz", name="health", response_class=PlainTextResponse, responses=problems())
    async def healthz() -> PlainTextResponse:
        """Say that the server lives; its event loop alone answers."""
        return PlainTextResponse("ok\n")

    @router.get("/readyz", response_class=PlainTextResponse, responses=problems(503))
    async def readyz(request: Request) -> Response:
        """Say whether the server can answer.

        Looks at the log, its schema and the room on its disk; a 503 lists what fails.
        """
        found = [f"log: expected an answer within {LOOKED_WITHIN_S:g} s, got none"]
        with move_on_after(LOOKED_WITHIN_S):
            found = await to_thread.run_sync(failing, log, limiter=limiter, abandon_on_cancel=True)
        if not found:
            return PlainTextResponse("ready\n")
        kind, told = "urn:dyknow:problem:not-ready", [ProblemDetail(one) for one in found]
        return problem(request, 503, "; ".join(found), kind=kind, errors=told, headers={"Retry-After": "1"})

    @router.get("/metrics", response_class=PlainTextResponse, responses=problems())
    async def tell_metrics() -> Response:
        """Tell Prometheus of the server; counts of the log are as old as it has been unreadable."""
        with move_on_after(LOOKED_WITHIN_S):
            await to_thread.run_sync(_note, log, metrics, limiter=limiter, abandon_on_cancel=True)
        return Response(metrics.text(), headers={"Content-Type": CONTENT_TYPE_LATEST})


def failing(log: EventLog) -> list[str]:
    """Say what keeps a server from answering; nothing if it is ready.

    Names no file: anybody may ask.
    """
    found = []
    try:
        find_last_seq(log)
        version = read_version(log.read_from)
        if version != SCHEMA_VERSION:
            found.append(f"schema: expected version {SCHEMA_VERSION}, got {version}")
        for file in log_files(log.read_from.url):
            free_bytes = shutil.disk_usage(file.parent).free
            if free_bytes < LEAST_FREE_BYTES:
                found.append(f"disk: expected {LEAST_FREE_BYTES:,} bytes that are free, got {free_bytes:,}")
    except (LogError, OSError) as error:
        _LOGGER.warning("not ready: %s", error)
        found.append("log: expected one that can be read, got an error, which the server's output tells")
    return found


def _note(log: EventLog, metrics: Metrics) -> None:
    try:
        metrics.note_log(find_last_seq(log), count_jobs(log))
    except LogError as error:
        _LOGGER.warning("metrics without those of the log: %s", error)
