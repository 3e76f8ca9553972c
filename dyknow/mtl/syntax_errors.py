"""How is a syntax error said to somebody who has never heard of terminals?

Turns the word that came and the kinds of words that could have come into a message and a hint. No name from inside the
grammar ever reaches a message.
"""

from __future__ import annotations

from collections.abc import Collection

from lark import Token

from dyknow.diagnostics import suggest
from dyknow.mtl.units import UNITS

_OPERATORS = ("and", "or", "implies", "iff", "until")
_PREFIXES = ("not", "always", "eventually", "next", "forall", "exists", "tolerate")
_KINDS = {
    "VARIABLE": "a variable such as ?car",
    "NAME": "a name",
    "QUANTITY": "a duration such as 5s",
    "NUMBER": "",  # Wherever a bare number fits, so does one with a unit, which says more.
    "STRING": 'a text in "quotes"',
    "INFINITE": "'oo'",
    "LPAR": "'('",
    "RPAR": "')'",
    "LSQB": "'['",
    "RSQB": "']'",
    "COMMA": "','",
    "COLON": "':'",
    "_END": "",
    "MONITOR": "'monitor'",
    "PER": "'per'",
    "IN": "'in'",
    "EXISTS": "'exists'",
    "$END": "",
}
_CLOSING = ("COMMA", "RPAR", "RSQB", "COLON")
_COMPARATORS = frozenset({"LESS", "AT_MOST", "EQUAL", "DIFFERENT", "AT_LEAST", "MORE"})


def describe_unexpected(token: Token, expected: Collection[str], previous: Token) -> tuple[str, str]:
    """Say what was expected and what came.

    Parameters
    ----------
    token : the word that does not fit; its type is "$END" at the end of the text.
    expected : kinds of words that would fit.
    previous : the word before; its text is "" at the start.

    Returns
    -------
    Message and hint (may be empty).
    """
    came = "the end of the text" if token.type == "$END" else repr(str(token))
    after = f" after {str(previous)!r}" if previous else ""
    return f"expected {_expected(expected)}{after}, got {came}", _hint(token, expected, previous)


def _expected(kinds: Collection[str]) -> str:
    if "ALWAYS" in kinds:
        return "a formula"
    if "STRING" in kinds and "NEGATIVE" in kinds:
        return "something to compare"
    closing = [_KINDS[kind] for kind in _CLOSING if kind in kinds]
    if "AND" in kinds:
        return _join([*closing, "'and'", "'or'", "'implies'", "'until'", *(["the end"] if "$END" in kinds else [])])
    if kinds and set(kinds) <= _COMPARATORS | {"PLUS", "NEGATIVE", "STAR"}:
        return "a comparison such as '<'"
    others = [_KINDS.get(kind, repr(kind.lower())) for kind in sorted(kinds) if kind not in _CLOSING]
    return _join([text for text in (*closing, *others) if text])


def _hint(token: Token, expected: Collection[str], previous: Token) -> str:  # noqa: PLR0911 - one mistake each
    text = str(token)
    if token.type == "EQUAL" and previous.type == "EQUAL":
        return "values are compared with '='"
    if token.type == "IFF" or (token.type in _COMPARATORS and "AND" in expected):
        return "put one 'iff' in parentheses" if token.type == "IFF" else "join two comparisons by 'and'"
    if token.type in ("NUMBER", "QUANTITY") and {"VARIABLE", "STRING"} <= set(expected) and "NEGATIVE" not in expected:
        return "windows stand after always, eventually and until"
    if token.type == "NAME" and previous.type in ("NUMBER", "QUANTITY"):
        return suggest(text, UNITS) or "units are " + ", ".join(UNITS)
    if token.type == "NAME" and "VARIABLE" in expected and "NAME" not in expected:
        return f"variables start with a question mark: ?{text}"
    if token.type == "NAME" and "AND" in expected:
        near = suggest(text, _OPERATORS)
        return near if near.startswith("did") else _prefix_hint(previous)
    if token.type == "INFINITE":
        return "only the end of a window may be 'oo'"
    if "NAME" in expected and text.isidentifier():
        return f"{text!r} is a word of the language; choose another name"
    return _prefix_hint(previous) if "LSQB" in expected and token.type == "VARIABLE" else ""


def _prefix_hint(previous: Token) -> str:
    near = suggest(str(previous), _PREFIXES)
    return near if near.startswith("did") else ""


def _join(texts: list[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "the end"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
