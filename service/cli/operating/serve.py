"""`dyknow serve`: how is an event log asked over HTTP?"""

import re
import socket
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from service.cli.making.jobs import LiveSources, tell_line
from service.cli.options import LogName, open_log
from service.cli.printing import tell
from service.errors import InputError, LogError, ServiceError
from service.store.databases.location import database_of, shown

PORT = 8420
BACKLOG = 128


def serve(
    log: LogName,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")] = PORT,
    workers: Annotated[int, typer.Option(min=0, max=1, help="Processes that work off the jobs of the log.")] = 1,
    live: LiveSources = 0,
    webhooks: Annotated[Path | None, typer.Option(help="File of webhooks, to which events are posted.")] = None,
    uploads: Annotated[Path | None, typer.Option(help="Folder for videos that clients upload.")] = None,
    upload_gb: Annotated[float, typer.Option(min=0.0, help="Size of an upload at most, in GB.")] = 20.0,
    allow_folder: Annotated[
        list[Path] | None, typer.Option(help="Folder whose files clients may have processed; repeat for several.")
    ] = None,
    camera: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=ADDRESS", help="Live source that clients may have watched; repeat for several."),
    ] = None,
    recordings: Annotated[Path | None, typer.Option(help="Folder for what these cameras send.")] = None,
    media: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", exists=True, file_okay=False, help="Folder whose videos may be sent."),
    ] = None,
    require_token: Annotated[
        bool, typer.Option("--require-token", help="Ask for a token on this machine too, as behind a proxy.")
    ] = False,
    most_at_once: Annotated[
        int, typer.Option(min=1, help="Requests of a client that are answered at the same time.")
    ] = 200,
    allow_host: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Name by which the server may be called; may be repeated.")
    ] = None,
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(metavar="ORIGIN", help="Page elsewhere that may ask, https://HOST; may be repeated."),
    ] = None,
) -> None:
    """Answer questions to an event log over HTTP, and process what is queued for it, until interrupted."""
    from msgspec.structs import replace

    from service.api.access.settings import Access
    from service.api.app import Server, create_app
    from service.api.delivery.webhooks import delivering, load_webhooks
    from service.api.source_files import SourceFolders
    from service.runs.jobs.worker import kept_working
    from service.store.entries import JobKind

    for folder in (*([uploads] if uploads else []), *(allow_folder or ())):
        if not folder.is_dir():
            raise InputError(f"{folder}: expected a folder, got none")
    access = Access.at(host, hosts=allow_host or (), origins=allow_origin or (), needs_token=require_token)
    access = replace(access, most_at_once=most_at_once)
    if access.needs_token:
        check_tokens(log, host)
    if camera and recordings is None:
        raise typer.BadParameter("--camera: expected --recordings to go with it, got none")
    cameras = named_cameras(camera or ())
    folders = SourceFolders(uploads, upload_gb, tuple(allow_folder or ()), cameras, recordings or Path())
    app = create_app(log, folders=folders, media_folders=media or (), access=access)
    can_write = database_of(log).can_write()
    declared = load_webhooks(webhooks) if webhooks else []
    if declared and not can_write:
        expected = "expected one that can be written, as it keeps how far webhooks are"
        raise LogError(f"log {shown(log)!r}: {expected}, got one that can only be read")
    with listen(host, port) as listener, ExitStack() as open_while_serving:
        url = f"http://{_in_url(host)}:{listener.getsockname()[1]}"
        print(f"serving {shown(log)} at {url}/api/v1/events  (Ctrl-C stops)", file=sys.stderr, flush=True)
        if access.needs_token and not require_token:
            tell("warning", ["what is sent is not encrypted; a proxy with TLS before the server does that"])
        folders.hold()
        server = Server(app)
        open_while_serving.enter_context(delivering(declared, log, tell_line))
        most: dict[JobKind, int] = {"run": workers, "live": live} if can_write else {}
        for kind in (kind for kind, count in most.items() for _ in range(count)):
            open_while_serving.enter_context(kept_working(log, kind, tell_line))
        server.run(sockets=[listener])
        if server.started:
            # It ends only when it is interrupted, but the loop does not always pass that on.
            raise KeyboardInterrupt


def named_cameras(texts: "Sequence[str]") -> dict[str, str]:
    """Read which cameras may be watched, by name.

    Raises
    ------
    typer.BadParameter
        If one is not ``NAME=ADDRESS``, or a name comes twice.
    InputError
        If an address has a password in it.

    Examples
    --------
    >>> named_cameras(["north=rtsp://$NORTH@10.0.0.3/1"])
    {'north': 'rtsp://$NORTH@10.0.0.3/1'}
    """
    from service.api.messages.asked import SOURCE_NAME
    from service.runs.live.live_source import kept_name, without_password

    cameras: dict[str, str] = {}
    for text in texts:
        name, _, address = text.partition("=")
        if not (re.fullmatch(SOURCE_NAME, name) and address) or name in cameras:
            raise typer.BadParameter(f"--camera: expected NAME=ADDRESS, each name once, got {without_password(name)!r}")
        cameras[name] = kept_name(address)
    return cameras


def check_tokens(log: str, host: str) -> None:
    """Refuse to serve a log that nobody could ask.

    Raises
    ------
    ServiceError
        If it has no token that is valid.
    """
    from service.store.registers.access import list_tokens

    now_us = time.time_ns() // 1000
    with open_log(log) as opened:
        if any(one.is_valid(now_us) for one in list_tokens(opened)):
            return
    wanted = f"{host}: expected a log with a token that is valid, as whoever asks here needs one, got none"
    raise ServiceError(f"{wanted}; make one: dyknow token make {shown(log)} NAME")


def listen(host: str, port: int) -> socket.socket:
    """Open a listening socket.

    Raises
    ------
    ServiceError
        If the address is unknown, taken, or not ours to listen on.
    """
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


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host
