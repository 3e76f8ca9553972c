"""How are the tables of a page, and the declarations of a chronicle text, read for comparison?"""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS, LIBRARY = ROOT / "docs", ROOT / "chronicles" / "library"


def page(name: str) -> str:
    """Give the text of a page of docs."""
    return (DOCS / name).read_text(encoding="utf-8")


def table(name: str, first: str) -> list[list[str]]:
    """Give the cells of the table of a page whose head begins with a word, row by row and without its head.

    Raises
    ------
    AssertionError
        If there is no such table.
    """
    lines = iter(page(name).splitlines())
    for line in lines:
        if cells(line)[:1] == [first]:
            next(lines)
            return list(_rows(lines))
    raise AssertionError(f"docs/{name}: expected a table that begins with {first!r}, got none")


def _rows(lines: Iterator[str]) -> Iterator[list[str]]:
    for line in lines:
        if not line.startswith("|"):
            return
        yield cells(line)


def cells(line: str) -> list[str]:
    r"""Split a row; ``\|`` is no border.

    Examples
    --------
    >>> cells("| `a` | \\|g\\| <= h |")
    ['`a`', '|g| <= h']
    """
    if not line.startswith("|"):
        return []
    return [cell.strip().replace(r"\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def terms(cell: str) -> dict[str, tuple[str, ...]]:
    """Read the names with arguments in a cell.

    Examples
    --------
    >>> terms("`left[a,b]`, `turn[from,junction,to]`")
    {'left': ('a', 'b'), 'turn': ('from', 'junction', 'to')}
    """
    return {name: tuple(inside.split(",")) for name, inside in re.findall(r"`(\w+)\[([\w,]*)\]`", cell)}


def declared(text: str, kind: str) -> dict[str, tuple[tuple[str, str], ...]]:
    """Read the declarations of attributes or messages: for each argument its name and domain, a value last.

    Examples
    --------
    >>> declared("attribute on[?car, ?road] { ?car in Car  ?road in Road  value in Truth }", "attribute")
    {'on': (('car', 'Car'), ('road', 'Road'), ('value', 'Truth'))}
    """
    found: dict[str, tuple[tuple[str, str], ...]] = {}
    for name, arguments, body in re.findall(rf"^{kind} (\w+)\[([^\]]*)\] \{{([^}}]*)\}}", text, re.MULTILINE):
        domains = dict(re.findall(r"\??(\w+) in (\w+)", body))
        wanted = [*re.findall(r"\?(\w+)", arguments), *(["value"] if "value" in domains else [])]
        found[name] = tuple((one, domains.get(one, "")) for one in wanted)
    return found
