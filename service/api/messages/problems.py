"""How does the HTTP interface say what went wrong? Every error is an RFC 9457 `application/problem+json` body.

The framework has its own bodies for wrong parameters, unknown paths and wrong methods; all of them are replaced here,
so that a client needs one way to read an error.
"""

import re
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

import msgspec
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware.body_limit import MAX_BODY_SIZE_SCOPE_KEY
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import Route

from chronicles.errors import ChronicleError
from dyknow.language.diagnostics import Diagnostic
from dyknow.language.rendering import render_json
from service.api.messages.bodies import Finding, Problem, ProblemDetail
from service.errors import (
    CrowdedError,
    CursorError,
    ExportError,
    ExtraMissingError,
    FilterError,
    InputError,
    LogError,
    NotInLogError,
    QueryError,
    TakenError,
    TextRefusedError,
    UnansweredError,
    VersionError,
)
from vision.errors import VisionError

MEDIA_TYPE = "application/problem+json"
REQUEST_ID = "dyknow.request_id"

_TOO_LARGE = "Content Too Large"  # as Starlette's limit of bodies says it
_FOLDERS = re.compile(r"(?:^|(?<=['\"]))/[^:'\"\n]*/|(?<=\blog ')[^'\n]*/|(?<![\w/:.'\"])/(?:[^\s/:'\"]+/)+")
BAD_PARAMETER = "urn:dyknow:problem:bad-parameter"

# What each error of ours is over HTTP. A chronicle error means that the log holds another version of the chronicle than
# this program understands, or not what it would need.
ANSWERS: Mapping[type[Exception], tuple[int, str]] = {
    CursorError: (400, "urn:dyknow:problem:bad-cursor"),
    FilterError: (400, "urn:dyknow:problem:bad-filter"),
    QueryError: (422, BAD_PARAMETER),
    LogError: (503, "urn:dyknow:problem:log-unavailable"),
    NotInLogError: (404, "urn:dyknow:problem:not-in-log"),
    UnansweredError: (503, "urn:dyknow:problem:unanswered"),
    CrowdedError: (503, "urn:dyknow:problem:crowded"),
    ChronicleError: (409, "urn:dyknow:problem:cannot-explain"),
    ExtraMissingError: (501, "urn:dyknow:problem:extra-missing"),
    ExportError: (409, "urn:dyknow:problem:cannot-export"),
    InputError: (409, "urn:dyknow:problem:unusable-input"),
    VisionError: (409, "urn:dyknow:problem:unusable-input"),
    TakenError: (409, "urn:dyknow:problem:taken"),
    TextRefusedError: (422, "urn:dyknow:problem:bad-chronicle"),
    VersionError: (412, "urn:dyknow:problem:other-version"),
}


def register_problems(app: FastAPI) -> None:
    """Answer every error of an application with a problem."""
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_exception_handler(ClientDisconnect, _on_cut)
    for kind in ANSWERS:
        app.add_exception_handler(kind, _on_ours)


def problem(
    request: Request,
    status: int,
    detail: str,
    *,
    kind: str = "about:blank",
    errors: Sequence[ProblemDetail] = (),
    findings: Sequence[Diagnostic] = (),
    headers: Mapping[str, str] | None = None,
) -> Response:
    """Build the answer for an error.

    Parameters
    ----------
    kind : a URN that tells errors of one status apart; `about:blank` if the status says it all.
    """
    body = Problem(
        type=kind,
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        instance=request.url.path,
        request_id=request.scope.get(REQUEST_ID, ""),
        errors=list(errors),
        findings=msgspec.json.decode(render_json(findings), type=list[Finding]),
    )
    return Response(msgspec.json.encode(body), status, headers, MEDIA_TYPE)


async def _on_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    details = [_describe(one) for one in error.errors()]
    summary = "; ".join(one.detail for one in details)
    return problem(request, 422, summary, kind=BAD_PARAMETER, errors=details)


def _describe(error: Mapping[str, Any]) -> ProblemDetail:  # Any: the framework's own error records
    if error["loc"] == ("body",) or error["type"] == "json_invalid":
        came = error.get("ctx", {}).get("error", error["input"])
        return ProblemDetail(f"body: expected a JSON object, as application/json, got {came!r}")
    parameter = ".".join(str(part) for part in error["loc"][1:2])
    if error["type"] == "missing":
        return ProblemDetail(f"{parameter}: expected a value, got none", parameter)
    said = error["msg"].removeprefix("Input should be ").replace("String should", "text to")
    wanted = "no such parameter" if error["type"] == "extra_forbidden" else said
    return ProblemDetail(f"{parameter}: expected {wanted}, got {error.get('input')!r}", parameter)


async def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return answer_refusal(request, error)


async def _on_cut(request: Request, error: Exception) -> Response:
    # Nobody hears this answer; it stands in the counts and in the audit.
    return problem(request, 400, "body: expected all of it, got a client that left")


def answer_refusal(request: Request, error: HTTPException) -> Response:
    """Answer what the framework, or a part before the routes, refuses."""
    method, path = request.method, request.url.path
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        allowed = _allowed(request)
        detail = f"{path}: expected method {allowed.replace(', ', ' or ')}, got {method!r}"
        return problem(request, 405, detail, headers={"Allow": allowed})
    if error.status_code == HTTPStatus.NOT_FOUND and error.detail == HTTPStatus.NOT_FOUND.phrase:
        detail = f"{path}: expected a path of this interface (see /api/v1), got an unknown one"
        return problem(request, 404, detail)
    if error.detail == _TOO_LARGE:
        most_bytes = request.scope[MAX_BODY_SIZE_SCOPE_KEY]
        return problem(request, error.status_code, f"body: expected at most {most_bytes} bytes, got more")
    return problem(request, error.status_code, str(error.detail), headers=error.headers)


def _allowed(request: Request) -> str:
    """Name the methods of a path; the framework would tell those of the first of its routes."""
    path = request.scope["route"].path
    routes = (one for one in request.app.router.routes if isinstance(one, Route) and one.path == path)
    names = {name for one in routes for name in one.methods or ()}
    return ", ".join(sorted(names | ({"HEAD"} if "GET" in names else set())))


async def _on_ours(request: Request, error: Exception) -> Response:
    status, kind = next(ANSWERS[one] for one in type(error).__mro__ if one in ANSWERS)
    details = [ProblemDetail(str(error), error.parameter)] if isinstance(error, QueryError) else []
    headers = {"Retry-After": "1"} if status == HTTPStatus.SERVICE_UNAVAILABLE else None
    findings = error.findings if isinstance(error, TextRefusedError) else ()
    detail = str(error) if isinstance(error, QueryError) else without_folders(str(error))
    return problem(request, status, detail, kind=kind, errors=details, findings=findings, headers=headers)


def without_folders(text: str) -> str:
    """Leave the names of files in a text: where they lie is the server's affair.

    A path with blanks is known as one at the beginning and between quotation marks.

    Examples
    --------
    >>> without_folders("/srv/my logs/day.db: expected a log, got '/srv/my logs/x.mp4', see /etc/a/b.toml:3")
    "day.db: expected a log, got 'x.mp4', see b.toml:3"
    >>> without_folders("log 'logs/day.db': expected a run 'a/b', got none")
    "log 'day.db': expected a run 'a/b', got none"
    """
    return _FOLDERS.sub("", text)


def answer_bug(request: Request) -> Response:
    """Answer where we failed: what went wrong inside stands in the server's own output, not here."""
    return problem(request, 500, f"{request.url.path}: expected an answer, got an internal error")
