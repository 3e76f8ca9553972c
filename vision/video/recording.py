"""What has a live source sent so far? A recording: a folder of files that may still grow, read as one video.

The index has a line of JSON for each file, written when the file begins. The files of one connection are one MPEG-TS
stream, cut where it was convenient. Who writes a recording holds a lock on its lock file, so a reader that has come to
the end knows whether more may come; the system drops the lock with the writer's process.
"""

import fcntl
import json
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from io import RawIOBase
from pathlib import Path

from vision.errors import VideoError

INDEX, LOCK = "recording.jsonl", "recording.lock"
LOOK_EVERY_S = 0.02
"""How often the end of a growing file is looked at: half a frame."""

_PAUSE = threading.Event()  # never set: no clock is read, only waited


@dataclass(frozen=True, slots=True)
class Part:
    """One file of a recording.

    Attributes
    ----------
    file : its name in the folder.
    connection : counts the connections to the source, from 0; each is a stream of its own.
    start_us : media time of the first picture of the connection.
    utc_us : when the first byte of the file was written, by the wall clock.
    why : what ended the connection before, on the first file of a connection; else empty.
    """

    file: str
    connection: int
    start_us: int
    utc_us: int
    why: str = ""

    def as_line(self) -> str:
        """Write the line of the index.

        Examples
        --------
        >>> part = Part("000000.ts", 0, 0, 1_700_000_000_000_000)
        >>> _read_part(part.as_line()) == part
        True
        """
        return json.dumps(asdict(self))

    @property
    def utc(self) -> datetime:
        """Return when the file began."""
        return datetime.fromtimestamp(self.utc_us / 1e6, UTC)


def _read_part(line: str) -> Part:
    return Part(**json.loads(line))


def is_recording(path: Path) -> bool:
    """Tell whether a path is the folder of a recording."""
    return (path / INDEX).is_file()


def parts_so_far(folder: Path) -> list[Part]:
    """Read the index; a line that is not whole yet is left for later.

    Raises
    ------
    VideoError
        If the index is none.
    """
    lines = (folder / INDEX).read_text(encoding="utf-8").splitlines(keepends=True)
    try:
        return [_read_part(line) for line in lines if line.endswith("\n")]
    except (ValueError, TypeError) as error:
        raise VideoError(f"recording {str(folder)!r}: expected a file in each line of {INDEX}, got {error}") from error


def is_growing(folder: Path) -> bool:
    """Tell whether somebody writes the recording."""
    with suppress(FileNotFoundError), (folder / LOCK).open("rb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def connections(folder: Path) -> Iterator[tuple[Part, "ConnectionBytes"]]:
    """Give the first file of each connection, and all bytes of it; wait for more while the recording grows.

    Each is to be read to its end before the next one is taken.
    """
    at = 0
    while (part := _part_at(folder, at)) is not None:
        with ConnectionBytes(folder, at, part) as stream:
            yield part, stream
            while stream.read(1 << 16):  # what nobody could decode
                pass
            at = stream.next_at


def _part_at(folder: Path, at: int) -> Part | None:
    """Wait for a line of the index; None if it will never come."""
    while True:
        may_come = is_growing(folder)  # asked first, so that what was written last is not missed
        parts = parts_so_far(folder)
        if at < len(parts):
            return parts[at]
        if not may_come:
            return None
        _PAUSE.wait(LOOK_EVERY_S)


class ConnectionBytes(RawIOBase):
    """The bytes of one connection, out of one file after the other.

    Parameters
    ----------
    folder : of the recording.
    at : which line of the index is the first file, `part`.

    Attributes
    ----------
    next_at : the line of the first file after the connection, when all is read.
    """

    def __init__(self, folder: Path, at: int, part: Part) -> None:
        self.next_at = at + 1
        self._folder = folder
        self._connection = part.connection
        self._file = self._opened(part)
        self._is_over = False

    def _opened(self, part: Part) -> RawIOBase:
        try:
            return (self._folder / part.file).open("rb", buffering=0)
        except OSError as error:
            raise VideoError(
                f"recording {str(self._folder)!r}: expected the file {part.file!r}, got {error.strerror!r}"
            ) from error

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Read some bytes, waiting for them; none at the end of the connection."""
        while not self._is_over:
            if data := self._file.read(size):
                return data
            may_come = is_growing(self._folder)
            parts = parts_so_far(self._folder)
            # A file that has a next one, or no writer, was whole before it is read once more.
            if data := self._file.read(size):
                return data
            if self.next_at < len(parts):
                self._go_on(parts[self.next_at])
            elif may_come:
                _PAUSE.wait(LOOK_EVERY_S)
            else:
                self._is_over = True
        return b""

    def close(self) -> None:
        """Close the file that is read now."""
        self._file.close()
        super().close()

    def _go_on(self, part: Part) -> None:
        self._file.close()
        if part.connection != self._connection:
            self._is_over = True
            return
        self._file = self._opened(part)
        self.next_at += 1
