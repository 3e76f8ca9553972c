"""How do routes answer, and how are their answers described?

The answers are encoded by msgspec and never pass through the framework's models, so their schemas come from msgspec
too: the description cannot drift from what is sent.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final
from urllib.parse import urlencode

import msgspec
from starlette.responses import Response

from service.api.messages.bodies import Problem
from service.api.messages.parameters import JsonObject, Pairs
from service.api.messages.problems import MEDIA_TYPE

Answers = dict[int | str, JsonObject]

JSON: Final = "application/json"
EXPLANATION = "Explanation"  # its schema comes with the chronicles
REFERENCE = "#/components/schemas/{name}"

TEXT_BODY = {"requestBody": {"content": {"text/plain": {"schema": {"type": "string"}}}}}
VIDEO_BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": {"schema": {}}}}}


def answers(
    body: type[msgspec.Struct] | str, *errors: int, media_type: str = JSON, status: int = 200, also: str = ""
) -> Answers:
    """Describe the answers of a route: its body, a struct or the name of a schema, and the errors it may give.

    `also` is the media type of another form of the body, if there is one.
    """
    schema = _reference(body) if isinstance(body, str) else msgspec.json.schema(body, ref_template=REFERENCE)
    content = {media_type: {"schema": schema}} | ({also: {}} if also else {})
    return {status: {"description": "OK", "content": content}} | problems(*errors)


def file_answers(media_types: Iterable[str], *errors: int, statuses: Sequence[int] = (200,)) -> Answers:
    """Describe the answers of a route that sends a file of one of some media types."""
    sent = {"description": "OK", "content": {one: {} for one in media_types}}
    return dict.fromkeys(statuses, sent) | problems(*errors)


def problems(*errors: int) -> Answers:
    """Describe the errors of a route: its own, and the others as any problem, since each path may give those."""
    described = {"description": "Problem", "content": {MEDIA_TYPE: {"schema": _reference(Problem.__name__)}}}
    return dict.fromkeys((*errors, "default"), described)


def _reference(name: str) -> JsonObject:
    return {"$ref": REFERENCE.format(name=name)}


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
