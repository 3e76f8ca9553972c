"""How is what arrives kept, and how long? As a recording (`vision.video.recording`): packets, in files of a minute.

It is kept until it is too old, or there is too much; recordings go whole, oldest first.

A mark in a recording says that its run came to its end. What was killed left one without, which is processed first.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import av
from av.container import OutputContainer
from av.packet import Packet
from av.video.stream import VideoStream

from vision.video.recording import INDEX, LOCK, Part, is_growing, parts_so_far

FILE_US = 60_000_000
_TICKS = Fraction(1, 90_000)  # of MPEG-TS
_MARK = "processed"


class RecordingWriter:
    """Write one recording.

    Parameters
    ----------
    folder : of the recording; made here.

    Attributes
    ----------
    folder : the same.
    last_us : media time of the newest packet; -1 if there is none.
    size_bytes : of all files.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self._lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        fcntl.flock(self._lock, fcntl.LOCK_EX)  # waits for readers that look whether there is a writer
        self.size_bytes, self.last_us = 0, -1
        self._files, self._connection = 0, -1
        self._file_from_us = 0
        self._file: int | None = None
        self._muxer: OutputContainer | None = None
        self._stream: VideoStream | None = None
        self._start_us, self._why = 0, ""
        self._first_ticks: int | None = None

    def connect(self, template: VideoStream, start_us: int, why: str) -> None:
        """Begin a connection; its first packet must hold a key frame.

        Parameters
        ----------
        template : the source's stream; its packets are copied.
        start_us : media time of its first packet.
        why : what ended the one before.
        """
        self._end_connection()
        self._connection += 1
        self._start_us, self._why = start_us, why
        self._open_file(start_us)
        # Packets are written at once, each whole: who reads the file is as early as who reads the source.
        self._muxer = av.open(
            SimpleNamespace(write=self.write_bytes), "w", format="mpegts", options={"flush_packets": "1"}
        )
        self._stream = self._muxer.add_stream_from_template(template)
        self._first_ticks = None

    def begin_rows(self, header: bytes, suffix: str = ".csv") -> None:
        """Begin the one file of a recording of rows, with a header line or none; rows are written by `write_bytes`."""
        self._connection = 0
        self._open_file(0, suffix)
        self.write_bytes(header)

    def write(self, packet: Packet[VideoStream]) -> None:
        """Write a packet of the connection, with its time stamps: who reads them counts from the first one."""
        assert self._muxer is not None
        assert packet.time_base is not None
        ticks = round((packet.pts if packet.pts is not None else packet.dts or 0) * packet.time_base / _TICKS)
        if self._first_ticks is None:
            self._first_ticks = ticks
        t_us = self._start_us + round((ticks - self._first_ticks) * _TICKS * 1_000_000)
        if packet.is_keyframe and t_us - self._file_from_us >= FILE_US:
            self._open_file(t_us)
        assert self._stream is not None
        packet.stream = self._stream
        self._muxer.mux(packet)
        self.last_us = max(self.last_us, t_us)

    def close(self) -> None:
        """End the recording."""
        self._end_connection()
        if self._file is not None:
            os.close(self._file)
            self._file = None
        os.close(self._lock)

    def _end_connection(self) -> None:
        if self._muxer is not None:
            self._muxer.close()
            self._muxer = None

    def _open_file(self, t_us: int, suffix: str = ".ts") -> None:
        if self._file is not None:
            os.close(self._file)
        name = f"{self._files:06d}{suffix}"
        part = Part(name, self._connection, self._start_us, time.time_ns() // 1000, self._why)
        self._file = os.open(self.folder / part.file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
        self._files, self._file_from_us, self._why = self._files + 1, t_us, ""
        with (self.folder / INDEX).open("a", encoding="utf-8") as index:  # a line at once
            index.write(part.as_line() + "\n")

    def write_bytes(self, data: bytes) -> int:
        """Write bytes to the file that is open, as its muxer made them; return how many."""
        assert self._file is not None
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._file, rest) :]
        self.size_bytes += len(data)
        return len(data)


def folder_name(utc_us: int) -> str:
    """Name a recording by when it began, so that names are in the order of time.

    Examples
    --------
    >>> folder_name(1_764_270_372_000_000)
    '20251127T190612.000000Z'
    """
    return datetime.fromtimestamp(utc_us / 1e6, UTC).strftime("%Y%m%dT%H%M%S.%fZ")


def remove_old(folder: Path, *, age_us: int, size_bytes: int) -> list[Path]:
    """Remove recordings that are processed.

    Parameters
    ----------
    folder : of recordings.
    age_us : older ones go, by when their last file began.
    size_bytes : where there is more in all, the oldest go.

    Returns
    -------
    What was removed.
    """
    now_us = time.time_ns() // 1000
    sizes = {one: sum(file.stat().st_size for file in one.iterdir()) for one in recordings(folder)}
    removed = []
    for one in list(sizes):
        parts = parts_so_far(one)
        is_old = not parts or now_us - parts[-1].utc_us > age_us
        if (is_old or sum(sizes.values()) > size_bytes) and (one / _MARK).exists():
            shutil.rmtree(one)
            del sizes[one]
            removed.append(one)
    return removed


def recordings(folder: Path) -> list[Path]:
    """List the recordings in a folder, oldest first."""
    return sorted(path.parent for path in folder.glob(f"*/{INDEX}"))


def left_behind(folder: Path) -> list[Path]:
    """List the recordings that nobody writes and whose run did not come to its end, oldest first."""
    return [one for one in recordings(folder) if not is_growing(one) and not (one / _MARK).exists()]


def mark_processed(recording: Path) -> None:
    """Note that the run over a recording came to its end."""
    (recording / _MARK).touch()
