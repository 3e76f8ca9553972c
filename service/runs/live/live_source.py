"""What sends video, or rows, now? An address, a device, a pipe: opened within seconds, and watched for silence."""

import os
import re
import select
import threading
from concurrent.futures import Future, wait
from contextlib import suppress
from io import FileIO
from os.path import expandvars
from pathlib import Path
from urllib.parse import urlsplit, urlunsplit

import av
from av.container import InputContainer
from av.video.stream import VideoStream

from service.errors import InputError

OPENED_WITHIN_S, SILENT_FOR_S, LOOKED_EVERY_S = 10.0, 5.0, 0.2
# What MPEG-TS carries; other packets cannot be copied.
CARRIED = frozenset({"h264", "hevc", "mpeg1video", "mpeg2video", "mpeg4"})
_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")
_NAMED = re.compile(r"\$(\w+|\{\w+\})")


class Pipe(FileIO):
    """A pipe that is read until it is over, or nobody wants more of it; until then a read waits, also for a writer.

    Parameters
    ----------
    text : the path of a named pipe, or ``-`` for standard input.
    ended : set it so that whoever reads gets an end.

    Attributes
    ----------
    has_come : whether there was anything to read.
    """

    def __init__(self, text: str, ended: threading.Event) -> None:
        # To open a pipe waits for its writer otherwise, and nothing ends that.
        super().__init__(
            os.dup(0) if text == "-" else text, opener=lambda path, how: os.open(path, how | os.O_NONBLOCK)
        )
        self._ended = ended
        self.has_come = False

    def read(self, size: int | None = -1, /) -> bytes:
        """Read what there is, at most so many bytes; nothing at the end."""
        data = None  # as when another reader was faster
        while data is None and not self._ended.is_set():
            if select.select([self], [], [], LOOKED_EVERY_S)[0]:
                data = super().read(size)
        self.has_come |= bool(data)
        return data or b""


class LiveSource:
    """Name a live source; close it when all that was opened is done with.

    Parameters
    ----------
    text : an address, the path of a device or named pipe, or ``-`` for standard input; ``$NAME`` in it is what that
        variable of the environment says, as a user and a password.

    Attributes
    ----------
    shown : the text without a password.
    ends : whether its end is the end; else it is expected to come back.
    ended : set it when nobody wants more of it.

    Raises
    ------
    InputError
        If it is a file, which `dyknow process` reads, or missing; if the environment does not say who asks.
    """

    def __init__(self, text: str) -> None:
        if _NAMED.fullmatch(login := _login(text)) and expandvars(login) == login:
            raise InputError(f"{text}: expected a variable of the environment, got {login}, which is not set")
        self._text = expandvars(text)
        self.shown = without_password(text)
        path = Path(text)
        is_address = _ADDRESS.match(text) is not None
        if not is_address and text != "-":
            if not path.exists():
                raise InputError(f"{text}: expected an address, a device, a pipe or -, got no such file")
            if path.is_file() or path.is_dir():
                raise InputError(f"{text}: expected a live source, got a file; dyknow process reads it")
        self.ends = text == "-" or path.is_fifo()
        self.ended = threading.Event()
        self._pipe: Pipe | None = None

    def close(self) -> None:
        """Close the pipe, if it is one."""
        if self._pipe:
            self._pipe.close()

    def open(self) -> tuple[InputContainer, VideoStream]:
        """Connect; close the container when done.

        Raises
        ------
        InputError
            If nothing answers in time, or what comes is no video that can be recorded; if nobody wants it any more.
        """
        try:
            container = self._opened()
        except (av.FFmpegError, OSError) as error:
            came = "nothing" if self._pipe and not self._pipe.has_come else what_came(error)
            raise InputError(f"{self.shown}: expected live video, got {came}") from None
        stream = next(iter(container.streams.video), None)
        codec = "no video" if stream is None else stream.codec_context.name
        if stream is None or codec not in CARRIED:
            container.close()
            raise InputError(f"{self.shown}: expected video in one of {', '.join(sorted(CARRIED))}, got {codec}")
        return container, stream

    def _opened(self) -> InputContainer:
        """Open a pipe here, and anything else on a thread that is left to itself once nobody wants it any more.

        FFmpeg gives up by itself, but asks nobody meanwhile; a thread of a pool would be waited for.
        """
        if self.ends:
            return av.open(self.open_pipe(), "r")
        options = {"rtsp_transport": "tcp"} if self._text.startswith("rtsp") else {}
        device = "v4l2" if Path(self._text).is_char_device() else None
        found = Future[InputContainer]()

        def connect() -> None:
            try:
                limits = OPENED_WITHIN_S, SILENT_FOR_S
                found.set_result(av.open(self._text, "r", format=device, options=options, timeout=limits))
            except Exception as error:
                found.set_exception(error)

        threading.Thread(target=connect, daemon=True).start()
        while not found.done() and not self.ended.is_set():
            wait([found], LOOKED_EVERY_S)
        if found.done():
            return found.result()
        found.add_done_callback(_close)
        raise InputError(f"{self.shown}: expected live video, got an end before it came")

    def open_pipe(self) -> Pipe:
        """Open a pipe; raises `InputError` if it is none."""
        if not self.ends:
            raise InputError(f"{self.shown}: expected a pipe or - for rows, got another source")
        self._pipe = Pipe(self._text, self.ended)
        return self._pipe


def _close(found: "Future[InputContainer]") -> None:
    if found.exception() is None:
        found.result().close()


def what_came(error: av.FFmpegError | OSError) -> str:
    """Say what came instead of video."""
    return "nothing in time" if isinstance(error, av.ExitError) else error.strerror or str(error)


def kept_name(text: str) -> str:
    """Name a live source for a worker, which has another working folder.

    Raises
    ------
    InputError
        If the name has a password in it, or is that of this process' input.
    """
    if text == "-":
        raise InputError("-: expected a source that a worker reaches, got the input of this command")
    if (login := _login(text)) and not _NAMED.fullmatch(login):
        wanted = "expected who asks from the environment, as in rtsp://$NAME@..."
        raise InputError(f"{without_password(text)}: {wanted}, got a login that the log would keep")
    return text if _ADDRESS.match(text) else str(Path(text).absolute())


def without_password(address: str) -> str:
    """Leave out who may ask, for what is shown and kept.

    Examples
    --------
    >>> without_password("rtsp://me:secret@camera.example:554/1")
    'rtsp://camera.example:554/1'
    """
    with suppress(ValueError):
        parts = urlsplit(address)
        if "@" in parts.netloc:
            return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))
    return address


def _login(address: str) -> str:
    with suppress(ValueError):
        return urlsplit(address).netloc.rpartition("@")[0]
    return ""
