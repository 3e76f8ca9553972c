"""How do routes read bodies and answer, and what do they all refuse?"""

from typing import Final, TypeVar

import msgspec
from fastapi import HTTPException, Request
from starlette.responses import Response

from service.errors import QueryError

JSON: Final = "application/json"
MAX_TEXT_BYTES = 256_000

_Body = TypeVar("_Body", bound=msgspec.Struct)


def json_answer(body: msgspec.Struct | bytes) -> Response:
    """Answer with a struct, or with JSON that is encoded already."""
    return Response(body if isinstance(body, bytes) else msgspec.json.encode(body), media_type=JSON)


def refuse_parameters(request: Request, *, but: str | None = None) -> None:
    """Refuse parameters that are not taken, where one is at most: one that restricts nothing was meant to."""
    names = [name for name, _ in request.query_params.multi_items()]
    for name in names if names != [but] else ():
        raise QueryError(
            f"query: expected {'one ' + but if but else 'no parameter'}, got {', '.join(map(repr, names))}",
            parameter=name,
        )


async def read_json(request: Request, kind: type[_Body]) -> _Body:
    """Read the body of a request as JSON.

    Raises
    ------
    HTTPException
        If it is too large: 413.
    QueryError
        If it is no such struct; the message says where.
    """
    text = await read_text(request, 3 * MAX_TEXT_BYTES)  # of two texts, as JSON writes them
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError as error:
        raise QueryError(f"body: expected {kind.__name__} as JSON, got {error}", parameter="body") from error


async def read_text(request: Request, most_bytes: int = MAX_TEXT_BYTES) -> str:
    """Read the body of a request as a text.

    Raises
    ------
    HTTPException
        If it is too large: 413.
    QueryError
        If it is not UTF-8.
    """
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > most_bytes:
            raise HTTPException(413, f"body: expected at most {most_bytes} bytes, got more")
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise QueryError(f"body: expected UTF-8 text, got byte {body[error.start]:#04x}", parameter="body") from error
