"""May this request be answered, and who is told of it afterwards?

A host that is not ours, a page of another origin that would write, a token that is missing or allows too little: all
are refused here, before any route. What may change something leaves a row in the audit.
"""

import logging
import time
from collections import Counter
from functools import partial
from http import HTTPStatus
from typing import Final

from anyio import CapacityLimiter, to_thread
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.access.callers import LOOPBACK, Callers, address_of
from service.api.access.settings import Access
from service.api.messages.problems import REQUEST_ID, answer_refusal
from service.errors import LogError
from service.store.entries import Scope as TokenScope
from service.store.entries import Written
from service.store.log import EventLog
from service.store.registers.access import note_written

OPEN: Final = frozenset({"/healthz", "/readyz", "/logout"})
"""What anybody may ask who reaches the server."""

CHANGING_NOTHING: Final = frozenset(
    {"/login", "/api/v1/monitors/try", *(f"/api/v1/chronicles/{one}" for one in ("check", "diff", "format", "try"))}
)
"""What is posted only since it has a body, or needs one's own page."""

ADMINISTERED: Final = "/api/v1/webhooks"

_LOGGER = logging.getLogger(__name__)


def needed_scope(method: str, path: str) -> TokenScope:
    """Say what a token must allow for a request.

    Examples
    --------
    >>> needed_scope("GET", "/api/v1/events"), needed_scope("POST", "/api/v1/runs")
    ('read', 'write')
    """
    if path.startswith(ADMINISTERED):
        return "admin"
    return "read" if method in ("GET", "OPTIONS") or (method == "POST" and path in CHANGING_NOTHING) else "write"


class Admission:
    """Wrap an ASGI application: only who may ask gets through.

    Parameters
    ----------
    log : has the tokens, and gets the audit.
    """

    def __init__(self, app: ASGIApp, access: Access, log: EventLog) -> None:
        self._app, self._access, self._log = app, access, log
        self._callers = Callers(log, needs_token=access.needs_token)
        self._limiter = CapacityLimiter(1)
        self._at_once: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        needed = needed_scope(scope["method"], scope["path"])
        try:
            caller = await self._admitted(request, needed)
            who = self._entered(request, caller)
        except HTTPException as refused:
            await answer_refusal(request, refused)(scope, receive, send)
            return
        try:
            if needed == "read" or caller is None:
                await self._app(scope, receive, send)
            else:
                await self._noted(caller, scope, receive, send)
        finally:
            self._at_once[who] -= 1
            if not self._at_once[who]:
                del self._at_once[who]

    def _entered(self, request: Request, caller: str | None) -> str:
        """Count a request until its answer has ended, and say whose it is: a token's, or else an address's."""
        if caller is None or request.scope["path"] == "/metrics":
            return ""
        who, most = address_of(request) if caller == LOOPBACK.name else caller, self._access.most_at_once
        if self._at_once[who] >= most:
            detail = f"requests: expected at most {most} of {who!r} at once, got one more; ask again later"
            raise HTTPException(HTTPStatus.TOO_MANY_REQUESTS, detail, {"Retry-After": "1"})
        self._at_once[who] += 1
        return who

    async def _admitted(self, request: Request, needed: TokenScope) -> str | None:
        """Let a request through, and name who sent it if anybody had to; raises an `HTTPException`."""
        headers, access = request.headers, self._access
        host, origin = headers.get("host", ""), headers.get("origin")
        if not access.is_called(host):
            detail = f"Host: expected a name of this server (serve --allow-host NAME adds one), got {host!r}"
            raise HTTPException(HTTPStatus.BAD_REQUEST, detail)
        if request.method != "GET" and not access.takes_writes(origin, host):
            detail = f"Origin: expected that of {host!r} (serve --allow-origin ORIGIN adds one), got {origin!r}"
            raise HTTPException(HTTPStatus.FORBIDDEN, detail)
        if request.scope["path"] in OPEN:
            return None
        caller = await self._callers.find(request)
        if not caller.allows(needed):
            detail = f"token {caller.name!r}: expected scope {needed!r}, got {caller.scope!r}"
            told = {"WWW-Authenticate": f'Bearer realm="dyknow", error="insufficient_scope", scope="{needed}"'}
            raise HTTPException(HTTPStatus.FORBIDDEN, detail, told)
        return caller.name

    async def _noted(self, caller: str, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, with a row in the audit before the answer goes out."""

        async def send_noted(message: Message) -> None:
            if message["type"] == "http.response.start":
                await self._note(caller, scope, message["status"])
            await send(message)

        try:
            await self._app(scope, receive, send_noted)
        except Exception:
            await self._note(caller, scope, HTTPStatus.INTERNAL_SERVER_ERROR)
            raise

    async def _note(self, caller: str, scope: Scope, status: int) -> None:
        if status in (HTTPStatus.NOT_FOUND, HTTPStatus.METHOD_NOT_ALLOWED):
            return  # there was nothing to change
        row = Written(time.time_ns() // 1000, caller, scope["method"], scope["path"], status, scope[REQUEST_ID])
        try:
            await to_thread.run_sync(partial(note_written, self._log, row), limiter=self._limiter)
        except LogError as error:  # what was done is done
            _LOGGER.error("audit: %s: expected a row in the log, got none: %s", row, error)
