"""How is the SQLite file of an event log opened, for reading and for writing?

Writers use write-ahead logging, so that readers never wait for them. Transactions are opened explicitly: the driver's
own habit of committing around schema statements would leave a half-made log behind a killed process.
"""

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import QueuePool

from service.errors import LogError

BUSY_TIMEOUT_S = 30.0
READ_CONNECTIONS = 40  # one for each worker thread of the HTTP server


def can_write(path: Path) -> bool:
    """Tell whether a file that exists can be written, and others beside it."""
    return os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)


def reading_engine(path: Path) -> Engine:
    """Make an engine that can only read; the file must exist.

    In a place where nothing may be written the file is read as it lies, without its shared-memory companion.
    """
    if can_write(path):
        # Not mode=ro: a read-only connection that leaves last would leave the -wal and -shm files behind.
        return _engine(_connector(path, "mode=rw", ("PRAGMA query_only = 1",)), "BEGIN")
    has_wal = path.with_name(path.name + "-wal").exists()
    return _engine(_connector(path, "mode=ro" if has_wal else "immutable=1", ()), "BEGIN")


def writing_engine(path: Path, *, beside: Path | None = None) -> Engine:
    """Make an engine that writes; the file is created by the first connection.

    Parameters
    ----------
    beside : another log, whose tables are then those of the SQL schema `beside`.
    """
    pragmas: tuple[str, ...] = ("PRAGMA journal_mode = WAL", "PRAGMA synchronous = NORMAL")
    if beside is not None:
        pragmas += (f"ATTACH DATABASE '{_uri(beside, 'mode=ro')}' AS beside",)
    return _engine(_connector(path, "mode=rwc", pragmas), "BEGIN IMMEDIATE")


def compact(path: Path) -> None:
    """Give back the room of rows that are gone.

    Raises
    ------
    LogError
        If another process is at the log, or the disk has no room for a copy of what is left.
    """
    with explained(path, "a log that nobody else is at"), closing(_connector(path, "mode=rw", ())()) as connection:
        connection.execute("VACUUM")


@contextmanager
def explained(path: Path, wanted: str) -> Iterator[None]:
    """Turn a database error into a `LogError` that says where, and what was wanted."""
    try:
        yield
    except (DBAPIError, sqlite3.Error) as error:
        came = error.orig if isinstance(error, DBAPIError) else error
        raise LogError(f"log {str(path)!r}: expected {wanted}, got {str(came)!r}") from error


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
        connection.exec_driver_sql(begin)

    return engine
