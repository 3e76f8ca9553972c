"""Who changed something over HTTP, when, and with what answer? A row each in the log."""

from msgspec.structs import asdict
from sqlalchemy import insert, select

from service.store import schema
from service.store.entries import Written
from service.store.log import EventLog


def note_written(log: EventLog, one: Written) -> None:
    """Add a row at the end."""
    with log.change() as connection:
        connection.execute(insert(schema.audit).values(asdict(one)))


def list_written(log: EventLog, *, limit: int) -> list[Written]:
    """List the newest rows, the newest first."""
    table = schema.audit
    columns = [table.c[name] for name in Written.__struct_fields__]
    return log.rows(Written, select(*columns).order_by(table.c.number.desc()).limit(limit))
