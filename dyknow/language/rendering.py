"""How are findings written for programs: editors, and the annotations of a code host?

`Diagnostic.render` in `diagnostics.py` is the form for people.
"""

import json
from collections.abc import Iterable

from dyknow.language.diagnostics import Diagnostic
from dyknow.language.places import Place

Range = dict[str, dict[str, int]]


def render_json(diagnostics: Iterable[Diagnostic]) -> str:
    r"""Write findings as a list of objects with ranges as the Language Server Protocol has them.

    Lines and columns count from 0, and columns count UTF-16 units. `edit` is null, or has the `range` to replace, which
    is that of the finding, and the `newText`.

    Examples
    --------
    >>> found = Diagnostic("C0201", "error", "no name", "a", 1, 4, 6, "\U0001f6b6: ab", "did you mean 'b'?", "b")
    >>> [parsed] = json.loads(render_json([found]))
    >>> parsed["range"], parsed["edit"]["newText"]
    ({'start': {'line': 0, 'character': 4}, 'end': {'line': 0, 'character': 6}}, 'b')
    """
    return json.dumps([_as_json(found) for found in diagnostics], ensure_ascii=False, indent=2)


def render_github(diagnostics: Iterable[Diagnostic]) -> str:
    r"""Write findings as workflow commands of GitHub, one a line, which show them beside the changed lines.

    Examples
    --------
    >>> found = Diagnostic("C0201", "error", "100% unknown", "a,b.chronicle", 3, 9, 14, "", "see a")
    >>> render_github([found])
    '::error file=a%2Cb.chronicle,line=3,col=9,endColumn=14,title=C0201::100%25 unknown%0Ahelp: see a'
    """
    return "\n".join(map(_as_command, diagnostics))


def _as_json(found: Diagnostic) -> dict[str, object]:
    place = _range(found)
    return {
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "file": found.file,
        "range": place,
        "hint": found.hint,
        "edit": None if found.edit is None else {"range": place, "newText": found.edit},
        "related": [{"file": one.file, "range": _range(one), "message": one.label} for one in found.related],
    }


def _range(place: Diagnostic | Place) -> Range:
    columns = [_utf16_length(place.source_line[: column - 1]) for column in (place.column, place.end_column)]
    start, end = ({"line": place.line - 1, "character": column} for column in columns)
    return {"start": start, "end": end}


def _utf16_length(text: str) -> int:
    return len(text.encode("utf-16-le")) // 2


def _as_command(found: Diagnostic) -> str:
    properties = {
        "file": found.file,
        "line": found.line,
        "col": found.column,
        "endColumn": found.end_column,
        "title": found.code,
    }
    written = ",".join(f"{name}={_escaped_property(str(value))}" for name, value in properties.items())
    parts = [found.message, *(f"{one.file}:{one.line}: {one.label}" for one in found.related)]
    if found.hint:
        parts.append(f"help: {found.hint}")
    message = _escaped("\n".join(parts))
    return f"::{found.severity} {written}::{message}"


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escaped_property(text: str) -> str:
    return _escaped(text).replace(":", "%3A").replace(",", "%2C")
