"""What happens to every request on its way in and out?

Each gets an identifier, the client's own if it sent a plain one, and `HEAD` is answered as `GET` without a body.
"""

import re
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import REQUEST_ID

_PLAIN_ID = re.compile(r"[A-Za-z0-9._-]{1,128}", re.ASCII)


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
