"""How are jobs processed? One after the other, by as many workers as there are, on any machine that reaches the log.

A live source is a job without an end: who has it watches it until it is cancelled, and whatever goes wrong it waits
again.

A worker that a server begins stays as long as that lives, and no longer, in a process that is looked after. It is begun
anew when it dies, at growing pauses, so that what kills each of them costs little. It ends with the server even if that
is killed: `multiprocessing` gives each process a handle that becomes ready when the one before it is gone.
"""

import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from chronicles.errors import ChronicleError
from dyknow.errors import DyKnowError
from service.errors import LogError, RunBusyError, ServiceError
from service.runs.machine import look_seldom, stopping_as_ctrl_c
from service.store.databases.location import database_of
from service.store.entries import JobKind, JobState
from service.store.registers.jobs import Jobs, TakenJob
from vision.errors import VisionError

if TYPE_CHECKING:
    from service.runs.processing import Progress, RunSummary
    from service.runs.requests import LiveRequest, RunRequest

TOLD_EVERY_S = 1.0
ASKED_EVERY_S = 1.0
FIRST_PAUSE_S = 1.0
MOST_PAUSE_S = 60.0
LOOK_EVERY_S = 0.2
ENDED_WITHIN_S = 10.0
"""A run ends between two frames; what takes longer is killed, which loses nothing either."""

Tell = Callable[[str], None]
_LOGGER = logging.getLogger(__name__)


def work(log_url: str, kind: JobKind = "run", *, stays: bool, tell: Tell, has_free_cores: bool = True) -> None:
    """Process the jobs of a log that are of one kind.

    Parameters
    ----------
    stays : wait for more where there are none; else return then.
    tell : gets a line when a job begins and when it ends.
    has_free_cores : as `process_job` has it.

    Raises
    ------
    LogError
        If there is no such log, or it cannot be read or written.
    KeyboardInterrupt
        If a signal stopped a run; its job waits again.
    """
    database = database_of(log_url)
    database.check_readable()  # a name that was mistyped makes no new log
    database.check_writable()
    busy = set[str]()  # runs that somebody else processes, sources that do not answer: others go before them
    with stopping_as_ctrl_c(), closing(Jobs(database)) as jobs:
        while True:
            taken = jobs.take(kind, but=busy)
            if taken is None and not busy and not stays:
                return
            if taken is None:
                busy.clear()
                time.sleep(ASKED_EVERY_S)
            elif not process_job(taken, log_url, tell, has_free_cores=has_free_cores):
                busy.add(taken.job.id)


def process_job(taken: TakenJob, log_url: str, tell: Tell, *, has_free_cores: bool = True) -> bool:
    """Process one job; False if others are to go first.

    That is where somebody else, who has no job for it, is at the same run, and where a live source waits again.

    Parameters
    ----------
    tell : gets a line when it begins and when it ends.
    has_free_cores : False where the other cores have jobs of their own, so that vision gets none unless asked for.

    Raises
    ------
    LogError
        If the database cannot be written.
    KeyboardInterrupt
        If a signal stopped the run; the job waits again.
    """
    try:
        # What processes takes 100 MB, which a worker that only waits for jobs does not need, and seconds to import.
        from service.runs.requests import LiveRequest, read_request

        request = read_request(taken.job.request, log_url)
        if isinstance(request, LiveRequest):
            return _watch_job(taken, request, tell)
        return _process_job(taken, request, tell, has_free_cores=has_free_cores)
    except KeyboardInterrupt as stopped:  # of the run with its reason, or of Python before that looks for signals
        taken.give_back(str(stopped))
        raise


def _process_job(taken: TakenJob, request: "RunRequest", tell: Tell, *, has_free_cores: bool) -> bool:
    from service.runs.processing import process

    if request.workers is None and not has_free_cores:
        request = replace(request, workers=0)
    tell(f"job {taken.job.id}: {request.input}")
    look = _Look(taken)
    try:
        summary = process(request, on_progress=look.stop_if_unwanted)
    except RunBusyError as error:
        taken.give_back(str(error))
        return False
    except LogError as error:  # the database may be back soon
        _end(taken, "waiting", str(error), tell)
        time.sleep(ASKED_EVERY_S)
    except (ServiceError, VisionError, ChronicleError, DyKnowError) as error:
        _end(taken, "failed", str(error), tell)
    except Exception as error:
        _LOGGER.exception("job %s", taken.job.id)
        _end(taken, "failed", f"a fault of ours: {error!r}", tell)
    else:
        _conclude(taken, summary, tell, cancel_requested=look.cancel_requested)
    return True


def _conclude(taken: TakenJob, summary: "RunSummary", tell: Tell, *, cancel_requested: bool) -> None:
    if summary.was_finished and taken.job.message.startswith(f"run {summary.run}: "):
        _end(taken, "finished", taken.job.message, tell)  # what it found when it was processed
    elif summary.status == "finished":
        _end(taken, "finished", "\n".join((f"run {summary.run}: {_result(summary)}", *summary.warnings)), tell)
    elif cancel_requested:
        _end(taken, "cancelled", summary.reason, tell)
    elif summary.status == "interrupted":
        raise KeyboardInterrupt(summary.reason)
    else:
        _end(taken, "failed", summary.reason, tell)


def _result(summary: "RunSummary") -> str:
    if summary.was_finished:
        return "it was finished before"
    done = summary.progress
    return f"{done.frames} frames, {done.found}, {done.real_time_factor:.1f}x real time"


def _end(taken: TakenJob, state: JobState, message: str, tell: Tell) -> None:
    taken.end(state, message)
    tell(f"job {taken.job.id} {'waits again' if state == 'waiting' else 'is ' + state}: {message}")


def _watch_job(taken: TakenJob, request: "LiveRequest", tell: Tell) -> bool:
    """Watch a live source to its end, if it has one; False if it waits again, as whatever goes wrong has it do."""
    from service.runs.live.watching import watch

    name, look = f"job {taken.job.id}", _Look(taken)

    def tell_of_source(line: str) -> None:
        look.text = line
        tell(f"{name}: {line}")

    def tell_summary(summary: "RunSummary") -> None:
        tell(f"{name}: run {summary.run} is {summary.status}{summary.reason and f': {summary.reason}'}")

    def is_wanted() -> bool:
        with suppress(LogError):  # what is recorded goes on; the run tells it where it lasts
            return look.is_wanted()
        return True

    if not taken.job.message:  # else it is called again
        tell(f"{name}: {taken.job.input}")
    try:
        is_interrupted = watch(
            request, tell=tell_of_source, on_progress=look.note, on_summary=tell_summary, is_wanted=is_wanted
        )
    except (ServiceError, VisionError, ChronicleError, DyKnowError) as error:
        if str(error) != taken.job.message:  # of many equal ones the first
            tell(f"{name} waits again: {error}")
        taken.end("waiting", str(error))
        return False
    if is_interrupted:
        raise KeyboardInterrupt
    _end(taken, "cancelled" if look.cancel_requested else "finished", look.text, tell)
    return True


class _Look:
    """Note once a second how far a job has come, and see whether it is still wanted.

    Attributes
    ----------
    text : how far that is.
    cancel_requested : whether it is wanted no more.
    """

    def __init__(self, taken: TakenJob) -> None:
        self.text = "begun"
        self.cancel_requested = False
        self._taken = taken
        self._due_s = 0.0

    def note(self, progress: "Progress") -> None:
        count = "" if progress.frame_count is None else f" of {progress.frame_count}"
        self.text = f"{progress.media_us / 1e6:.0f} s of input, {progress.frames}{count} frames, {progress.found}"

    def is_wanted(self) -> bool:
        now_s = time.monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + TOLD_EVERY_S
            self.cancel_requested = not self._taken.tell(self.text)
        return not self.cancel_requested

    def stop_if_unwanted(self, progress: "Progress") -> None:
        self.note(progress)
        if not self.is_wanted():
            raise KeyboardInterrupt  # as Ctrl-C stops a run: between two frames, with what is known told


@contextmanager
def kept_working(log_url: str, kind: JobKind, tell: Tell, *, has_free_cores: bool = True) -> Iterator[None]:
    """Keep a worker at the jobs of a log that are of one kind, while in the `with` block.

    Parameters
    ----------
    tell : gets a line when a worker begins or dies, and what it tells itself; a function of a module, since the worker
        calls it in its own process.
    has_free_cores : False where the other cores have workers of their own.
    """
    ended = threading.Event()
    work_once = partial(_work, log_url, kind, tell, has_free_cores=has_free_cores)
    supervisor = threading.Thread(target=_supervise, args=(work_once, tell, ended), daemon=True)
    supervisor.start()
    try:
        yield
    finally:
        ended.set()
        supervisor.join()


def _supervise(work_once: Callable[[], None], tell: Tell, ended: threading.Event) -> None:
    """Begin workers, one after the other, until the end."""
    pause_s = 0.0
    while not ended.wait(pause_s):
        began_s = time.monotonic()
        # Another start method would copy the locks of the server's threads.
        worker = multiprocessing.get_context("spawn").Process(target=work_once, name="worker")
        worker.start()
        tell(f"worker {worker.pid} begins")
        while worker.is_alive() and not ended.wait(LOOK_EVERY_S):
            pass
        if ended.is_set():
            worker.terminate()
            worker.join(ENDED_WITHIN_S)
            worker.kill()
            return
        lived_long = time.monotonic() - began_s > MOST_PAUSE_S
        pause_s = FIRST_PAUSE_S if lived_long else min(max(2 * pause_s, FIRST_PAUSE_S), MOST_PAUSE_S)
        tell(f"worker {worker.pid} ended with {worker.exitcode}; another begins in {pause_s:.0f} s")


def _work(log_url: str, kind: JobKind, tell: Tell, *, has_free_cores: bool) -> None:
    """Work until the process that began this one says so, or is gone."""
    # It comes to all processes of a terminal, and it is the server that ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    look_seldom()
    try:
        work(log_url, kind, stays=True, tell=tell, has_free_cores=has_free_cores)
    except KeyboardInterrupt:
        return  # its job waits again
    except ServiceError as error:
        tell(f"error: {error}")
        sys.exit(1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "a worker is begun by a server"
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)  # a run that is going on is told to the end of its frame
    time.sleep(ENDED_WITHIN_S)
    os.kill(os.getpid(), signal.SIGKILL)
