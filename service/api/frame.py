"""What is the same for every request and answer?

It has an identifier, the client's own if it sent a plain one; `HEAD` is answered as `GET` without a body; headers keep
browsers from guessing, framing and keeping; every error is a problem, also what a part of the framework says in plain
text; and each is counted.
"""

import re
import time
from collections.abc import Callable, Collection
from http import HTTPStatus
from secrets import token_hex

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.messages.problems import MEDIA_TYPE, REQUEST_ID, answer_bug, answer_refusal
from service.api.metrics import Metrics

STRICT_HEADERS = {
    b"cache-control": b"no-store",
    b"content-security-policy": b"default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    b"referrer-policy": b"no-referrer",
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"DENY",
}
"""Of every answer that does not say otherwise itself."""

NO_ROUTE = "none"
_PLAIN_ID = re.compile(r"[A-Za-z0-9._-]{1,128}", re.ASCII)


class RequestFrame:
    """Wrap an ASGI application."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        request_id = given if _PLAIN_ID.fullmatch(given) else token_hex(16)
        method = scope["method"]
        inner = {**scope, REQUEST_ID: request_id, "method": "GET" if method == "HEAD" else method}
        answer = _Answer(self._metrics, method, inner, receive, send)
        try:
            await self._app(inner, receive, answer.send)
        except Exception:
            if not answer.is_begun:
                await answer_bug(Request(inner))(inner, receive, answer.send)
            raise  # the server logs it with its trace


class _Answer:
    """One answer on its way out."""

    def __init__(self, metrics: Metrics, method: str, inner: Scope, receive: Receive, send: Send) -> None:
        self._metrics, self._method, self._inner, self._receive, self._send = metrics, method, inner, receive, send
        self._began_s = time.perf_counter()
        self._refused: int | None = None
        self._is_over = False
        self.is_begun = False

    async def send(self, message: Message) -> None:
        """Send a message of it on; to `HEAD`, no body, and no more of one that goes on."""
        if self._is_over:
            return
        if message["type"] == "http.response.start":
            if message["status"] >= HTTPStatus.BAD_REQUEST and _type_of(message) != MEDIA_TYPE.encode():
                self._refused = message["status"]  # and why comes with the body
                return
            self._begin(message)
        elif self._refused is not None:
            refusal = HTTPException(self._refused, message.get("body", b"").decode(errors="replace"))
            self._refused = None
            await answer_refusal(Request(self._inner), refusal)(self._inner, self._receive, self.send)
            return
        elif self._method == "HEAD" and message["type"] == "http.response.body":
            message = {**message, "body": b"", "more_body": False}
        self._is_over = message["type"] == "http.response.body" and not message.get("more_body", False)
        await self._send(message)

    def _begin(self, message: Message) -> None:
        """Add the headers that are missing, and count the answer."""
        self.is_begun = True
        headers = message["headers"] = list(message.get("headers", ()))
        named = {name for name, _ in headers}
        headers += [one for one in STRICT_HEADERS.items() if one[0] not in named]
        headers.append((b"x-request-id", self._inner[REQUEST_ID].encode()))
        route = getattr(self._inner.get("route"), "path", NO_ROUTE)
        self._metrics.count(route, self._method, message["status"], time.perf_counter() - self._began_s)


def _type_of(message: Message) -> bytes:
    return next((value for name, value in message.get("headers", ()) if name.lower() == b"content-type"), b"")


class ConditionalMiddleware:
    """Wrap an ASGI application in what only requests with some header need.

    Others pass it by: to look at each message of an answer costs a hundredth of what a page of events does.

    Parameters
    ----------
    wrap : makes of an application the one that such requests get.
    headers : in lower case; one of them is enough.
    """

    def __init__(self, app: ASGIApp, wrap: Callable[[ASGIApp], ASGIApp], headers: Collection[bytes]) -> None:
        self._plain, self._wrapped, self._headers = app, wrap(app), headers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        is_needed = any(name in self._headers for name, _ in scope.get("headers", ()))
        await (self._wrapped if is_needed else self._plain)(scope, receive, send)
