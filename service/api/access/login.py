"""How does a page carry a token, which cannot send headers everywhere? In a cookie that scripts do not see."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from service.api.access.callers import COOKIE, bearer, unknown
from service.api.messages.answers import problems


def add_login(router: APIRouter) -> None:
    """Add the routes that turn a token into a cookie, and back."""

    @router.post(
        "/login",
        status_code=204,
        summary="Turn a token into a cookie",
        description="The token is that of `Authorization: Bearer`.",
        responses=problems(401),
    )
    async def login(request: Request) -> Response:
        """Set a cookie that is as good as the token that was sent, which was found good on the way here."""
        secret = bearer(request)
        if not secret:
            raise unknown("login: expected 'Authorization: Bearer TOKEN', got none")
        response = Response(status_code=204)
        response.set_cookie(COOKIE, secret, secure=request.url.scheme == "https", httponly=True, samesite="strict")
        return response

    @router.post("/logout", status_code=204, summary="Forget the cookie", responses=problems())
    async def logout() -> Response:
        """Take the cookie away; the token stays good."""
        response = Response(status_code=204)
        response.delete_cookie(COOKIE, httponly=True, samesite="strict")
        return response
