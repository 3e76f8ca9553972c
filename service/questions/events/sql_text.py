"""How is a question to the log put together as text, and asked?

SQLAlchemy's expressions take longer to build than SQLite takes for the answer.
"""

from collections.abc import Iterable
from itertools import chain
from typing import Any

from sqlalchemy import Connection

from service.store.databases.database import driver_rows

Sql = tuple[str, tuple[object, ...]]
"""A piece of SQL, and a value for each of its question marks."""


def one_of(column: str, values: tuple[object, ...]) -> list[Sql]:
    """Ask that a column has one of some values; nothing, if there are none."""
    if not values:
        return []
    distinct = tuple(dict.fromkeys(values))
    return [(f"{column} IN ({', '.join('?' * len(distinct))})", distinct)]


def all_of(conditions: Iterable[Sql]) -> Sql:
    """Join one or more conditions by *and*."""
    texts, values = zip(*conditions, strict=True)
    return " AND ".join(texts), tuple(chain.from_iterable(values))


# Any: whatever the one column of the one row holds.
def value_of(connection: Connection, query: str, *values: object) -> Any:
    """Give the one column of the first row; None if there is no row."""
    return next(iter(values_of(connection, query, *values)), None)


def values_of(connection: Connection, query: str, *values: object) -> list[Any]:
    """Give the first column of all rows."""
    return [row[0] for row in rows_of(connection, query, *values)]


def rows_of(connection: Connection, query: str, *values: object) -> list[tuple[Any, ...]]:
    """Ask a question; its values stand where its question marks are."""
    if connection.dialect.name != "sqlite":
        query = query.replace("%", "%%").replace("?", "%s")
    return driver_rows(connection, query, values)


def number_of(connection: Connection, query: str, *values: object) -> int:
    """Give the number in the first row; 0 if there is none."""
    return int(value_of(connection, query, *values) or 0)
