"""What does `/openapi.json` say? The framework's description, with bodies taken from the structs that are sent.

The answers are encoded by msgspec and never pass through the framework's models, so their schemas come from msgspec
too: the description cannot drift from what is sent.
"""

from typing import Any  # JSON schemas have no narrower type

import msgspec
from fastapi import FastAPI

from service.api.bodies import ChronicleList, EventList, Index, Problem
from service.api.problems import MEDIA_TYPE
from service.records import EventRecord

JsonObject = dict[str, Any]

_BODIES = (EventList, EventRecord, ChronicleList, Index, Problem)
_REF = "#/components/schemas/{name}"


def answers(body: type[msgspec.Struct], *errors: int) -> dict[int | str, JsonObject]:
    """Describe the answers of a route: its body, and the errors it may give."""
    described: dict[int | str, JsonObject] = {
        200: {"description": "OK", "content": {"application/json": {"schema": _ref(body)}}}
    }
    for status in (*errors, 500, 503):
        described[status] = {"description": "Problem", "content": {MEDIA_TYPE: {"schema": _ref(Problem)}}}
    return described


def describe_bodies(app: FastAPI) -> None:
    """Put the schemas of the bodies into an application's OpenAPI description."""
    describe = app.openapi

    def openapi() -> JsonObject:
        """Describe the interface, once, with the schemas of the structs sent."""
        if not app.openapi_schema:
            document = describe()
            _, components = msgspec.json.schema_components(_BODIES, ref_template=_REF)
            document["components"] = {"schemas": components}
            for path in document["paths"].values():
                _drop_foreign_errors(path["get"]["responses"])
        return app.openapi_schema or document

    app.openapi = openapi  # type: ignore[method-assign]  # the framework's documented way to extend it


def _drop_foreign_errors(responses: JsonObject) -> None:
    """Take out the framework's own 422, which it adds to every path with a variable part and we never send."""
    if "application/json" in responses.get("422", {}).get("content", {}):
        del responses["422"]


def _ref(body: type[msgspec.Struct]) -> JsonObject:
    return {"$ref": _REF.format(name=body.__name__)}
