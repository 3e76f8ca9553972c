"""Which schema does a log have, and how does it get today's? By Alembic's migrations, in one transaction.

A migration is a file in `migrations` whose revision is the schema version that it makes. The version stands in `meta`,
where every DyKnow has looked for it, so Alembic keeps no table of its own.
"""

import logging
from contextlib import ExitStack, suppress
from importlib.resources import files

from sqlalchemy import Connection, func, inspect, select, update
from sqlalchemy.exc import DBAPIError
from sqlalchemy.schema import CreateIndex, CreateTable

from service.errors import LogError
from service.store import schema
from service.store.databases.database import Database, explained
from service.store.writer import insert_rows

OLDEST_VERSION = 2

_LOGGER = logging.getLogger(__name__)


def read_version(database: Database) -> int | None:
    """Read the schema version of a log that can be used; None where there are no tables yet.

    Raises
    ------
    LogError
        If it is no event log, or has a schema that is newer than ours or was never migrated.
    """
    wanted, engine = "an event log written by dyknow", database.reading()
    try:
        with explained(database, wanted), engine.begin() as connection:
            tables = inspect(connection).get_table_names()
            found = _meta(connection) if schema.meta.name in tables else {}
    finally:
        engine.dispose()
    if not tables:
        return None
    if found.get("application") != schema.APPLICATION:
        raise LogError(f"log {database.name!r}: expected {wanted}, got a database with tables {sorted(tables)[:5]!r}")
    version = found.get("schema_version", "")
    if not version.isdigit() or not OLDEST_VERSION <= int(version) <= schema.SCHEMA_VERSION:
        is_newer = version.isdigit() and int(version) > schema.SCHEMA_VERSION
        hint = "; a newer dyknow reads it" if is_newer else "; process the input again into a new log"
        wanted = f"schema version {OLDEST_VERSION} to {schema.SCHEMA_VERSION}"
        raise LogError(f"log {database.name!r}: expected {wanted}, got {version!r}{hint}")
    return int(version)


def create_schema(connection: Connection) -> None:
    """Create the tables of a new log, in an order of their own: `create_all` takes indexes as a set gives them."""
    if connection.dialect.name == "postgresql":  # where two might make them at once
        connection.execute(select(func.pg_advisory_xact_lock(schema.SCHEMA_VERSION)))
    if inspect(connection).has_table(schema.meta.name):
        return
    for table in schema.metadata.sorted_tables:
        connection.execute(CreateTable(table))
        for index in sorted(table.indexes, key=lambda one: str(one.name)):
            connection.execute(CreateIndex(index))
    values = {"application": schema.APPLICATION, "schema_version": str(schema.SCHEMA_VERSION), "last_seq": "0"}
    insert_rows(connection, schema.meta, list(values.items()))


def up_to_date(database: Database, closing: ExitStack, *, may_be_empty: bool) -> Database:
    """Give a log in today's schema: the log itself where it can be written, else a copy.

    Parameters
    ----------
    may_be_empty : whether there need be no tables yet.
    closing : what is to be done when the log is closed; a copy is removed then.

    Raises
    ------
    LogError
        As `read_version`, if there are no tables, or if the database refuses.
    """
    version = read_version(database)
    if version is None and not may_be_empty:
        raise LogError(f"log {database.name!r}: expected an event log, got an empty database")
    if version in (None, schema.SCHEMA_VERSION):
        return database
    target, how = database, "carried over"
    if not database.can_write():
        target, how = database.copied(closing), "cannot be written, so it is read from a copy that was carried over"
    _carry_over(target)
    _LOGGER.warning("log %r: %s from schema version %s to %s", database.name, how, version, schema.SCHEMA_VERSION)
    return target


def _carry_over(database: Database) -> None:
    """Migrate a log; a process that is killed meanwhile leaves it as it was."""
    from alembic.migration import MigrationContext
    from alembic.operations import Operations
    from alembic.script import ScriptDirectory

    scripts = ScriptDirectory(folder := str(files("service.store") / "migrations"), version_locations=[folder])
    steps = {int(step.revision): step.module for step in scripts.walk_revisions()}
    is_version = schema.meta.c.key == "schema_version"
    engine = database.writing()
    with explained(database, "a log that can be carried over"), engine.begin() as connection:
        version = int(_meta(connection)["schema_version"])  # another process may have been quicker
        with Operations.context(MigrationContext.configure(connection)):
            for one in range(version + 1, schema.SCHEMA_VERSION + 1):
                steps[one].upgrade()
        connection.execute(update(schema.meta).where(is_version).values(value=str(schema.SCHEMA_VERSION)))
    engine.dispose()
    with suppress(LogError):  # while others read it, it stays as large as it was
        database.compact()


def _meta(connection: Connection) -> dict[str, str]:
    try:
        return {key: value for key, value in connection.execute(select(schema.meta.c.key, schema.meta.c.value))}  # noqa: C416
    except DBAPIError:
        return {}  # another program's table of that name
