"""Where does an event log lie? In a SQLite file, or on a PostgreSQL server; above this both are the same.

Tables, rows and the way they are asked for are one (`schema.py`). What differs is here: how connections are opened,
who may write a run, where a repeated run is written, and what of the database itself can be wrong.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol  # Any: what the rows of a question hold

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import DBAPIError

from service.errors import LogError


class Lock(Protocol):
    """The right to write one run, or to be at a job; released by itself when the process ends."""

    def is_held(self) -> bool:
        """Tell whether it is held; one that a server dropped, as it was restarted, is taken anew if it is free.

        Raises
        ------
        LogError
            If the server does not answer.
        """

    def release(self) -> None:
        """Give the right up; a second time changes nothing."""


class Database(Protocol):
    """The place of one event log.

    Attributes
    ----------
    name : what messages call it.
    url : what opens it, in another process too.
    namespace : of its tables in SQL, as another log sees them that has it beside itself.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def url(self) -> str: ...  # noqa: D102

    @property
    def namespace(self) -> str: ...  # noqa: D102

    def exists(self) -> bool:
        """Tell whether there is anything to read yet."""

    def check_readable(self) -> None:
        """Raise a `LogError` if there is nothing to read."""

    def check_writable(self) -> None:
        """Raise a `LogError` if nothing can be written; creates nothing."""

    def can_write(self) -> bool:
        """Tell whether what exists can be written."""

    def reading(self) -> Engine:
        """Make an engine that can only read; each transaction sees one state of the log."""

    def writing(self, beside: "Database | None" = None) -> Engine:
        """Make an engine that writes, of which one transaction at a time changes the tables of all runs.

        Parameters
        ----------
        beside : another log, whose tables can be read too, by its `namespace`.
        """

    def lock(self, run_id: str) -> Lock:
        """Take the right to write a run; raises a `RunBusyError` if somebody else has it."""

    def beside(self, run_id: str) -> "Database":
        """Say where a run is written that is here already."""

    def remove(self) -> None:
        """Remove it, if it is there and nobody has it open."""

    def copied(self, closing: ExitStack) -> "Database":
        """Copy it to where it can be written; the copy is removed when `closing` is."""

    def back_up(self, target: Path) -> None:
        """Copy it, as it is at one moment, into a SQLite file; raises a `LogError` if that is not for us to do."""

    def compact(self) -> None:
        """Give back the room of rows that are gone; raises a `LogError` if that cannot be done now."""

    def size_bytes(self) -> int:
        """Say how much room it takes."""

    def faults(self) -> Iterator[str]:
        """Say what the database finds wrong with itself."""


@contextmanager
def explained(database: Database, wanted: str) -> Iterator[None]:
    """Turn a database error into a `LogError` that says where, and what was wanted."""
    try:
        yield
    except DBAPIError as error:
        came = str(error.orig).partition("\n")[0]
        raise LogError(f"log {database.name!r}: expected {wanted}, got {came!r}") from error


def driver_rows(connection: Connection, query: str, values: tuple[object, ...] = ()) -> list[tuple[Any, ...]]:
    """Ask the driver, in the transaction of a connection: SQLAlchemy takes longer to ask than SQLite to answer.

    Raises
    ------
    DBAPIError
        If the database refuses.
    """
    cursor = connection.connection.cursor()
    try:
        cursor.execute(query, values)
        return list(cursor.fetchall())
    except connection.dialect.loaded_dbapi.Error as error:
        raise DBAPIError(query, values, error) from error
    finally:
        cursor.close()
