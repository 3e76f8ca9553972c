"""How is the HTTP interface of one event log put together?

Each request gets an identifier, the client's own if it sent a plain one; `HEAD` is answered as `GET` without a body.
"""

import re
import uuid
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import anyio.to_thread
from fastapi import FastAPI
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.explanations import ANSWERED_WITHIN_S, Explanations
from service.api.openapi import describe_bodies
from service.api.problems import REQUEST_ID, register_problems
from service.api.routes import add_routes
from service.records import ChronicleRecord, software_version
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files

# Threads queue for the interpreter lock more than for the database: with sixteen, the same requests cost a third more
# processor time. A few let slow questions overlap.
WORKER_THREADS = 3
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
    version = software_version()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        """Bound the worker threads; close the log when the server stops."""
        anyio.to_thread.current_default_thread_limiter().total_tokens = WORKER_THREADS
        yield
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
    add_routes(app.router, log, Explanations(log.read_from.url, within_s), library, version=version)
    app.add_middleware(RequestFrame)
    register_problems(app)
    describe_bodies(app)
    return app


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
        is_head = scope["method"] == "HEAD"

        async def send_framed(message: Message) -> None:
            """Send a message with the request's identifier; to `HEAD`, no body."""
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["X-Request-Id"] = request_id
            elif is_head and message["type"] == "http.response.body":
                message = {**message, "body": b""}
            await send(message)

        await self._app({**scope, "method": "GET"} if is_head else scope, receive, send_framed)
