"""May this request be answered, whose is it, and who is told of it afterwards?

Tokens are kept in memory, and read again when one is unknown or a second has passed: no request waits for the threads
that answer questions, and one that is revoked ends within a second.

A host that is not ours, a page of another origin that would write, a token that is missing or allows too little: all
are refused here, before any route. What may change something leaves a row in the audit.
"""

import logging
import time
from collections import Counter
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from typing import Final

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.access.settings import Access
from service.api.messages.answers import REQUEST_ID, answer_refusal, problems
from service.errors import LogError
from service.store.entries import Scope as TokenScope
from service.store.entries import Token, Written
from service.store.log import EventLog
from service.store.registers.access import digest_of, list_tokens, note_written

COOKIE = "dyknow_token"
LOOPBACK = Token("loopback", "", "admin", 0)
"""Who needs no token."""

READ_EVERY_S = 1.0
MOST_FAILURES = 10
FAILURES_WITHIN_S = 60
OPEN: Final = frozenset({"/healthz", "/readyz", "/logout"})
"""What anybody may ask who reaches the server."""
CHANGING_NOTHING: Final = frozenset(
    {"/login", "/api/v1/monitors/try", *(f"/api/v1/chronicles/{one}" for one in ("check", "diff", "format", "try"))}
)
"""What is posted only since it has a body, or needs one's own page."""
ADMINISTERED: Final = "/api/v1/webhooks"
_LOGGER = logging.getLogger(__name__)


class Callers:
    """Knows who sends the requests to one log.

    Parameters
    ----------
    needs_token : whether who has none is refused.
    """

    def __init__(self, log: EventLog, *, needs_token: bool) -> None:
        self._log, self._needs_token = log, needs_token
        self._tokens: dict[str, Token] = {}
        self._read_s = float("-inf")
        self._limiter = CapacityLimiter(1)
        self._failures: Counter[str] = Counter()
        self._counted_from_s = 0.0

    async def find(self, request: Request) -> Token:
        """Say whose request it is.

        Raises
        ------
        HTTPException
            401 if there is no token where one is needed, or one that the log does not know; 429 if too many came from
            there that it did not know.
        """
        given = bearer(request)
        secret = given or request.cookies.get(COOKIE, "")
        token = await self._known(secret, address_of(request)) if secret else None
        if token is not None:
            return token
        if given or self._needs_token:
            came = "one that is not, or has ended" if secret else "none"
            raise unknown(f"token: expected one of this log, as 'Authorization: Bearer TOKEN', got {came}")
        return LOOPBACK

    async def _known(self, secret: str, client: str) -> Token | None:
        digest, now_s = digest_of(secret), time.monotonic()
        if now_s - self._counted_from_s > FAILURES_WITHIN_S:
            self._failures.clear()
            self._counted_from_s = now_s
        if digest not in self._tokens and self._failures[client] >= MOST_FAILURES:
            left_s = FAILURES_WITHIN_S - int(now_s - self._counted_from_s)
            detail = f"token: expected fewer than {MOST_FAILURES} wrong ones a minute from {client}, got one more"
            raise HTTPException(HTTPStatus.TOO_MANY_REQUESTS, detail, {"Retry-After": str(left_s)})
        if digest not in self._tokens or now_s - self._read_s > READ_EVERY_S:
            await self._read()
        token = self._tokens.get(digest)
        if token is not None and token.is_valid(time.time_ns() // 1000):
            return token
        self._failures[client] += 1
        return None

    async def _read(self) -> None:
        self._read_s = time.monotonic()
        with suppress(LogError):  # those that are known stay so while it cannot be read
            tokens = await to_thread.run_sync(list_tokens, self._log, limiter=self._limiter)
            self._tokens = {one.digest: one for one in tokens}


def address_of(request: Request) -> str:
    """Give the address that a request comes from."""
    return request.client.host if request.client else ""


def bearer(request: Request) -> str:
    """Give the token of the `Authorization` header; empty if there is none."""
    scheme, _, secret = request.headers.get("authorization", "").partition(" ")
    return secret.strip() if scheme.lower() == "bearer" else ""


def unknown(detail: str) -> HTTPException:
    """Refuse who is not known."""
    return HTTPException(HTTPStatus.UNAUTHORIZED, detail, {"WWW-Authenticate": 'Bearer realm="dyknow"'})


def add_login(router: APIRouter) -> None:
    """Add the routes that turn a token into a cookie, for pages, which cannot send headers everywhere, and back."""

    @router.post("/login", status_code=204, responses=problems(401))
    async def login(request: Request) -> Response:
        """Turn the token of `Authorization: Bearer` into a cookie that is as good."""
        secret = bearer(request)
        if not secret:  # one that is no good was refused on the way here
            raise unknown("login: expected 'Authorization: Bearer TOKEN', got none")
        response = Response(status_code=204)
        response.set_cookie(COOKIE, secret, secure=request.url.scheme == "https", httponly=True, samesite="strict")
        return response

    @router.post("/logout", status_code=204, responses=problems())
    async def logout() -> Response:
        """Forget the cookie; the token stays good."""
        response = Response(status_code=204)
        response.delete_cookie(COOKIE, httponly=True, samesite="strict")
        return response


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
