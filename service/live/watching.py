"""What does it take to watch a camera? Its recording grows on one thread, and is processed on another.

What a program that was killed has left is processed to its end on a third one, while the camera is watched already.
"""

import queue
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType

from service.errors import ServiceError
from service.live.keeping import left_behind, mark_processed, remove_old
from service.live.live_source import LiveSource
from service.live.receiver import Connection, Receiver, Tell
from service.runs.processing import Progress, RunSummary, load_texts, process
from service.runs.requests import RunRequest
from vision.errors import VideoError, VisionError


@dataclass(frozen=True, slots=True)
class Kept:
    """Say what is kept of a source.

    Attributes
    ----------
    folder : of its recordings.
    longest_us : so long are a recording, and the run over it, at most.
    age_us, size_bytes : older recordings, and what is more than this in all, are removed once they are processed.
    """

    folder: Path
    longest_us: int
    age_us: int
    size_bytes: int


def watch(
    text: str,
    request: RunRequest,
    kept: Kept,
    *,
    tell: Tell,
    on_progress: Callable[[Progress], None],
    on_summary: Callable[[RunSummary], None],
) -> None:
    """Record and process a live source until a signal ends it, or it is a pipe that is over.

    What was recorded until then is processed to its end, unless it was left by a program that was killed: then the next
    one processes it.

    Parameters
    ----------
    text : names the source, see `LiveSource`.
    request : how to process; its input is put in.
    tell : gets a line when the source is cut or back.
    on_progress, on_summary : told of each run.

    Raises
    ------
    InputError
        If the source does not answer; nothing has been written then.
    ServiceError, VisionError, ChronicleError, DyKnowError
        If a text or the site of the request is wrong, before anything is written; if they do not go with what the
        source sends, after as much of that was recorded as it took to see it.
    """
    load_texts(request)
    source = LiveSource(text)
    connection = source.open()
    left = left_behind(kept.folder)
    receiver = Receiver(
        source, kept.folder, longest_us=kept.longest_us, most_bytes=max(1, kept.size_bytes // 2), tell=tell
    )
    begun: queue.SimpleQueue[Path | None] = queue.SimpleQueue()

    def process_one(folder: Path, on_progress: Callable[[Progress], None]) -> None:
        """Process a recording, and make room for the next ones; what ends early, or breaks, is not done."""
        try:
            summary = process(replace(request, input=folder), on_progress=on_progress)
        except VideoError as error:
            if not receiver.ended.is_set() and folder not in left:
                raise
            tell(str(error))  # ended before a picture was whole
        else:
            on_summary(summary)
            if summary.status == "interrupted":
                return
        mark_processed(folder)
        remove_old(kept.folder, age_us=kept.age_us, size_bytes=kept.size_bytes)

    def go_on(_: Progress) -> None:
        if receiver.ended.is_set():
            raise KeyboardInterrupt  # as Ctrl-C stops a run

    def process_live() -> None:
        """Process the recordings in their order; what is wrong with one ends what is recorded."""
        try:
            for folder in _each_once(begun):
                process_one(folder, on_progress)
        finally:
            receiver.ended.set()

    def process_left() -> None:
        """Process what was left; what is wrong with it is told, and ends nothing."""
        for folder in left:
            if receiver.ended.is_set():
                return
            try:
                process_one(folder, go_on)
            except (ServiceError, VisionError) as error:  # it may be of another camera
                tell(f"{folder}: {error}")

    # Signals come to the main thread, which only waits.
    with _ended_by_signals(receiver.ended), ThreadPoolExecutor(3) as pool:
        recording = pool.submit(_record, receiver, connection, begun)
        for task in (recording, pool.submit(process_live), pool.submit(process_left)):
            task.result()


def _record(receiver: Receiver, connection: Connection, begun: "queue.SimpleQueue[Path | None]") -> None:
    try:
        receiver.record(connection, begun.put)
    finally:
        begun.put(None)


def _each_once(begun: "queue.SimpleQueue[Path | None]") -> Iterator[Path]:
    last: Path | None = None
    while (folder := begun.get()) is not None:
        if folder != last:  # and not a further connection in it
            yield folder
        last = folder


@contextmanager
def _ended_by_signals(ended: threading.Event) -> Iterator[None]:
    """Let the first signal end what is recorded; the next one does what it always does."""

    def end(number: int, frame: FrameType | None) -> None:
        ended.set()
        signal.signal(number, before[signal.Signals(number)])

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in numbers}
    for number in numbers:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
