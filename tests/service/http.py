"""A client for an ASGI application, without sockets, and a server of one where answers have no end.

All clients share one event loop: the processes that answer what takes long stay with it, and none begins anew.
"""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from types import TracebackType
from typing import Any, Self  # Any: JSON, and httpx's own arguments

import httpx
from anyio.from_thread import BlockingPortal, start_blocking_portal
from fastapi import FastAPI

from service.api.app import Server
from service.cli.operating.serve import listen

_LOOP = ExitStack()


@cache
def _portal() -> BlockingPortal:
    return _LOOP.enter_context(start_blocking_portal())


def close_loop() -> None:
    """End the event loop of the clients, and the processes that stayed with it."""
    _LOOP.close()
    _portal.cache_clear()


class Client:
    """Send requests to an application that is started on entering and stopped on leaving.

    An error that the application does not answer comes as its 500, as over a socket.
    """

    def __init__(self, app: FastAPI) -> None:
        self._lifespan = app.router.lifespan_context(app)
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        self._client = httpx.AsyncClient(transport=transport, base_url="http://localhost")
        self._open = ExitStack()

    def request(self, method: str, path: str, **arguments: Any) -> httpx.Response:
        return self._portal.call(partial(self._client.request, method, path, **arguments))

    def get(self, path: str, **arguments: Any) -> httpx.Response:
        return self.request("GET", path, **arguments)

    def __enter__(self) -> Self:
        self._portal = _portal()
        self._open.enter_context(self._portal.wrap_async_context_manager(self._lifespan))
        self._open.enter_context(self._portal.wrap_async_context_manager(self._client))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._open.close()


@contextmanager
def serving(app: FastAPI) -> Iterator[tuple[Server, str]]:
    """Serve an application on a free port; give the server and its address."""
    server = Server(app)
    with listen("127.0.0.1", 0) as listener:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            yield server, f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join()
