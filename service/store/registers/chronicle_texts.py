"""Which chronicle texts does a log hold, and which did it hold before? Versions that are never edited."""

import time

from msgspec.structs import astuple
from sqlalchemy import Connection, exists, select

from service.errors import NotInLogError, VersionError
from service.store import schema
from service.store.entries import ChronicleText
from service.store.log import EventLog
from service.store.writer import insert_rows, lock_seqs

_TEXTS = schema.chronicle_texts.c


class ChronicleTexts:
    """The chronicle texts of one log, open as long as they are asked for.

    Examples
    --------
    >>> with open_log("demo.db") as log:      # doctest: +SKIP
    ...     version = ChronicleTexts(log).put("tailgate", "chronicle tailgate[?a, ?b](t) { ... }", None).version
    """

    def __init__(self, log: EventLog) -> None:
        self._log = log

    def put(self, name: str, text: str, expected: int | None) -> ChronicleText:
        """Store a text as the newest version of its name.

        Parameters
        ----------
        expected : the version that it takes the place of; None if there is none, or if the last one ended.

        Raises
        ------
        VersionError
            If another version is the newest one.
        """
        return self._add(name, text, expected)

    def end(self, name: str, expected: int) -> ChronicleText:
        """End a text; raises as `put`."""
        return self._add(name, None, expected)

    def current(self) -> list[ChronicleText]:
        """List the newest versions by name, without those that ended."""
        later = schema.chronicle_texts.alias()
        is_newest = ~exists().where(later.c.name == _TEXTS.name, later.c.version > _TEXTS.version)
        query = select(schema.chronicle_texts).where(is_newest, _TEXTS.text.is_not(None)).order_by(_TEXTS.name)
        return self._log.rows(ChronicleText, query)

    def versions(self, name: str) -> list[ChronicleText]:
        """List all versions of a name, oldest first.

        Raises
        ------
        NotInLogError
            If there never was one.
        """
        query = select(schema.chronicle_texts).where(_TEXTS.name == name).order_by(_TEXTS.version)
        found = self._log.rows(ChronicleText, query)
        if not found:
            raise NotInLogError(f"log {self._log.place.name!r}: expected one of its chronicle texts, got {name!r}")
        return found

    def _add(self, name: str, text: str | None, expected: int | None) -> ChronicleText:
        with self._log.change() as connection:
            lock_seqs(connection)  # one at a time takes a version
            newest = _newest(connection, name)
            came = newest.version if newest and newest.text is not None else None
            if came != expected:
                wanted, there = (f"version {one}" if one else "none" for one in (expected, came))
                raise VersionError(f"chronicle text {name!r}: expected {wanted} as the newest, got {there}")
            added = ChronicleText(name, newest.version + 1 if newest else 1, text, time.time_ns() // 1_000)
            insert_rows(connection, schema.chronicle_texts, [astuple(added)])
            return added


def _newest(connection: Connection, name: str) -> ChronicleText | None:
    query = select(schema.chronicle_texts).where(_TEXTS.name == name).order_by(_TEXTS.version.desc()).limit(1)
    row = connection.execute(query).one_or_none()
    return ChronicleText(*row) if row else None
