"""How is an event log on a PostgreSQL server?

One database holds one log. Readers see one state of it in each transaction; those who write take turns in what all
runs share by a lock on a row or on a number, never on a table. Needs the extra `postgres`.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any  # what one value of a query is

from sqlalchemy import Connection, Engine, Select, create_engine, func, select
from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError
from sqlalchemy.schema import CreateSchema, DropSchema

from service.errors import LogError, RunBusyError
from service.store.databases.database import Database, explained

_PUBLIC = "public"


class _AdvisoryLock:
    """A lock of the server's on a number, which it drops with the connection."""

    def __init__(self, server: "PostgresServer", connection: Connection, number: int) -> None:
        self._server, self._connection, self._number = server, connection, number

    def is_held(self) -> bool:
        """See `Lock`; taken for the first time as well."""
        try:
            return self._take()
        except DBAPIError:  # the connection is lost, and the lock with it; the next one is a new one
            with explained(self._server, "a log that can be written"):
                return self._take()

    def _take(self) -> bool:
        """Take it; who has it may take it any number of times, and the end of the connection drops all of them."""
        with self._connection.begin():
            return bool(self._connection.scalar(select(func.pg_try_advisory_lock(self._number))))

    def release(self) -> None:
        """Close the connection."""
        self._connection.close()
        self._connection.engine.dispose()


@dataclass(frozen=True, slots=True)
class PostgresServer(Database):
    """A log in a database of a server; see `Database`.

    Parameters
    ----------
    place : its URL.
    namespace : the SQL schema of its tables.
    """

    place: URL
    namespace: str = _PUBLIC

    @property
    def name(self) -> str:
        """The URL without its password."""
        return self.place.render_as_string(hide_password=True)

    @property
    def url(self) -> str:
        """The URL."""
        return self.place.render_as_string(hide_password=False)

    def exists(self) -> bool:
        """Tell that there is a database; whether it has tables is asked later."""
        self.check_readable()
        return True

    def check_readable(self) -> None:
        """Refuse a server that does not answer, and a database that it does not have."""
        self._scalar(select(1), "a server that answers")

    def check_writable(self) -> None:
        """Refuse a database in which no table can be made."""
        if not self._scalar(select(func.has_schema_privilege(_PUBLIC, "create")), "a server that answers"):
            wanted = f"log {self.name!r}: expected the right to make tables in schema {_PUBLIC!r}"
            raise LogError(f"{wanted}, got none for {self.place.username!r}")

    def can_write(self) -> bool:
        """Tell whether rows may be changed, and tables be made, as a newer schema needs."""
        rows, tables = func.has_table_privilege("meta", "update"), func.has_schema_privilege(_PUBLIC, "create")
        return bool(self._scalar(select(rows & tables), "a log that can be read"))

    def reading(self) -> Engine:
        """Make an engine whose transactions see one state each."""
        return self._engine(isolation_level="REPEATABLE READ", execution_options={"postgresql_readonly": True})

    def writing(self, beside: Database | None = None) -> Engine:
        """Make an engine that writes; other namespaces of the database can be read by their names anyway."""
        engine = self._engine()
        if self.namespace != _PUBLIC:
            with explained(self, "a log that can be written"), engine.begin() as connection:
                connection.execute(CreateSchema(self.namespace, if_not_exists=True))
        return engine

    def lock(self, run_id: str) -> _AdvisoryLock:
        """Take a lock on a number that stands for the run; the server drops it with the connection."""
        with explained(self, "a log that can be written"):
            lock = _AdvisoryLock(self, self._engine().connect(), _number(run_id))
        if not lock.is_held():
            lock.release()
            wanted = f"log {self.name!r}: expected run {run_id!r} to be free"
            raise RunBusyError(f"{wanted}, got one that another process is writing now")
        return lock

    def beside(self, run_id: str) -> "PostgresServer":
        """Name a namespace of its own."""
        return PostgresServer(self.place, f"again_{_number(run_id) % 2**64:016x}")

    def remove(self) -> None:
        """Drop the namespace; that of the log itself stays."""
        engine = self._engine()
        with explained(self, "a log that can be written"), engine.begin() as connection:
            if self.namespace != _PUBLIC:
                connection.execute(DropSchema(self.namespace, cascade=True, if_exists=True))
        engine.dispose()

    def copied(self, closing: ExitStack) -> "PostgresServer":
        """Refuse: nobody reads a server's log that he may not carry over from a copy."""
        raise LogError(f"log {self.name!r}: expected the right to carry it over to today's schema, got none")

    def back_up(self, target: Path) -> None:
        """Refuse: the server has programs for it."""
        raise LogError(f"log {self.name!r}: expected a SQLite file, got a server's database, which pg_dump backs up")

    def compact(self) -> None:
        """Leave it to the server."""

    def size_bytes(self) -> int:
        """Say how much room the database takes."""
        return int(self._scalar(select(func.pg_database_size(func.current_database())), "a log that can be read"))

    def faults(self) -> Iterator[str]:
        """Find none: the server checks what it reads."""
        return iter(())

    def _engine(self, **options: Any) -> Engine:  # Any: those of SQLAlchemy
        try:
            # Positional parameters, as SQLite has them, so that rows go to the driver as they are.
            return create_engine(
                self.place,
                paramstyle="format",
                use_native_hstore=False,  # each engine would ask for a type that no table has
                pool_pre_ping=True,  # after a restart of the server its connections are opened anew
                connect_args={"options": f"-csearch_path={self.namespace}"},
                **options,
            )
        except ModuleNotFoundError as error:
            wanted = f"log {self.name!r}: expected the extra 'postgres' (pip install 'psycopg[binary]')"
            raise LogError(f"{wanted}, got {str(error)!r}") from error

    def _scalar(self, query: Select[Any], wanted: str) -> Any:  # Any: what the query asks for
        engine = self._engine()
        try:
            with explained(self, wanted), engine.connect() as connection:
                return connection.scalar(query)
        finally:
            engine.dispose()


def _number(run_id: str) -> int:
    """Give the number that stands for a run in this database."""
    return int.from_bytes(blake2b(run_id.encode(), digest_size=8).digest(), signed=True)
