"""How does a process of ours live on its machine? With cores of its own, a collector that seldom looks, and signals.

A signal stops a run without tearing a row: it is taken note of, and looked at between two frames.
"""

import gc
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self

# Ctrl-C; what `kill`, a supervisor and a shutdown send; a terminal that is closed.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_NEW_OBJECTS = 50_000


def look_seldom() -> None:
    """Let Python look for garbage in circles at every 50,000 new objects, not at every 700.

    What we make is mostly kept, or gone by itself: to look through it costs a tenth of a second at each start, and half
    of the time of a question about 100,000 events.
    """
    gc.set_threshold(_NEW_OBJECTS)


def cores() -> int:
    """Count the processor's cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def stopping_as_ctrl_c() -> Iterator[None]:
    """Have signals that would kill this process raise `KeyboardInterrupt` while in the `with` block, as Ctrl-C does.

    Off the main thread nothing is changed, nor for a signal that is ignored or has a handler.
    """
    is_main = threading.current_thread() is threading.main_thread()
    deadly = [one for one in SIGNALS if is_main and signal.getsignal(one) is signal.SIG_DFL]
    for one in deadly:
        signal.signal(one, signal.default_int_handler)
    try:
        yield
    finally:
        for one in deadly:
            signal.signal(one, signal.SIG_DFL)


class Interrupts:
    """Take note of signals that ask to stop while in the `with` block, instead of stopping anywhere.

    So a second, impatient Ctrl-C cannot hit the transaction in which the run is closed. A signal that is ignored, as
    under `nohup`, stays so. Off the main thread, where Python delivers no signals, nothing is changed.

    Attributes
    ----------
    came : the first signal that came, None so far.
    """

    def __init__(self) -> None:
        self.came: signal.Signals | None = None
        is_main = threading.current_thread() is threading.main_thread()
        handlers = {one: signal.getsignal(one) for one in SIGNALS if is_main}
        self._before = {one: handler for one, handler in handlers.items() if handler is not signal.SIG_IGN}

    def __enter__(self) -> Self:
        for one in self._before:
            signal.signal(one, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for one, handler in self._before.items():
            signal.signal(one, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = self.came or signal.Signals(number)
