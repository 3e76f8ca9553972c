"""How do routes answer?"""

from collections.abc import Mapping
from typing import Final

import msgspec
from starlette.responses import Response

JSON: Final = "application/json"


def json_answer(body: msgspec.Struct | bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with a struct, or with JSON that is encoded already."""
    return Response(body if isinstance(body, bytes) else msgspec.json.encode(body), status, headers, JSON)
