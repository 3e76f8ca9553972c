"""What does `/openapi.json` say? The framework's description, with bodies taken from the structs that are sent.

The answers are encoded by msgspec and never pass through the framework's models, so their schemas come from msgspec
too: the description cannot drift from what is sent.
"""

from typing import Any  # JSON schemas have no narrower type

import msgspec
from fastapi import FastAPI

from chronicles.explanation.json_form import schema as explanation_schema
from service.api.access.callers import COOKIE
from service.api.bodies import Problem
from service.api.problems import MEDIA_TYPE
from service.questions.coverage import LookedAt

JsonObject = dict[str, Any]
Answers = dict[int | str, JsonObject]

_JSON = "application/json"
EXPLANATION = "Explanation"  # its schema comes with the chronicles, and has an identifier so that its references hold
FINDINGS = "Findings"
_FOREIGN = ("HTTPValidationError", "ValidationError")  # the framework's own, which we never send
_SECURITY = {
    "token": {"type": "http", "scheme": "bearer"},
    "cookie": {"type": "apiKey", "in": "cookie", "name": COOKIE},
}
_REF = "#/components/schemas/{name}"

_POSITION = {"type": "object", "properties": {"line": {"type": "integer"}, "character": {"type": "integer"}}}
_RANGE = {"type": "object", "properties": {"start": _POSITION, "end": _POSITION}}
_FINDINGS_SCHEMA: JsonObject = {
    "type": "object",
    "description": "Errors and warnings of a chronicle text; ranges as in the Language Server Protocol.",
    "required": ["findings"],
    "properties": {
        "findings": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {
                    "code": {"type": "string"},
                    "severity": {"enum": ["error", "warning"]},
                    "message": {"type": "string"},
                    "file": {"type": "string"},
                    "range": _RANGE,
                    "hint": {"type": "string"},
                    "edit": {
                        "type": ["object", "null"],
                        "properties": {"range": _RANGE, "newText": {"type": "string"}},
                    },
                    "related": {"type": "array", "items": {"type": "object"}},
                },
            },
        }
    },
}

TEXT_BODY = {"requestBody": {"content": {"text/plain": {"schema": {"type": "string"}}}}}
VIDEO_BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": {"schema": {}}}}}


def answers(
    body: type[msgspec.Struct] | str, *errors: int, media_type: str = _JSON, status: int = 200, also: str = ""
) -> Answers:
    """Describe the answers of a route: its body, a struct or the name of a schema, and the errors it may give.

    `also` is the media type of another form of the body, if there is one.
    """
    schema = _ref(body) if isinstance(body, str) else msgspec.json.schema(body, ref_template=_REF)
    content = {media_type: {"schema": schema}} | ({also: {}} if also else {})
    return {status: {"description": "OK", "content": content}} | problems(*errors)


def problems(*errors: int) -> Answers:
    """Describe the errors of a route: its own, and the others as any problem, since each path may give those."""
    described = {"description": "Problem", "content": {MEDIA_TYPE: {"schema": _ref(Problem.__name__)}}}
    return dict.fromkeys((*errors, "default"), described)


def describe_bodies(app: FastAPI) -> None:
    """Put the schemas of the bodies into an application's OpenAPI description."""
    describe = app.openapi

    def openapi() -> JsonObject:
        """Describe the interface, once, with the schemas of the structs sent."""
        if not app.openapi_schema:
            document = describe()
            _, components = msgspec.json.schema_components([Problem], ref_template=_REF)
            own = {name: one for name, one in document["components"]["schemas"].items() if name not in _FOREIGN}
            explanation = {"$id": "urn:dyknow:schema:explanation", **explanation_schema()}
            looked_at = {"type": "array", "items": msgspec.json.schema(LookedAt)["$defs"][LookedAt.__name__]}
            explanation["$defs"]["why_not"]["properties"]["looked_at"] = looked_at  # which the server adds
            components |= {EXPLANATION: explanation, FINDINGS: _FINDINGS_SCHEMA}
            document["components"] = {"schemas": {**own, **components}}
            document["components"]["securitySchemes"] = _SECURITY
            document["security"] = [{}, *({name: []} for name in _SECURITY)]  # a server may ask for none
            for path in document["paths"].values():
                for operation in path.values():
                    _drop_foreign_errors(operation["responses"])
                    for answer in operation["responses"].values():
                        for content in answer.get("content", {}).values():
                            document["components"]["schemas"] |= content.get("schema", {}).pop("$defs", {})
        return app.openapi_schema or document

    app.openapi = openapi  # type: ignore[method-assign]  # the framework's documented way to extend it


def _drop_foreign_errors(responses: JsonObject) -> None:
    """Take out the framework's own 422, which it adds to every path with a variable part and we never send."""
    if "application/json" in responses.get("422", {}).get("content", {}):
        del responses["422"]


def _ref(name: str) -> JsonObject:
    return {"$ref": _REF.format(name=name)}
