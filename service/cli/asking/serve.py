"""`dyknow serve`: how is an event log asked over HTTP?"""

import ipaddress
import socket
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from service.cli.making.jobs import tell_line
from service.cli.options import LogName

PORT = 8420
BACKLOG = 128


def serve(
    log: LogName,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")] = PORT,
    workers: Annotated[int, typer.Option(min=0, max=1, help="Processes that work off the jobs of the log.")] = 1,
    webhooks: Annotated[Path | None, typer.Option(help="File of webhooks, to which events are posted.")] = None,
    uploads: Annotated[Path | None, typer.Option(help="Folder for videos that clients upload.")] = None,
    upload_gb: Annotated[float, typer.Option(min=0.0, help="Size of an upload at most, in GB.")] = 20.0,
    allow_folder: Annotated[
        list[Path] | None, typer.Option(help="Folder whose files clients may have processed; repeat for several.")
    ] = None,
    media: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", exists=True, file_okay=False, help="Folder whose videos may be sent."),
    ] = None,
) -> None:
    """Answer questions to an event log over HTTP, and process what is queued for it, until interrupted."""
    from service.api.app import Server, create_app
    from service.api.source_files import SourceFolders
    from service.api.webhooks import delivering, load_webhooks
    from service.errors import InputError, LogError
    from service.runs.supervision import kept_working
    from service.store.databases.location import database_of, shown

    for folder in (*([uploads] if uploads else []), *(allow_folder or ())):
        if not folder.is_dir():
            raise InputError(f"{folder}: expected a folder, got none")
    app = create_app(
        log, folders=SourceFolders(uploads, upload_gb, tuple(allow_folder or ())), media_folders=media or ()
    )
    can_write = database_of(log).can_write()
    declared = load_webhooks(webhooks) if webhooks else []
    if declared and not can_write:
        expected = "expected one that can be written, as it keeps how far webhooks are"
        raise LogError(f"log {shown(log)!r}: {expected}, got one that can only be read")
    with listen(host, port) as listener, ExitStack() as open_while_serving:
        url = f"http://{_in_url(host)}:{listener.getsockname()[1]}"
        print(f"serving {shown(log)} at {url}/api/v1/events  (Ctrl-C stops)", file=sys.stderr, flush=True)
        if not _is_loopback(host):
            print(f"warning: everyone who reaches {host} can read this log", file=sys.stderr, flush=True)
        server = Server(app)
        open_while_serving.enter_context(delivering(declared, log, tell_line))
        if workers and can_write:
            open_while_serving.enter_context(kept_working(log, tell_line))
        server.run(sockets=[listener])
        if server.started:
            # It ends only when it is interrupted, but the loop does not always pass that on.
            raise KeyboardInterrupt


def listen(host: str, port: int) -> socket.socket:
    """Open a listening socket.

    Raises
    ------
    ServiceError
        If the address is unknown, taken, or not ours to listen on.
    """
    from service.errors import ServiceError

    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        # The protocol is named because asyncio switches off Nagle's algorithm only on sockets that are plainly TCP;
        # without that every answer waits 40 ms for the client's delayed acknowledgement.
        listener = socket.socket(family, kind, protocol)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(BACKLOG)
        except OSError:
            listener.close()
            raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise ServiceError(f"{host}:{port}: expected a free address to listen on, got {reason!r}") from error
    return listener


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host
