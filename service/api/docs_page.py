"""Where does somebody try the interface by hand? At `/docs`: Swagger UI, with all of its files from this server."""

import base64
import hashlib
import re

from fastapi import FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from starlette.responses import HTMLResponse
from starlette.staticfiles import StaticFiles

# It may load from this server and ask it, and nobody else; Swagger UI draws its icons from data addresses.
_POLICY = (
    "default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


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
