"""How does Ctrl-C stop a run without tearing a row? It is taken note of, and looked at between two frames."""

import signal
import threading
from types import FrameType
from typing import Self


class Interrupts:
    """Take note of Ctrl-C while in the `with` block, instead of raising `KeyboardInterrupt` anywhere.

    So a second, impatient Ctrl-C cannot hit the transaction in which the run is closed. Off the main thread, where
    Python delivers no signals, nothing is changed.

    Attributes
    ----------
    came : Ctrl-C was pressed.
    """

    def __init__(self) -> None:
        self.came = False
        self._is_main = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Self:
        if self._is_main:
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_main:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True
