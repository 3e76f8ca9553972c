"""Which files are processed by a name? Those that were uploaded to a log's server, or that its operator allows."""

from collections.abc import Callable

from msgspec.structs import astuple
from sqlalchemy import delete, select

from service.errors import NotInLogError, TakenError
from service.store import schema
from service.store.entries import Source
from service.store.log import EventLog
from service.store.writer import insert_rows, lock_seqs

_SOURCES = schema.sources.c


class Sources:
    """The sources of one log, open as long as they are asked for."""

    def __init__(self, log: EventLog) -> None:
        self._log = log

    def add(self, source: Source, place: Callable[[], object] = lambda: None) -> None:
        """Add a source.

        Parameters
        ----------
        place : puts its file where it belongs, once the name is found free; what it raises leaves the log as it was.

        Raises
        ------
        TakenError
            If there is one of that name.
        """
        with self._log.change() as connection:
            lock_seqs(connection)  # one at a time takes a name
            if connection.scalar(select(_SOURCES.name).where(_SOURCES.name == source.name)) is not None:
                raise TakenError(f"source: expected a new name, got {source.name!r}, which is taken")
            place()
            insert_rows(connection, schema.sources, [astuple(source)])

    def remove(self, name: str, forget: Callable[[], object] = lambda: None) -> None:
        """Remove a source, and what `forget` does with its file; one that is not there stays away."""
        with self._log.change() as connection:
            lock_seqs(connection)  # nobody takes the name before its file is gone
            connection.execute(delete(schema.sources).where(_SOURCES.name == name))
            forget()

    def listed(self) -> list[Source]:
        """List the sources by name."""
        return self._log.rows(Source, select(schema.sources).order_by(_SOURCES.name))

    def find(self, name: str) -> Source:
        """Find a source.

        Raises
        ------
        NotInLogError
            If there is none of that name.
        """
        found = self._log.rows(Source, select(schema.sources).where(_SOURCES.name == name))
        if not found:
            raise NotInLogError(f"log {self._log.place.name!r}: expected one of its sources, got {name!r}")
        return found[0]
