"""How does a signal stop a run without tearing a row? It is taken note of, and looked at between two frames."""

import signal
import threading
from types import FrameType
from typing import Self

# Ctrl-C; what `kill`, a supervisor and a shutdown send; a terminal that is closed.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


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
