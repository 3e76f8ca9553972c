"""How are the tables of a log that belong to no run read and written? Each change in a transaction of its own."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Self

from sqlalchemy import Connection, Engine

from service.store.databases.database import Database, explained
from service.store.databases.location import database_of
from service.store.versions import up_to_date


class LogTables:
    """The tables of one log, open until `close`; use it in a `with` statement, or as long as a program lives.

    Raises
    ------
    LogError
        If there is no such log, or the database refuses; so do all that read or write.
    """

    def __init__(self, log_url: str) -> None:
        self._database = database = database_of(log_url)
        database.check_readable()
        self._closing = ExitStack()
        self._engines = up_to_date(database, self._closing, may_be_empty=False).reading(), database.writing()

    def close(self) -> None:
        """Close all connections."""
        for engine in self._engines:
            engine.dispose()
        self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _reading(self) -> AbstractContextManager[Connection]:
        return _transaction(self._database, self._engines[0], "a log that can be read")

    def _writing(self) -> AbstractContextManager[Connection]:
        return _transaction(self._database, self._engines[1], "a log that can be written")


@contextmanager
def _transaction(database: Database, engine: Engine, wanted: str) -> Iterator[Connection]:
    with explained(database, wanted), engine.begin() as connection:
        yield connection
