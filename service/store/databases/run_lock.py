"""Is somebody writing this run right now? A lock beside the log, which the operating system drops with its process.

No clock and no process number decides: a run that a crash left `running` is free at once, one that is being written is
not, however slow. The lock is on a file of its own, since closing any handle of the database file would drop SQLite's
locks in the same process.
"""

import fcntl
import os
from contextlib import ExitStack
from pathlib import Path

from service.errors import RunBusyError


class RunLock:
    """Hold the right to write one run of a log; release it, or let the process end.

    Parameters
    ----------
    log : the SQLite file.
    run_id : of letters, digits, `.`, `_` and `-`.

    Raises
    ------
    RunBusyError
        If another writer holds it.
    """

    def __init__(self, log: Path, run_id: str) -> None:
        self._path = log.with_name(f"{log.name}-{run_id}.writing")
        self._handle: int | None = None
        while self._handle is None:
            self._handle = self._try(log, run_id)

    def is_held(self) -> bool:
        """Tell that nobody took it: the system does not while the process lives."""
        return self._handle is not None

    def release(self) -> None:
        """Give the right up; a second time changes nothing."""
        if self._handle is not None:
            self._path.unlink(missing_ok=True)  # while it is still held: the next writer makes a file of its own
            os.close(self._handle)
            self._handle = None

    def _try(self, log: Path, run_id: str) -> int | None:
        """Take the lock; None if its file was removed meanwhile by the writer before."""
        handle = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        with ExitStack() as unless_taken:
            unless_taken.callback(os.close, handle)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                wanted = f"log {str(log)!r}: expected run {run_id!r} to be free"
                raise RunBusyError(f"{wanted}, got one that another process is writing now") from error
            if self._path.exists() and os.path.samestat(os.fstat(handle), self._path.stat()):
                unless_taken.pop_all()
                return handle
        return None
