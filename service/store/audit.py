"""Who changed something over HTTP, when, and with what answer? A row each in the log."""

from msgspec import Struct
from msgspec.structs import asdict
from sqlalchemy import insert, select

from service.store import schema
from service.store.log import EventLog


class Written(Struct, frozen=True):
    """A request that may have changed something.

    Attributes
    ----------
    at_us : when it was answered, since 1970-01-01 UTC.
    token : the name of the token, or `loopback`.
    status : of the answer; from 400 on nothing was changed.
    """

    at_us: int
    token: str
    method: str
    path: str
    status: int
    request_id: str


def note_written(log: EventLog, one: Written) -> None:
    """Add a row at the end."""
    with log.change() as connection:
        connection.execute(insert(schema.audit).values(asdict(one)))


def list_written(log: EventLog, *, limit: int) -> list[Written]:
    """List the newest rows, the newest first."""
    table = schema.audit
    columns = [table.c[name] for name in Written.__struct_fields__]
    with log.connect() as connection:
        return [
            Written(*row) for row in connection.execute(select(*columns).order_by(table.c.number.desc()).limit(limit))
        ]
