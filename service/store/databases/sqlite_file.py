"""How is an event log a SQLite file, and is somebody writing a run of it right now?

No clock and no process number decides: a run that a crash left `running` is free at once, one that is being written is
not, however slow. The lock is on a file of its own, since closing any handle of the database file would drop SQLite's
locks in the same process.

Writers use write-ahead logging, so that readers never wait for them. Transactions are opened explicitly: the driver's
own habit of committing around schema statements would leave a half-made log behind a killed process.
"""

import fcntl
import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.pool import QueuePool

from service.errors import LogError, RunBusyError
from service.store.databases.database import Database, driver_rows, explained

BUSY_TIMEOUT_S = 30.0
READ_CONNECTIONS = 40  # one for each worker thread of the HTTP server


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


@dataclass(frozen=True, slots=True)
class SqliteFile(Database):
    """A log in a file; see `Database`.

    Parameters
    ----------
    is_left_alone : whether it is read as if it could not be written: SQLite tidies up behind whoever may write.
    """

    path: Path
    is_left_alone: bool = False

    @property
    def name(self) -> str:
        """The path."""
        return str(self.path)

    @property
    def url(self) -> str:
        """The path, as a URL."""
        return f"sqlite:///{self.path}"

    @property
    def namespace(self) -> str:
        """A file that is attached to another one has the tables of this schema."""
        return "beside"

    def exists(self) -> bool:
        """Tell whether there is a file."""
        return self.path.exists()

    def check_readable(self) -> None:
        """Refuse a file that is missing."""
        if not self.path.is_file():
            came = "a folder" if self.path.is_dir() else "no such file"
            raise LogError(f"log {self.name!r}: expected an event log, got {came}")

    def check_writable(self) -> None:
        """Refuse a folder that is missing, and a folder or file that may not be written."""
        folder = self.path.parent
        if not folder.is_dir():
            came = "a file" if folder.exists() else "no such folder"
            raise LogError(f"log {self.name!r}: expected an existing folder {str(folder)!r}, got {came}")
        target = self.path if self.path.exists() else folder
        if self.path.is_dir():
            raise LogError(f"log {self.name!r}: expected a file, got a folder")
        if not (os.access(target, os.W_OK) and os.access(folder, os.W_OK)):
            raise LogError(
                f"log {self.name!r}: expected a writable folder and file, got {str(target)!r} without permission"
            )

    def can_write(self) -> bool:
        """Tell whether the file can be written, and others beside it."""
        return not self.is_left_alone and os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)

    def reading(self) -> Engine:
        """Make an engine that can only read.

        In a place where nothing may be written the file is read as it lies, without its shared-memory companion.
        """
        if self.can_write():
            # Not mode=ro: a read-only connection that leaves last would leave the -wal and -shm files behind.
            return _engine(_connector(self.path, "mode=rw", ("PRAGMA query_only = 1",)), "BEGIN")
        has_wal = self.path.with_name(self.path.name + "-wal").exists()
        return _engine(_connector(self.path, "mode=ro" if has_wal else "immutable=1", ()), "BEGIN")

    def writing(self, beside: Database | None = None) -> Engine:
        """Make an engine that writes; the file is created by the first connection."""
        pragmas: tuple[str, ...] = ("PRAGMA journal_mode = WAL", "PRAGMA synchronous = NORMAL")
        if isinstance(beside, SqliteFile):
            pragmas += (f"ATTACH DATABASE '{_uri(beside.path, 'mode=ro')}' AS {beside.namespace}",)
        return _engine(_connector(self.path, "mode=rwc", pragmas), "BEGIN IMMEDIATE")

    def lock(self, run_id: str) -> RunLock:
        """Lock a file beside this one."""
        return RunLock(self.path, run_id)

    def beside(self, run_id: str) -> "SqliteFile":
        """Name a file beside this one."""
        return SqliteFile(self.path.with_name(f"{self.path.name}-{run_id}.again"))

    def remove(self) -> None:
        """Remove the file, and what SQLite keeps beside it."""
        for suffix in ("", "-wal", "-shm"):
            self.path.with_name(self.path.name + suffix).unlink(missing_ok=True)

    def copied(self, closing: ExitStack) -> "SqliteFile":
        """Copy the file to a folder for temporary files."""
        folder = closing.enter_context(TemporaryDirectory(prefix="dyknow-"))
        target = Path(folder) / self.path.name
        self.back_up(target)
        return SqliteFile(target)

    def back_up(self, target: Path) -> None:
        """Copy the file in one step, so that what is committed meanwhile is not in it by half."""
        engine = self.reading()
        try:
            with closing(sqlite3.connect(target)) as copy, closing(engine.raw_connection()) as original:
                original.backup(copy)
        except sqlite3.Error as error:
            raise LogError(f"log {self.name!r}: expected room for a copy {target}, got {str(error)!r}") from error
        finally:
            engine.dispose()

    def compact(self) -> None:
        """Give back the room of rows that are gone; the disk needs room for a copy of what is left."""
        try:
            with closing(_connector(self.path, "mode=rw", ())()) as connection:
                connection.execute("VACUUM")
        except sqlite3.Error as error:
            wanted = f"log {self.name!r}: expected a log that nobody else is at"
            raise LogError(f"{wanted}, got {str(error)!r}") from error

    def size_bytes(self) -> int:
        """Say how large the file is."""
        return self.path.stat().st_size

    def faults(self) -> Iterator[str]:
        """Let SQLite look through the file."""
        engine = self.reading()
        with explained(self, "a log that can be read"), engine.begin() as connection:
            yield from (line for line in connection.scalars(text("PRAGMA quick_check")) if line != "ok")
        engine.dispose()


def _connector(path: Path, query: str, pragmas: tuple[str, ...]) -> Callable[[], sqlite3.Connection]:
    uri = _uri(path, query)

    def connect() -> sqlite3.Connection:
        """Open a connection and set its pragmas."""
        connection = sqlite3.connect(
            uri, uri=True, timeout=BUSY_TIMEOUT_S, isolation_level=None, check_same_thread=False
        )
        for pragma in pragmas:
            connection.execute(pragma)
        return connection

    return connect


def _uri(path: Path, query: str) -> str:
    """Name a file for SQLite; the quoting leaves no quotation mark."""
    return f"file:{quote(str(path.absolute()))}?{query}"


def _engine(connect: Callable[[], sqlite3.Connection], begin: str) -> Engine:
    engine = create_engine(
        "sqlite://", creator=connect, poolclass=QueuePool, pool_size=READ_CONNECTIONS, max_overflow=0
    )

    @event.listens_for(engine, "begin")
    def open_transaction(connection: Connection) -> None:
        driver_rows(connection, begin)

    return engine
