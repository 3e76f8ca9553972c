"""Which database does a user name?

A log is named by `sqlite:///path`, by a plain path that ends in `.db`, or by `postgresql+psycopg://...`. Other schemes
are refused here, in words, before anything is touched.
"""

import re
from pathlib import Path
from typing import TYPE_CHECKING

from service.errors import LogError

if TYPE_CHECKING:
    from service.store.databases.database import Database

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_SQLITE = "sqlite:///"
_POSTGRES = "postgresql+psycopg://"
_WANTED = f"expected PATH.db, {_SQLITE}PATH or {_POSTGRES}..."


def database_of(url: str) -> "Database":
    """Find the database of a log by its name.

    Raises
    ------
    LogError
        If the scheme is unknown, or the name has no scheme and does not end in `.db`.
    """
    # What opens a database takes long to load; the names of logs are asked for without.
    if not url.startswith(_POSTGRES):
        from service.store.databases.sqlite_file import SqliteFile

        return SqliteFile(log_file(url))
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import ArgumentError

    from service.store.databases.postgres_server import PostgresServer

    try:
        return PostgresServer(make_url(url))
    except (ArgumentError, ValueError) as error:
        raise LogError(f"log: expected {_POSTGRES}USER:PASSWORD@HOST:PORT/DATABASE, got {str(error)!r}") from error


def log_file(url: str) -> Path:
    """Turn the name of a log into the path of its SQLite file.

    Raises
    ------
    LogError
        If it is none.

    Examples
    --------
    >>> log_file("sqlite:///out/demo.db").as_posix()
    'out/demo.db'
    >>> log_file("sqlite:////data/demo.db").as_posix()
    '/data/demo.db'
    >>> log_file("ftp://a")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    service.errors.LogError: log 'ftp://a': expected PATH.db, ..., got scheme 'ftp'
    """
    scheme = _SCHEME.match(url)
    if scheme and not url.startswith(_SQLITE):
        raise LogError(f"log {url!r}: {_WANTED}, got scheme {scheme[1]!r}")
    path = url.removeprefix(_SQLITE)
    if not path or path == ":memory:" or (not scheme and not path.endswith(".db")):
        raise LogError(f"log {url!r}: {_WANTED}, got {path!r}")
    return Path(path)


def shown(name: str) -> str:
    """Give the name of a log as it may be shown, without a password.

    Examples
    --------
    >>> shown("a.db"), shown("postgresql+psycopg://road:secret@db/log")
    ('a.db', 'postgresql+psycopg://road:***@db/log')
    """
    return re.sub(r"(://[^/:@]*):[^/@]+@", r"\1:***@", name)


def log_files(url: str) -> list[Path]:
    """List the files that a log is read from: one, or none if it lies on a server."""
    return [] if url.startswith(_POSTGRES) else [log_file(url)]


def is_log_name(name: str) -> bool:
    """Tell whether a name is meant as that of a log, rather than of another file.

    Examples
    --------
    >>> is_log_name("sqlite:///a"), is_log_name("a.db"), is_log_name("a.csv")
    (True, True, False)
    """
    return _SCHEME.match(name) is not None or name.endswith(".db")
