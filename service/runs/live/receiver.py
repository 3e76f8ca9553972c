"""How does a source stay connected? What arrives is recorded; when it stops, it is called again, at growing pauses.

Rows come through a pipe, whole lines at a time, and are recorded without a call.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import av
from av.container import InputContainer
from av.packet import Packet
from av.video.stream import VideoStream

from service.errors import InputError
from service.runs.live.live_source import SILENT_FOR_S, LiveSource, what_came
from service.runs.live.recording_writer import RecordingWriter, folder_name

FIRST_PAUSE_S, MOST_PAUSE_S = 0.5, 30.0
JUMP_US = 10_000_000
"""Time stamps that go back, or on by more than this, are those of another clock."""

Tell = Callable[[str], None]
Connection = tuple[InputContainer, VideoStream]
_LONGEST_LINE = 1 << 20  # bytes


class Receiver:
    """Record a source into one recording after the other.

    Parameters
    ----------
    source : what to record.
    connection : to it, the first one.
    folder : of the recordings.
    longest_us : so long is a recording at most, in media time, and a minute.
    most_bytes : that large is a recording at most, and a minute.
    tell : gets a line when the source is cut or back.

    Attributes
    ----------
    tell : as given.
    """

    def __init__(
        self, source: LiveSource, connection: Connection, folder: Path, *, longest_us: int, most_bytes: int, tell: Tell
    ) -> None:
        self.tell = tell
        self._source, self._first, self._folder = source, connection, folder
        self._longest_us, self._most_bytes = longest_us, most_bytes
        self._writer: RecordingWriter  # from the first connection on
        self._kind = ("", 0, 0)
        self._arrived_s = 0.0  # the newest packet, by a clock that nobody sets
        self._start_us, self._why = 0, ""  # of the next connection, and what ended the one before

    def record(self, begin: Callable[[Path], None]) -> None:
        """Record until the source is `ended`, or until a source that does not come back is over.

        Parameters
        ----------
        begin : gets the folder of each recording, once there is something in it.
        """
        self._begin(self._first[1])
        try:
            current: Connection | None = self._first
            while current is not None:
                container, stream = current
                if _kind(stream) != self._kind:
                    self._writer.close()
                    self._begin(stream)
                with closing(container):
                    self._record(container, stream, begin)
                if self._source.ended.is_set() or self._source.ends:
                    return
                self.tell(f"{self._source.shown}: {self._why}; called again")
                current = self._again()
                if self._writer.last_us >= 0:  # else media time has not begun
                    since_us = max(1, round((time.monotonic() - self._arrived_s) * 1e6))
                    self._start_us = max(self._start_us, self._writer.last_us) + since_us
        finally:
            self._writer.close()

    def _begin(self, stream: VideoStream) -> None:
        """Begin a recording."""
        self._writer = RecordingWriter(self._folder / folder_name(time.time_ns() // 1000))
        self._kind, self._start_us, self._why = _kind(stream), 0, ""

    def _record(self, container: InputContainer, stream: VideoStream, begin: Callable[[Path], None]) -> None:
        """Record one connection, to its end."""
        last_us: int | None = None
        self._arrived_s = time.monotonic()
        try:
            for packet in _packets(container, stream):
                if self._source.ended.is_set():
                    return
                now_s, now_us = time.monotonic(), _decoded_us(packet)
                if now_s - self._arrived_s < SILENT_FOR_S:  # else it came before, and is given out as patience ends
                    self._arrived_s = now_s
                if last_us is not None and not 0 <= now_us - last_us <= JUMP_US:
                    self._start_us, self._why, last_us = self._writer.last_us + 1, "its time stamps jumped", None
                if packet.is_keyframe and self._is_full():
                    self._writer.close()
                    self._begin(stream)
                    last_us = None
                if last_us is None:
                    if not packet.is_keyframe:
                        continue  # nobody can decode it
                    self._writer.connect(stream, self._start_us, self._why)
                    if self._writer.last_us < 0:
                        begin(self._writer.folder)
                self._writer.write(packet)
                last_us = now_us
            self._why = "it ended"
        except (av.FFmpegError, OSError) as error:
            self._why = f"it was cut ({what_came(error)})"

    def _is_full(self) -> bool:
        return self._writer.last_us >= self._longest_us or self._writer.size_bytes >= self._most_bytes

    def _again(self) -> Connection | None:
        pause_s = FIRST_PAUSE_S
        while not self._source.ended.wait(pause_s):
            try:
                found = self._source.open()
            except InputError as error:
                if self._source.ended.is_set():
                    break
                pause_s = min(2 * pause_s, MOST_PAUSE_S)
                self.tell(f"{error}; called again in {pause_s:g} s")
            else:
                self.tell(f"{self._source.shown}: is back")
                return found
        return None


def _packets(container: InputContainer, stream: VideoStream) -> Iterator[Packet[VideoStream]]:
    """Give the packets that say when they are to be shown."""
    return (one for one in container.demux(stream) if one.size and (one.pts is not None or one.dts is not None))


def _decoded_us(packet: Packet[VideoStream]) -> int:
    assert packet.time_base is not None
    ticks = packet.dts if packet.dts is not None else packet.pts
    assert ticks is not None
    return round(ticks * packet.time_base * 1_000_000)


def _kind(stream: VideoStream) -> tuple[str, int, int]:
    """Tell what must be the same for two connections to be of one recording."""
    return stream.codec_context.name, stream.width, stream.height


class RowReceiver:
    """Record CSV with a header line, or objects of JSON, one a line.

    Parameters
    ----------
    source : what to record; opened here.
    folder : of the recordings.
    longest_us : so long is a recording at most, by the clock of this machine.
    most_bytes : that large is a recording at most, and what came at once.

    Raises
    ------
    InputError
        If the source is no pipe.
    """

    def __init__(self, source: LiveSource, folder: Path, *, longest_us: int, most_bytes: int) -> None:
        self._source, self._pipe, self._folder = source, source.open_pipe(), folder
        self._longest_s, self._most_bytes = longest_us / 1e6, most_bytes

    def record(self, begin: Callable[[Path], None]) -> None:
        """Record until the source is `ended`, or the pipe is over.

        Parameters
        ----------
        begin : gets the folder of each recording.

        Raises
        ------
        InputError
            If nothing comes, or no lines.
        """
        header, until_s, writer = None, 0.0, None
        with ExitStack() as recording:
            for lines in self._lines():
                rows = lines
                if header is None:
                    suffix, end = (".csv", lines.index(b"\n") + 1) if lines.lstrip()[:1] != b"{" else (".jsonl", 0)
                    header, rows = lines[:end], lines[end:]
                if writer is None or writer.size_bytes > self._most_bytes or time.monotonic() > until_s:
                    recording.close()
                    until_s = time.monotonic() + self._longest_s
                    writer = RecordingWriter(self._folder / folder_name(time.time_ns() // 1000))
                    recording.callback(writer.close)
                    writer.begin_rows(header, suffix)
                    begin(writer.folder)
                writer.write_bytes(rows)
        if writer is None and not self._source.ended.is_set():
            raise InputError(f"{self._source.shown}: expected rows, got nothing")

    def _lines(self) -> Iterator[bytes]:
        """Give what came, whole lines at a time; one without an end only where the pipe is over."""
        rest = b""
        while data := self._pipe.read(1 << 16):
            lines, end, rest = (rest + data).rpartition(b"\n")
            if end:
                yield lines + end
            if len(rest) > _LONGEST_LINE:
                raise InputError(f"{self._source.shown}: expected lines of rows, got {len(rest)} bytes without an end")
        if rest and not self._source.ended.is_set():
            yield rest + b"\n"
