"""How are events read from files? JSONL or CSV, one event a line; docs/cli.md describes both.

Every error names the file and the line.
"""

import io
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from chronicles.adapter import value_text
from chronicles.events import Event
from service.errors import InputError
from service.records.times import MAX_MEDIA_US
from service.texts.chronicle_files import read_text
from service.texts.csv_table import TIMES, read_number, read_table, refuse_twice

EVENT_SUFFIXES = (".jsonl", ".csv")

_ARGUMENT = "arg"


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One event as JSON: `t_us` or `t_s`; a change has `new`, a message neither `old` nor `new`."""

    name: str
    args: tuple[str, ...] = ()
    t_us: int | None = None
    t_s: float | None = None
    old: bool | str | msgspec.UnsetType | None = msgspec.UNSET
    new: bool | str | msgspec.UnsetType | None = msgspec.UNSET


def load_events(path: Path) -> list[Event]:
    """Read all events of a file, in the order of its lines.

    Parameters
    ----------
    path : `.jsonl` or `.csv`.

    Raises
    ------
    InputError
        If the file cannot be read, or at its first line that is no event.
    """
    suffix = path.suffix.lower()
    if suffix not in EVENT_SUFFIXES:
        raise InputError(f"{path}: expected a file of events, {' or '.join(EVENT_SUFFIXES)}, got suffix {suffix!r}")
    lines = io.StringIO(read_text(path, "file of events"))
    return list(_from_jsonl(path, lines) if suffix == ".jsonl" else _from_csv(path, lines))


def _from_jsonl(path: Path, lines: Iterable[str]) -> Iterator[Event]:
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        where = f"{path}:{number}"
        try:
            read = msgspec.json.decode(line, type=_Line)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise InputError(f"{where}: expected an event as one JSON object, got {line[:80]!r} ({error})") from error
        times = {"t_us": read.t_us, "t_s": read.t_s}
        t_us = _only_time(where, {name: value for name, value in times.items() if value is not None})
        yield _event(where, read.name, read.args, t_us, (_value(read.old), _value(read.new)))


def _from_csv(path: Path, lines: Iterable[str]) -> Iterator[Event]:
    header, rows = read_table(str(path), lines)
    _check_header(path, header)
    for where, fields in rows:
        yield _from_row(where, dict(zip(header, fields, strict=True)))


def _check_header(path: Path, header: list[str]) -> None:
    refuse_twice(str(path), header, header)
    arguments = [name for name in header if _is_argument(name)]
    unknown = set(header) - {*TIMES, "name", "old", "new", *arguments}
    if unknown or "name" not in header or not set(TIMES) & set(header):
        wanted = "columns t_us or t_s, name, arg1, arg2, ..., old, new"
        raise InputError(f"{path}:1: expected {wanted}, got {', '.join(header) or 'an empty file'}")
    if set(arguments) != {f"{_ARGUMENT}{place}" for place in range(1, len(arguments) + 1)}:
        raise InputError(f"{path}:1: expected arg1, arg2, ... without a gap, got {', '.join(arguments)}")


def _is_argument(name: str) -> bool:
    return name.startswith(_ARGUMENT) and name.removeprefix(_ARGUMENT).isdecimal()


def _from_row(where: str, row: Mapping[str, str]) -> Event:
    times = {name: read_number(where, name, row[name], is_whole=name == "t_us") for name in TIMES if row.get(name)}
    places = sorted((int(name.removeprefix(_ARGUMENT)), value) for name, value in row.items() if _is_argument(name))
    values = [value for _, value in places]
    while values and not values[-1]:
        values.pop()  # a shorter list of arguments leaves its last cells empty
    t_us = _only_time(where, times)
    return _event(where, row["name"], tuple(values), t_us, (row.get("old") or None, row.get("new") or None))


def _only_time(where: str, times: Mapping[str, float]) -> int:
    if len(times) != 1:
        raise InputError(f"{where}: expected either t_us or t_s, got {' and '.join(times) or 'neither'}")
    [(name, value)] = times.items()
    if not math.isfinite(value) or not 0 <= value * TIMES[name] <= MAX_MEDIA_US:
        raise InputError(f"{where}: {name}: expected 0 to {MAX_MEDIA_US // TIMES[name]}, got {value!r}")
    return round(value * TIMES[name])


def _value(read: bool | str | msgspec.UnsetType | None) -> str | None:
    return None if read is msgspec.UNSET else value_text(read)


def _event(where: str, name: str, args: tuple[str, ...], t_us: int, change: tuple[str | None, str | None]) -> Event:
    """Make an event of what a line says; the old value is unknown where only the new one is given."""
    old, new = change
    if not all(one and one.isprintable() for one in (name, *args)):
        expected = "expected a name and arguments that are not empty and fit on a line"
        raise InputError(f"{where}: {expected}, got {name!r} of {list(args)!r}")
    if new is None and old is not None:
        raise InputError(f"{where}: expected 'new' beside 'old', got 'old' alone")
    return Event(name, args, t_us, "unknown" if new is not None and old is None else old, new)
