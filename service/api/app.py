"""How is the HTTP interface of one event log put together?"""

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from socket import socket
from tempfile import TemporaryDirectory

import anyio.to_thread
import uvicorn
from fastapi import FastAPI
from starlette.middleware.body_limit import RequestBodyLimitMiddleware
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import Response

from service.api.access.admission import Admission
from service.api.access.callers import add_login
from service.api.access.settings import Access
from service.api.delivery.event_stream import EventStream
from service.api.description import add_docs, describe_bodies
from service.api.frame import ConditionalMiddleware, RequestFrame
from service.api.health import add_health
from service.api.messages.problems import register_problems
from service.api.metrics import Metrics
from service.api.processes.pool import ProcessPool
from service.api.routes.wiring import add_routes
from service.api.source_files import NO_FOLDERS, SourceFolders
from service.records.runs import ChronicleRecord, software_version
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import load_chronicle_files

# Threads queue for the interpreter lock more than for the database: with sixteen, the same requests cost a third more
# processor time. A few let slow questions overlap.
WORKER_THREADS = 3
END_S = 10
COMPRESSION_LEVEL = 1  # nine takes thirteen times as long for a page of events, and saves a seventh more
MOST_BODY_BYTES = 1_000_000
"""Where a route does not say otherwise, by its own `max_body_size`."""


def create_app(
    log_url: str,
    *,
    shipped: Sequence[ChronicleRecord] | None = None,
    folders: SourceFolders = NO_FOLDERS,
    media_folders: Sequence[Path] = (),
    access: Access | None = None,
) -> FastAPI:
    """Make the ASGI application that answers questions to an event log.

    Parameters
    ----------
    log_url : as `open_log` takes it.
    shipped : the chronicles to list beside those of the log's runs; None for the library.
    folders : where what clients have processed may lie.
    media_folders : whose videos may be sent.
    access : who may ask; None for everybody on this machine.

    Raises
    ------
    LogError
        If there is no such log, or it cannot be read.
    """
    log = open_log(log_url)
    stream = EventStream(log)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        """Bound the worker threads, and look for new events; close the log when the server stops."""
        anyio.to_thread.current_default_thread_limiter().total_tokens = WORKER_THREADS
        with TemporaryDirectory(prefix="dyknow-clips-", ignore_cleanup_errors=True) as clips:
            app.state.clips = Path(clips)
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(stream.watch)
                yield
                tasks.cancel_scope.cancel()
        log.close()

    # The framework's own /docs page loads its scripts from other people's servers.
    # No redirects for a final slash: one path, one answer, and nothing that the description leaves out.
    # Answers are put together by the routes, so the framework has no model of them to check.
    app = FastAPI(
        title="DyKnow",
        version=software_version(),
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        default_response_class=Response,
    )
    library = load_chronicle_files(()).records if shipped is None else shipped
    pool = ProcessPool(log.read_from.url)
    metrics = Metrics(lambda: stream.count, lambda: pool.waiting)
    app.state.event_stream = stream
    add_routes(app.router, log, stream, pool, library, folders=folders, media_folders=media_folders)
    add_login(app.router)  # behind those that are asked most: routes are tried one by one
    add_health(app.router, log, metrics)
    add_docs(app)
    _add_middleware(app, log, metrics, access or Access())
    register_problems(app)
    describe_bodies(app)
    return app


def _add_middleware(app: FastAPI, log: EventLog, metrics: Metrics, access: Access) -> None:
    """Put what each request passes before the routes; what is added last, it meets first."""
    app.add_middleware(Admission, access=access, log=log)
    gzip = partial(GZipMiddleware, compresslevel=COMPRESSION_LEVEL)
    app.add_middleware(ConditionalMiddleware, wrap=gzip, headers=(b"accept-encoding",))
    if access.origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=access.origins,
            allow_methods=("GET", "HEAD", "POST", "PUT", "DELETE"),
            allow_headers=("Authorization", "If-Match", "If-None-Match", "Last-Event-ID"),
            expose_headers=("ETag", "Link", "Location", "Retry-After", "X-Request-Id"),
        )
    limit = partial(RequestBodyLimitMiddleware, max_body_size=MOST_BODY_BYTES)
    with_body = b"content-length", b"transfer-encoding"  # without either no body comes
    app.add_middleware(ConditionalMiddleware, wrap=limit, headers=with_body)
    app.add_middleware(RequestFrame, metrics=metrics)


class Server(uvicorn.Server):
    """A server of such an application; it ends the streams of events before it waits for what is still answered."""

    def __init__(self, app: FastAPI) -> None:
        # A client that does not read what it asked for would hold the end up for ever.
        config = uvicorn.Config(
            app, access_log=False, log_level="warning", server_header=False, timeout_graceful_shutdown=END_S
        )
        super().__init__(config)
        self._stream: EventStream = app.state.event_stream

    async def shutdown(self, sockets: list[socket] | None = None) -> None:
        """End in the ordinary way."""
        self._stream.close()
        await super().shutdown(sockets)
