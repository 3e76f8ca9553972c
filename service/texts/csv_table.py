"""How are users' tables read? Row by row with their places, and with numbers and words as a person would write them.

A table is CSV, or JSON objects, one a line, whose names are the columns: both are looked at by the same rules.

Python's own readers are laxer: `float` takes `1_0`, `nan` and the digits of any script, `csv` a quote that never ends,
rows of any length and NUL, at which NumPy cuts a name short.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

import msgspec

from service.errors import InputError

ROW_SUFFIXES = (".csv", ".jsonl")

TIMES = {"t_us": 1, "t_s": 1_000_000}  # columns of times, and how many microseconds one of theirs is
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d{1,18}", re.ASCII)


def read_table(name: str, lines: Iterable[str], start: int = 1) -> tuple[list[str], Iterator[tuple[str, list[str]]]]:
    """Read the header, and the rows when they are asked for, without the blanks around fields.

    Parameters
    ----------
    name : what messages call the file.
    start : what messages call the first line.

    Returns
    -------
    The names of the columns, and for each row its place `name:line` and its fields.

    Raises
    ------
    InputError
        If the text is no CSV, or (at that row) a row has another number of fields than the header.

    Examples
    --------
    >>> header, rows = read_table("t.csv", ["t_s,id", "", "0.5, car7"])
    >>> header, list(rows)
    (['t_s', 'id'], [('t.csv:3', ['0.5', 'car7'])])
    """
    places = _placed(name, lines, start)
    _, header = next(places, (name, []))
    return header, (_of_width(where, fields, len(header)) for where, fields in places if fields)


def _placed(name: str, lines: Iterable[str], start: int) -> Iterator[tuple[str, list[str]]]:
    """Give the rows with the lines on which they begin: a quoted field may hold line breaks."""
    table = csv.reader(lines, strict=True)  # else a quote that is never closed swallows the rest of the file
    first = start
    try:
        for fields in table:
            yield f"{name}:{first}", [field.strip() for field in fields]
            first = start + table.line_num
    except csv.Error as error:
        raise InputError(f"{name}:{first}: expected a row of a CSV file, got {error}") from error


def _of_width(where: str, fields: list[str], width: int) -> tuple[str, list[str]]:
    if len(fields) != width:
        raise InputError(f"{where}: expected {width} fields, got {len(fields)}")
    return where, fields


class CsvLines:
    """Reads rows of CSV that are whole lines, one by one, so that a wrong one spoils no other.

    Attributes
    ----------
    header : the names of the columns.
    first : the number of the first line that is a row.
    """

    first = 2

    def __init__(self, name: str, line: str) -> None:
        self._name = name
        self.header, _ = read_table(name, [line])

    def fields(self, line: str, number: int) -> list[str]:
        """Read a row, as `read_table` does."""
        fields, _ = read_table(self._name, [line], number)
        return _of_width(f"{self._name}:{number}", fields, len(self.header))[1]


class JsonLines(CsvLines):
    """Reads rows that are JSON objects, whose names are those of the first one; what is absent or null is empty."""

    first = 1

    def __init__(self, name: str, line: str) -> None:
        self._name = name
        self.header = list(self._object(line, 1))

    def fields(self, line: str, number: int) -> list[str]:
        """Read a row; raises `InputError` if it is no object of texts and numbers, or has other names too."""
        found = self._object(line, number)
        if more := found.keys() - self.header:
            expected = f"expected the names of line 1, {', '.join(self.header)}"
            raise InputError(f"{self._name}:{number}: {expected}, got also {', '.join(sorted(more))}")
        return [found.get(one, "") for one in self.header]

    def _object(self, line: str, number: int) -> dict[str, str]:
        try:
            found = msgspec.json.decode(line, type=dict[str, str | int | float | None])
        except (msgspec.MsgspecError, UnicodeError) as error:
            expected = "expected a JSON object of texts and numbers"
            raise InputError(f"{self._name}:{number}: {expected}, got {line.strip()[:80]!r} ({error})") from error
        return {name: "" if value is None else str(value).strip() for name, value in found.items()}


def read_line_by_line(name: str, first: str) -> CsvLines:
    """Say how the lines of a table are read whose first one is this."""
    return (JsonLines if _is_object(first) else CsvLines)(name, first)


def read_rows(name: str, lines: Iterable[str]) -> tuple[list[str], Iterator[tuple[str, list[str]]]]:
    """Read the columns, and the rows when they are asked for, as `read_table`, of a table in either form."""
    left = iter(lines)
    first = next(left, "")
    all_lines = chain([first], left)
    if not _is_object(first):
        return read_table(name, all_lines)  # where a field may hold line breaks
    table = JsonLines(name, first)
    numbered = ((number, line) for number, line in enumerate(all_lines, start=1) if line.strip())
    return table.header, ((f"{name}:{number}", table.fields(line, number)) for number, line in numbered)


def _is_object(line: str) -> bool:
    return line.lstrip().startswith("{")


def refuse_twice(name: str, header: Sequence[str], columns: Iterable[str]) -> None:
    """Refuse a header that has one of these columns twice."""
    for column in columns:
        if header.count(column) > 1:
            raise InputError(f"{name}:1: expected column {column} once, got {header.count(column)} of it")


def read_number(where: str, column: str, text: str, *, is_whole: bool = False) -> float:
    """Read a number.

    Raises
    ------
    InputError
        If it is not written in ASCII digits with a point, a sign and an exponent at most.

    Examples
    --------
    >>> read_number("t.csv:2", "x_m", "-1.5e3")
    -1500.0
    """
    if not (_WHOLE if is_whole else _DECIMAL).fullmatch(text):
        expected = "a whole number" if is_whole else "a number"
        raise InputError(f"{where}: column {column}: expected {expected}, got {text!r}")
    return int(text) if is_whole else float(text)


def read_name(where: str, column: str, text: str) -> str:
    """Read a name; raises `InputError` if it is empty, or holds what cannot be printed on one line."""
    if not text or not text.isprintable():
        raise InputError(f"{where}: column {column}: expected printable letters on one line, got {text!r}")
    return text
