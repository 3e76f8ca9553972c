"""How is the HTTP interface of one event log put together?

Each request gets an identifier, the client's own if it sent a plain one; `HEAD` is answered as `GET` without a body.
"""

import re
import uuid
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from socket import socket

import anyio.to_thread
import uvicorn
from fastapi import FastAPI
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.event_stream import EventStream
from service.api.explanations import Explanations
from service.api.openapi import describe_bodies
from service.api.problems import REQUEST_ID, register_problems
from service.api.process_pool import ANSWERED_WITHIN_S, ProcessPool
from service.api.routes import add_routes
from service.records import ChronicleRecord, software_version
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files

# Threads queue for the interpreter lock more than for the database: with sixteen, the same requests cost a third more
# processor time. A few let slow questions overlap.
WORKER_THREADS = 3
END_S = 10
_PLAIN_ID = re.compile(r"[A-Za-z0-9._-]{1,128}", re.ASCII)


def create_app(
    log_url: str,
    *,
    shipped: Sequence[ChronicleRecord] | None = None,
    within_s: float = ANSWERED_WITHIN_S,
) -> FastAPI:
    """Make the ASGI application that answers questions to an event log.

    Parameters
    ----------
    log_url : as `open_log` takes it; the log is only read.
    shipped : the chronicles to list beside those of the log's runs; None for the library.
    within_s : how long an explanation may take.

    Raises
    ------
    LogError
        If there is no such log, or it cannot be read.
    """
    log = open_log(log_url)
    stream = EventStream(log)
    version = software_version()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        """Bound the worker threads, and look for new events; close the log when the server stops."""
        anyio.to_thread.current_default_thread_limiter().total_tokens = WORKER_THREADS
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(stream.watch)
            yield
            tasks.cancel_scope.cancel()
        log.close()

    # No /docs page: the framework's loads its scripts from other people's servers.
    # No redirects for a final slash: one path, one answer, and nothing that the description leaves out.
    # Answers are put together by the routes, so the framework has no model of them to check.
    app = FastAPI(
        title="DyKnow",
        version=version,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        default_response_class=Response,
    )
    library = load_chronicle_files(()).records if shipped is None else shipped
    app.state.event_stream = stream
    add_routes(
        app.router, log, stream, Explanations(log.read_from.url, ProcessPool(within_s)), library, version=version
    )
    app.add_middleware(RequestFrame)
    register_problems(app)
    describe_bodies(app)
    return app


class Server(uvicorn.Server):
    """A server of such an application; it ends the streams of events before it waits for what is still answered."""

    def __init__(self, app: FastAPI) -> None:
        # A client that does not read what it asked for would hold the end up for ever.
        super().__init__(uvicorn.Config(app, access_log=False, log_level="warning", timeout_graceful_shutdown=END_S))
        self._stream: EventStream = app.state.event_stream

    async def shutdown(self, sockets: list[socket] | None = None) -> None:
        """End in the ordinary way."""
        self._stream.close()
        await super().shutdown(sockets)


class RequestFrame:
    """Wrap an ASGI application: request identifiers and `HEAD`."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        request_id = given if _PLAIN_ID.fullmatch(given) else uuid.uuid4().hex
        scope[REQUEST_ID] = request_id  # in place: the outermost error handler sees this same scope
        is_head, is_over = scope["method"] == "HEAD", False

        async def send_framed(message: Message) -> None:
            """Send a message with the request's identifier; to `HEAD`, no body, and no more of one that goes on."""
            nonlocal is_over
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["X-Request-Id"] = request_id
            elif is_head and message["type"] == "http.response.body":
                message = {**message, "body": b"", "more_body": False}
            if not is_over:
                is_over = not message.get("more_body", True)
                await send(message)

        await self._app({**scope, "method": "GET"} if is_head else scope, receive, send_framed)
