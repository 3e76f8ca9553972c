"""How is the interface described? By `/openapi.json`, and by a page `/docs` from which it can be tried by hand."""

import base64
import hashlib
import re

import msgspec
from fastapi import FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from starlette.responses import HTMLResponse
from starlette.staticfiles import StaticFiles

from chronicles.explanation.json_form import schema as explanation_schema
from service.api.access.callers import COOKIE
from service.api.messages.answers import EXPLANATION, REFERENCE
from service.api.messages.bodies import Problem
from service.api.messages.parameters import JsonObject
from service.questions.observations.coverage import LookedAt

_FOREIGN = ("HTTPValidationError", "ValidationError")  # the framework's own, which we never send
_SECURITY = {
    "token": {"type": "http", "scheme": "bearer"},
    "cookie": {"type": "apiKey", "in": "cookie", "name": COOKIE},
}

# It may load from this server and ask it, and nobody else; Swagger UI draws its icons from data addresses.
_POLICY = (
    "default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def describe_bodies(app: FastAPI) -> None:
    """Put the schemas of the bodies into an application's OpenAPI description."""
    describe = app.openapi

    def openapi() -> JsonObject:
        """Describe the interface, once, with the schemas of the structs sent."""
        if not app.openapi_schema:
            document = describe()
            _, components = msgspec.json.schema_components([Problem], ref_template=REFERENCE)
            own = {name: one for name, one in document["components"]["schemas"].items() if name not in _FOREIGN}
            own_references = f"{REFERENCE.format(name=EXPLANATION)}/$defs/"
            text = msgspec.json.encode(explanation_schema()).decode().replace("#/$defs/", own_references)
            explanation = msgspec.json.decode(text)
            looked_at = {"type": "array", "items": msgspec.json.schema(LookedAt)["$defs"][LookedAt.__name__]}
            explanation["$defs"]["why_not"]["properties"]["looked_at"] = looked_at  # which the server adds
            components[EXPLANATION] = explanation
            document["components"] = {"schemas": {**own, **components}}
            document["components"]["securitySchemes"] = _SECURITY
            document["security"] = [{}, *({name: []} for name in _SECURITY)]  # a server may ask for none
            for path in document["paths"].values():
                for operation in path.values():
                    operation["summary"] = operation["description"].partition("\n")[0]
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


def add_docs(app: FastAPI) -> None:
    """Add the page `/docs`, and its files below it, to an application that has `/openapi.json`.

    Addresses are relative, so the page also works behind a proxy that serves the application below a path.
    """
    page = get_swagger_ui_html(
        openapi_url="openapi.json",
        title=f"{app.title}: the interface",
        swagger_js_url="docs/swagger-ui-bundle.js",
        swagger_css_url="docs/swagger-ui.css",
        swagger_favicon_url="docs/favicon.png",
    )
    [script] = re.findall(rb"<script>(.*?)</script>", bytes(page.body), re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script).digest()).decode()
    policy = {"Content-Security-Policy": _POLICY.format(digest=digest)}

    # A new answer each time: what compresses it writes into its headers.
    app.add_api_route("/docs", lambda: HTMLResponse(page.body, headers=policy), include_in_schema=False)
    app.mount("/docs", StaticFiles(packages=[("fastapi_offline", "static")]))
