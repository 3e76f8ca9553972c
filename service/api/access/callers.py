"""Who is asking? The token of a request, looked up among those of the log; a page has it in a cookie.

Tokens are kept in memory, and read again when one is unknown or a second has passed: no request waits for the threads
that answer questions, and one that is revoked ends within a second.
"""

import time
from collections import Counter
from contextlib import suppress
from http import HTTPStatus

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Request
from starlette.exceptions import HTTPException
from starlette.responses import Response

from service.api.messages.answers import problems
from service.errors import LogError
from service.store.entries import Token
from service.store.log import EventLog
from service.store.registers.access import digest_of, list_tokens

COOKIE = "dyknow_token"
LOOPBACK = Token("loopback", "", "admin", 0)
"""Who needs no token."""

READ_EVERY_S = 1.0
MOST_FAILURES = 10
FAILURES_WITHIN_S = 60


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
