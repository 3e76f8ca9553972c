"""How does a page carry a token, which cannot send headers everywhere? In a cookie that scripts do not see."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from service.api.access.callers import COOKIE, bearer, unknown
from service.api.messages.answers import problems


def add_login(router: APIRouter) -> None:
    """Add the routes that turn a token into a cookie, and back."""

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
