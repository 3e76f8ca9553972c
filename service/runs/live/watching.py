"""What does it take to watch a camera? Its recording grows on one thread, and is processed on another.

What a program that was killed has left is processed to its end on a third one, while the camera is watched already.
"""

import queue
from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from service.errors import LogBackError, LogError, ServiceError
from service.runs.live.live_source import LOOKED_EVERY_S, LiveSource
from service.runs.live.receiver import Receiver, RowReceiver, Tell
from service.runs.live.recording_writer import left_behind, mark_processed, remove_old
from service.runs.machine import Interrupts
from service.runs.processing import Progress, RunSummary, load_texts, process
from service.runs.requests import LiveRequest
from service.store.databases.location import database_of, log_files
from vision.errors import VideoError, VisionError

ASKED_EVERY_S = 5.0
"""Whether a log answers again; each time that it does, and is away again, leaves a recording."""

_AnyReceiver = Receiver | RowReceiver


def watch(
    request: LiveRequest,
    *,
    tell: Tell,
    on_progress: Callable[[Progress], None],
    on_summary: Callable[[RunSummary], None],
    is_wanted: Callable[[], bool] = lambda: True,
) -> bool:
    """Record and process a live source until a signal ends it, nobody wants it any more, or it is a pipe that is over.

    What was recorded until then is processed to its end, unless it was left by a program that was killed: then the next
    one processes it.

    Parameters
    ----------
    tell : gets a line when the source is cut or back.
    on_progress, on_summary : told of each run.
    is_wanted : asked several times a second.

    Returns
    -------
    Whether a signal ended it.

    Raises
    ------
    InputError
        If the source does not answer; nothing has been written then.
    LogBackError
        If the log was away, while the source was recorded further, and answers again: watch once more, and what was
        recorded is processed beside.
    ServiceError, VisionError, ChronicleError, DyKnowError
        If a text or the site of the request is wrong, before anything is written; if they do not go with what the
        source sends, after as much of that was recorded as it took to see it.
    """
    load_texts(request.run)
    source, left = LiveSource(request.input), list[Path]()
    begun: queue.SimpleQueue[Path | None] = queue.SimpleQueue()

    def process_one(folder: Path, on_progress: Callable[[Progress], None]) -> None:
        """Process a recording, and make room for the next ones; what ends early, or breaks, is not done."""
        try:
            summary = process(replace(request.run, input=folder), on_progress=on_progress)
        except VideoError as error:
            if not source.ended.is_set() and folder not in left:
                raise
            tell(str(error))  # ended before a picture was whole
        else:
            on_summary(summary)
            if summary.status == "interrupted":
                return
        mark_processed(folder)
        remove_old(request.recordings, age_us=request.age_us, size_bytes=request.size_bytes)

    def go_on(_: Progress) -> None:
        if source.ended.is_set():
            raise KeyboardInterrupt  # as Ctrl-C stops a run

    def process_live() -> None:
        """Process the recordings in their order; what is wrong with one ends what is recorded."""
        try:
            for folder in iter(begun.get, None):
                process_one(folder, on_progress)
        except LogError as error:
            _await_server(request.run.log_url, error, source, tell)
            raise
        finally:
            source.ended.set()

    def process_left() -> None:
        """Process what was left; what is wrong with it is told, and ends nothing."""
        for folder in left:
            if source.ended.is_set():
                return
            try:
                process_one(folder, go_on)
            except (ServiceError, VisionError) as error:  # it may be of another camera
                tell(f"{folder}: {error}")

    with closing(source), ThreadPoolExecutor(3) as pool:
        try:
            with Interrupts() as interrupts:  # the first signal; the next one does what it always does
                opening = pool.submit(_receiver, source, request, tell)
                if not _are_done([opening], interrupts, is_wanted):
                    return interrupts.came is not None
                receiver = opening.result()
                left += left_behind(request.recordings)
                tasks = [pool.submit(_record, receiver, begun), pool.submit(process_live), pool.submit(process_left)]
                _are_done(tasks, interrupts, is_wanted)
        finally:
            source.ended.set()
        for task in tasks:
            task.result()
    return interrupts.came is not None


def _await_server(log_url: str, error: LogError, source: LiveSource, tell: Tell) -> None:
    """Wait until a server that is away answers again, and say so by a `LogBackError`; return if nobody waits for it.

    A log in a file is never away, and what comes through a pipe cannot be taken up in its midst.
    """
    if source.ends or log_files(log_url):
        return
    tell(f"{error}; what comes is recorded")
    database = database_of(log_url)
    while not source.ended.wait(ASKED_EVERY_S):
        with suppress(LogError):
            database.check_readable()
            break
    else:
        return
    raise LogBackError(str(error)) from error


# Any: whatever the tasks give.
def _are_done(tasks: Collection[Future[Any]], interrupts: Interrupts, is_wanted: Callable[[], bool]) -> bool:
    """Wait for tasks until a signal comes, or nobody wants them any more; tell whether they are done."""
    while interrupts.came is None and wait(tasks, LOOKED_EVERY_S).not_done and is_wanted():
        pass
    return all(task.done() for task in tasks)


def _receiver(source: LiveSource, request: LiveRequest, tell: Tell) -> _AnyReceiver:
    limits = {"longest_us": request.longest_us, "most_bytes": max(1, request.size_bytes // 2)}
    if request.is_rows:
        return RowReceiver(source, request.recordings, **limits)
    return Receiver(source, source.open(), request.recordings, **limits, tell=tell)


def _record(receiver: _AnyReceiver, begun: "queue.SimpleQueue[Path | None]") -> None:
    try:
        receiver.record(begun.put)
    finally:
        begun.put(None)
