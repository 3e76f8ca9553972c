"""How does a worker stay at a log as long as a server lives, and no longer? In a process that is looked after.

It is begun anew when it dies, at growing pauses, so that what kills each of them costs little. It ends with the server
even if that is killed: `multiprocessing` gives each process a handle that becomes ready when the one before it is gone.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from service.errors import ServiceError
from service.runs.jobs.worker import Tell, work
from service.runs.machine import look_seldom
from service.store.entries import JobKind

FIRST_PAUSE_S = 1.0
MOST_PAUSE_S = 60.0
LOOK_EVERY_S = 0.2
ENDED_WITHIN_S = 10.0
"""A run ends between two frames; what takes longer is killed, which loses nothing either."""


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
