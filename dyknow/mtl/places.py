"""Where in its text is a part of a parse tree?"""

from __future__ import annotations

from typing import Any, TypeAlias  # Any: lark leaves the children of a tree untyped

from lark import Token, Tree

from dyknow.language.diagnostics import Span

Node: TypeAlias = Any  # a Tree, whose children lark types as trees or anything


def span_of(part: Node | Token) -> Span:
    """Give the place of a word or a tree.

    Examples
    --------
    >>> span_of(Token("NAME", "green", line=2, column=8, end_line=2, end_column=13))
    Span(line=2, column=8, end_line=2, end_column=13)
    """
    at = part.meta if isinstance(part, Tree) else part
    line, column = at.line or 1, at.column or 1
    return Span(line, column, at.end_line or line, at.end_column or column + 1)


def operands(parts: list[Any]) -> list[Node]:
    """Leave out what stands between operands, and windows that were not written.

    Examples
    --------
    >>> operands([Tree("proposition", []), Tree("_implies", []), None])
    [Tree('proposition', [])]
    """
    return [part for part in parts if part is not None and getattr(part, "data", "") not in ("_iff", "_implies")]
