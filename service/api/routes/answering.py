"""How do routes answer, and what do they all refuse?"""

from typing import Final

import msgspec
from fastapi import Request
from starlette.responses import Response

from service.errors import QueryError

JSON: Final = "application/json"


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
