"""How are rows recorded that come through a pipe? Whole lines at a time, into one recording after the other."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

from service.errors import InputError
from service.runs.live.live_source import LiveSource
from service.runs.live.recording_writer import RecordingWriter, folder_name

_LONGEST_LINE = 1 << 20  # bytes


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
