"""What of an event log is pinned, in a form that can be read and diffed?

A log becomes tables of named columns. What changes with every version (digests, texts, the software) is masked. Numbers
that only count rows are left out, since the order of the rows says the same, and identifiers that hold such numbers
become words: an event is named by what it says, a link by what it joins. The two large tables of positions keep the
rows of every fifth frame; a table beside each has the means over all rows of every car, and how many there are.
"""

import json
import re
import sqlite3
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean

from msgspec.structs import astuple

from service.store.chunks.kinds import CHUNK_KINDS
from service.store.chunks.packing import unpacked
from service.store.log import EventLog, open_log

EVERY = 5
"""Of positions, the rows of each so many-th frame are pinned."""

NOT_PINNED = frozenset({"chunks", "costs", "alembic_version"})
"""Chunks are pinned by what is in them, costs are measured by a clock, the version of the schema is no behaviour."""

MASK = "*"
_THINNED = {"car_states": "car", "seen_objects": "vision_id"}
_DECIMALS = {"_m": 4, "_px": 4, "_mps": 4, "_rad": 5, "_hz": 4}
_COUNTING = {"events": "seq", "links": "number", "hypotheses": "number"}

Row = dict[str, object]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of named columns, in the order of the log."""

    name: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


def read_log(path: Path) -> dict[str, Table]:
    """Read all pinned tables of a log with one run."""
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as log:
        names = [name for (name,) in log.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")]
        raw = {name: _read(log, name) for name in names if name not in NOT_PINNED and not name.startswith("sqlite_")}
    with open_log(str(path)) as opened:
        raw |= {name: _unpacked(opened, name) for name in CHUNK_KINDS}
    raw = dict(sorted(raw.items()))
    words = _Words.of(raw)
    tables: dict[str, Table] = {}
    for name, table in raw.items():
        if name in _THINNED:
            tables[f"{name}.lives"] = _lives(table, _THINNED[name])
        kept = _thinned(table, raw["frames"]) if name in _THINNED else table
        columns = tuple(column for column in table.columns if column != _COUNTING.get(name))
        rows = ({column: words.plain(column, row[column]) for column in columns} for row in kept.rows)
        tables[name] = Table(name, columns, tuple(_masked(name, row) for row in rows))
    return tables


def write_tables(tables: dict[str, Table], path: Path) -> None:
    """Write a line for each table, with its columns, and under it one for each row.

    The former begins with a letter, so that `git diff` says in which table a change lies.
    """
    lines: list[str] = []
    for table in tables.values():
        lines.append(" ".join([table.name, *table.columns]))
        lines += (json.dumps([row[one] for one in table.columns]) for row in table.rows)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_tables(path: Path) -> dict[str, Table]:
    """Read what `write_tables` wrote."""
    tables: dict[str, Table] = {}
    rows_of: dict[str, list[Row]] = {}
    name, columns = "", []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            rows_of[name].append(dict(zip(columns, json.loads(line), strict=True)))
        else:
            name, *columns = line.split(" ")
            tables[name], rows_of[name] = Table(name, tuple(columns), ()), []
    return {name: replace(table, rows=tuple(rows_of[name])) for name, table in tables.items()}


def _read(log: sqlite3.Connection, name: str) -> Table:
    cursor = log.execute(f"SELECT * FROM {name} ORDER BY {_order(log, name)}")
    columns = tuple(one[0] for one in cursor.description)
    rows = tuple({column: _parsed(value) for column, value in zip(columns, row, strict=True)} for row in cursor)
    return Table(name, columns, rows)


def _unpacked(log: EventLog, name: str) -> Table:
    """Lay out rows that are kept in chunks as a table."""
    kind = CHUNK_KINDS[name]
    fields = kind.record.__struct_fields__
    found = map(astuple, unpacked(kind, log.chunks(log.run().id, kind)))
    rows = tuple({"run_no": 1} | dict(zip(fields, map(_plain, row), strict=True)) for row in found)
    return Table(name, ("run_no", *fields), rows)


def _plain(value: object) -> object:
    """Write a value as JSON can."""
    return list(value) if isinstance(value, tuple) else int(value) if isinstance(value, bool) else value


def _order(log: sqlite3.Connection, name: str) -> str:
    """Order by the primary key."""
    key = [(place, column) for _, column, _, _, _, place in log.execute(f"PRAGMA table_info({name})") if place]
    return ", ".join(column for _, column in sorted(key)) or "1"


def _parsed(value: object) -> object:
    """Take a cell that holds JSON for what it says."""
    if isinstance(value, str) and value[:1] in ("{", "["):
        return json.loads(value)
    return value


def _lives(table: Table, key: str) -> Table:
    """Tell of each car when it was first and last there, how many rows it has, and the means of its numbers."""
    rows_of: dict[str, list[Row]] = defaultdict(list)
    for row in table.rows:
        rows_of[str(row[key])].append(row)
    numbers = tuple(one for one in table.columns if any(isinstance(row[one], float) for row in table.rows))
    lives: list[Row] = []
    for one, rows in sorted(rows_of.items()):
        life: Row = {key: one, "first_us": rows[0]["t_us"], "last_us": rows[-1]["t_us"], "rows": len(rows)}
        known = {column: [value for row in rows if isinstance(value := row[column], float)] for column in numbers}
        means = {column: fmean(values) if values else None for column, values in known.items()}
        lives.append(life | {column: _rounded(column, mean) for column, mean in means.items()})
    return Table(f"{table.name}.lives", (key, "first_us", "last_us", "rows", *numbers), tuple(lives))


def _thinned(table: Table, frames: Table) -> Table:
    kept = {row["t_us"] for row in frames.rows[::EVERY]}
    return Table(table.name, table.columns, tuple(row for row in table.rows if row["t_us"] in kept))


@dataclass(frozen=True, slots=True)
class _Words:
    """Words instead of identifiers that hold digests or running numbers."""

    run: str
    links: dict[str, str]
    events: dict[str, str]
    seqs: dict[object, str]

    @classmethod
    def of(cls, tables: dict[str, Table]) -> "_Words":
        labels = sorted({str(row["label"]) for row in tables["hypotheses"].rows}, key=_link_number)
        said = {str(row["id"]): _said(row) for row in tables["events"].rows}
        events = _numbered(said, lambda event: said[event])
        seqs = {row["seq"]: events[str(row["id"])] for row in tables["events"].rows}
        links = _numbered(labels, lambda label: label.partition("#")[0])
        return cls(str(tables["runs"].rows[0]["id"]), links, events, seqs)

    def plain(self, column: str, value: object) -> object:
        """Put words in, and cut decimals that nobody compares."""
        if isinstance(value, dict):
            return {key: self.plain(key, one) for key, one in value.items() if key != "seq"}
        if isinstance(value, list):
            plain = [self.plain(column, one) for one in value]
            return sorted(plain, key=str) if column == "hypotheses" else plain
        if column == "seq":
            return self.seqs.get(value, value)
        if isinstance(value, float):
            return _rounded(column, value)
        if isinstance(value, str):
            return "run" if value == self.run else self.links.get(value) or self.events.get(value) or value
        return value


def _link_number(label: str) -> int:
    return int(label.partition("#")[2] or 0)


def _said(event: Row) -> str:
    body = event["body"]
    assert isinstance(body, dict)
    return " ".join([str(event["type"]), *(f"{role}={actor}" for role, actor in body["roles"].items()), body["status"]])


def _numbered(keys: Iterable[str], name: Callable[[str], str]) -> dict[str, str]:
    """Name keys; from the second one of the same name on by the how many-th it is, too."""
    times: Counter[str] = Counter()
    names: dict[str, str] = {}
    for key in keys:
        times[name(key)] += 1
        names[key] = name(key) if times[name(key)] == 1 else f"{name(key)} #{times[name(key)]}"
    return names


def _rounded(column: str, value: float | None) -> float | None:
    digits = next((digits for end, digits in _DECIMALS.items() if column.endswith(end)), 9)
    return None if value is None else round(value, digits)


def _masked(table: str, row: Row) -> Row:
    """Mask what every version of the program changes."""
    if table == "meta" and row["key"] == "schema_version":
        return row | {"value": MASK}
    body = row.get("body")
    if not isinstance(body, dict):
        return row
    if table == "runs":
        moved = {name: body[name] | {"path": MASK} for name in ("file", "site_file") if body.get(name)}
        body = body | {"software": MASK} | moved
        for part in ("chronicles", "monitors", "texts"):
            body[part] = [one | {key: MASK for key in ("version", "text") if one.get(key)} for one in body[part]]
    if table == "events":
        body = body | {"chronicle": body["chronicle"] | {"version": MASK}}
    if table == "streams" and body["last_value"] is not None:
        body = body | {"last_value": re.sub(r"\d+(\.\d+)?", MASK, body["last_value"])}
    return row | {"body": body}


def leaves(column: str, value: object) -> Iterator[tuple[str, object]]:
    """List the values inside a cell with the way to each; a list of records or numbers also has its length.

    Examples
    --------
    >>> list(leaves("body", {"roles": {"car": "car7"}, "parts": [{"t_us": 3}], "args": ["a", "b"]}))
    [('body.roles.car', 'car7'), ('body.parts[]', 1), ('body.parts[0].t_us', 3), ('body.args', ['a', 'b'])]
    """
    if isinstance(value, dict):
        for key, one in value.items():
            yield from leaves(f"{column}.{key}", one)
    elif isinstance(value, list) and not all(isinstance(one, str) for one in value):
        yield f"{column}[]", len(value)
        for place, one in enumerate(value):
            yield from leaves(f"{column}[{place}]", one)
    else:
        yield column, value
