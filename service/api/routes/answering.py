"""How do routes answer?"""

from collections.abc import Mapping
from typing import Final
from urllib.parse import urlencode

import msgspec
from starlette.responses import Response

from service.api.parameters import Pairs

JSON: Final = "application/json"


def link_to_next(path: str, pairs: Pairs, cursor: str | None) -> dict[str, str]:
    """Give the header that leads to the next page; none from the last one.

    Parameters
    ----------
    pairs : the parameters of this page.
    """
    if cursor is None:
        return {}
    query = urlencode([*(pair for pair in pairs if pair[0] != "cursor"), ("cursor", cursor)])
    return {"Link": f'<{path}?{query}>; rel="next"'}


def json_answer(body: msgspec.Struct | bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with a struct, or with JSON that is encoded already."""
    return Response(body if isinstance(body, bytes) else msgspec.json.encode(body), status, headers, JSON)
