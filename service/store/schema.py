"""Which tables hold an event log, and which indexes make its questions cheap?

Rows belong to a run by its number `run_no`. An event is stored whole, as the JSON text that is sent out, beside the
columns that filters use: it never changes, so the text never goes stale, and reading a page costs no assembly.
`event_roles` answers "with this car"; `revisions` says which events have a newer state; `durations` keeps the longest
event of each type, which bounds how far back a search for overlapping intervals must look. What comes by the thousand
in a minute (cars, vision objects, relation changes, frames, views) lies in `chunks`. All tables use only types and
constraints that SQLite and PostgreSQL share.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import sqlalchemy as sa
from msgspec import Struct, inspect

from service.records.seen import CarRecord, HypothesisRecord, LinkRecord
from service.store.entries import ChronicleText, Job, Source, Token, Undelivered, WebhookState, Written

SCHEMA_VERSION = 11  # one more, and a file in `migrations`, for each change of the tables below
APPLICATION = "dyknow event log"
HIDDEN_STATUSES = ("retracted", "doubtful")
"""Of events that only who asks for them is told of."""

metadata = sa.MetaData()
_IS_HIDDEN = sa.column("status").in_(HIDDEN_STATUSES)


class JsonArray(sa.TypeDecorator[tuple[Any, ...]]):  # Any: of texts or numbers
    """A JSON array, read as a tuple; the writer makes the text."""

    impl = sa.Text
    cache_ok = True

    def process_result_value(self, value: str | None, dialect: sa.Dialect) -> tuple[Any, ...]:
        """Read what a row holds."""
        return tuple(msgspec.json.decode(value or "[]"))


def _run_table(name: str, *items: sa.Column[Any] | sa.Index, with_rowid: bool = False) -> sa.Table:
    """Make a table of which rows belong to a run; the key begins with it."""
    run_no = sa.Column("run_no", sa.Integer, primary_key=True)
    return sa.Table(name, metadata, run_no, *items, sqlite_with_rowid=with_rowid)


def _numbered_table(name: str, *items: sa.Column[Any] | sa.Index) -> sa.Table:
    """Make a table of which rows keep the order in which the run wrote them, by a column `number`."""
    return _run_table(name, sa.Column("number", sa.Integer, primary_key=True), *items, with_rowid=True)


_COLUMN_TYPES = {
    inspect.BoolType: sa.Boolean,
    inspect.FloatType: sa.Float,
    inspect.StrType: sa.Text,
    inspect.LiteralType: sa.Text,
    inspect.VarTupleType: JsonArray,
}


def _columns(kind: type[Struct], *key: str) -> Iterator[sa.Column[Any]]:
    """Give a column for each field of a struct, in its order and by its type; what may be None may be NULL."""
    described = inspect.type_info(kind)
    assert isinstance(described, inspect.StructType)
    for field in described.fields:
        types = field.type.types if isinstance(field.type, inspect.UnionType) else (field.type,)
        whole = sa.BigInteger if field.name.endswith(("_us", "seq", "size")) else sa.Integer
        sql_type = whole if isinstance(types[0], inspect.IntType) else _COLUMN_TYPES[type(types[0])]
        yield sa.Column(
            field.name, sql_type, primary_key=field.name in key, nullable=len(types) > 1, autoincrement=False
        )


# Keys: application, schema_version, last_seq.
meta = sa.Table(
    "meta", metadata, sa.Column("key", sa.Text, primary_key=True), sa.Column("value", sa.Text, nullable=False)
)

runs = sa.Table(
    "runs",
    metadata,
    sa.Column("run_no", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("source", sa.Text, nullable=False),
    sa.Column("start_utc_us", sa.BigInteger, nullable=False),
    sa.Column("first_pts_us", sa.BigInteger),  # what a player of the video shows at media time 0; empty without a video
    sa.Column("status", sa.Text, nullable=False),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("body", sa.Text, nullable=False),  # RunRecord as JSON; status and reason above win over the body's
)

# `seq` is handed out by the writer from meta.last_seq, inside the transaction that writes the rows. So a number is
# never used twice, even after a run is replaced, and numbers appear to readers in their order.
events = sa.Table(
    "events",
    metadata,
    sa.Column("seq", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True, autoincrement=False),
    sa.Column("id", sa.Text, nullable=False, unique=True),
    sa.Column("run_no", sa.Integer, nullable=False),
    sa.Column("type", sa.Text, nullable=False),
    sa.Column("source", sa.Text, nullable=False),
    sa.Column("start_us", sa.BigInteger, nullable=False),
    sa.Column("end_us", sa.BigInteger, nullable=False),
    sa.Column("start_utc_us", sa.BigInteger, nullable=False),
    sa.Column("road", sa.Text, nullable=False),
    sa.Column("status", sa.Text, nullable=False),
    sa.Column("confidence", sa.Float, nullable=False),
    sa.Column("body", sa.Text, nullable=False),  # EventRecord as JSON
    sa.Index("events_by_start", "start_us", "seq"),
    sa.Index("events_by_type", "type", "start_us", "seq"),
    sa.Index("events_by_source", "source", "start_us", "seq"),
    sa.Index("events_by_road", "road", "start_us", "seq"),
    sa.Index("events_by_run", "run_no", "start_us", "seq"),
    # Few among many.
    sa.Index("events_by_status", "status", "start_us", "seq", sqlite_where=_IS_HIDDEN, postgresql_where=_IS_HIDDEN),
)

event_roles = sa.Table(
    "event_roles",
    metadata,
    sa.Column("seq", sa.BigInteger, nullable=False),
    sa.Column("role", sa.Text, nullable=False),
    sa.Column("actor", sa.Text, nullable=False),
    sa.Column("start_us", sa.BigInteger, nullable=False),
    sa.PrimaryKeyConstraint("seq", "role"),
    sa.Index("event_roles_by_actor", "actor", "start_us", "seq", "role"),
    sqlite_with_rowid=False,
)

# Which events have a newer state. A table of its own, since events are never edited. The key comes first: where it does
# not, the check of SQLite 3.40 takes values for missing ones.
revisions = sa.Table(
    "revisions",
    metadata,
    sa.Column("revised", sa.Text, primary_key=True),  # events.id
    sa.Column("run_no", sa.Integer, nullable=False),
    sqlite_with_rowid=False,
)

durations = _run_table(
    "durations", sa.Column("type", sa.Text, primary_key=True), sa.Column("longest_us", sa.BigInteger, nullable=False)
)

# Which roles the events of a type have: the columns of a CSV export, known before its first row.
role_names = _run_table(
    "role_names", sa.Column("type", sa.Text, primary_key=True), sa.Column("role", sa.Text, primary_key=True)
)

# `number` is 1, 2, ... in order of first sight within the run, `car_class` the last one that was not `unknown`.
cars = _run_table("cars", *_columns(CarRecord, "car"))

# What `service.store.chunks.kinds` keeps together. `number` counts the chunks of a run in the order of writing.
chunks = _run_table(
    "chunks",
    sa.Column("kind", sa.Text, primary_key=True),
    sa.Column("span_us", sa.BigInteger, primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True),
    sa.Column("first_us", sa.BigInteger, nullable=False),
    sa.Column("last_us", sa.BigInteger, nullable=False),
    sa.Column("rows", sa.Integer, nullable=False),
    sa.Column("data", sa.LargeBinary),  # NULL of one that was pruned
    with_rowid=True,
)

# Changes of one frame depend on each other, so they keep their order.
links = _numbered_table("links", *_columns(LinkRecord), sa.Index("links_by_upper", "run_no", "upper", "number"))
hypotheses = _numbered_table(
    "hypotheses", *_columns(HypothesisRecord), sa.Index("hypotheses_by_label", "run_no", "label")
)

# Which table has the records of a kind, a column for each field.
TABLE_OF: Mapping[type[Struct], sa.Table] = {CarRecord: cars, LinkRecord: links, HypothesisRecord: hypotheses}

# One row for each process of the run, written at its end: inputs before what reads them.
streams = _numbered_table("streams", sa.Column("body", sa.Text, nullable=False))  # StreamRecord as JSON

# What a clock measured of each process, in microseconds in its code: the one table in which a repeated run differs.
costs = _numbered_table(
    "costs", sa.Column("label", sa.Text, nullable=False), sa.Column("busy_us", sa.BigInteger, nullable=False)
)

# What is still to be processed. It belongs to no run, since none has begun.
jobs = sa.Table("jobs", metadata, *_columns(Job, "number"), sa.UniqueConstraint("id"))

# What was given up is kept with its text, since a run may be repeated.
webhooks = sa.Table("webhooks", metadata, *_columns(WebhookState, "name"))
undelivered = sa.Table("undelivered", metadata, *_columns(Undelivered, "webhook", "seq"))

# Who may ask over HTTP, and who has written; of a token only a digest is known.
tokens = sa.Table("tokens", metadata, *_columns(Token, "name"))
audit = sa.Table("audit", metadata, sa.Column("number", sa.Integer, primary_key=True), *_columns(Written))

# What is processed by its name: a file that was uploaded, or one that the operator allows.
sources = sa.Table("sources", metadata, *_columns(Source, "name"))

# A version is never edited; one without a text says that the chronicles of that name ended.
chronicle_texts = sa.Table("chronicle_texts", metadata, *_columns(ChronicleText, "name", "version"))

# Everything that goes when a run is replaced, but the run itself and the roles of its events.
RUN_TABLES = tuple(table for table in metadata.tables.values() if "run_no" in table.c and table is not runs)
