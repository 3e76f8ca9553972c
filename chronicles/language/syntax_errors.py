"""How is a syntax error said to somebody who has never heard of terminals?

Turns the parser's position (the word that came, the kinds of words that could have come) into a code, a message and a
hint. No name from inside the grammar ever reaches a message.
"""

from __future__ import annotations

from collections.abc import Collection

from lark import Token

from chronicles.language.diagnostics import suggest

DECLARATION_WORDS = ("timeunit", "constant", "domain", "attribute", "message", "chronicle")
STATEMENT_WORDS = ("event", "noevent", "occurs", "hold", "assert", "allow", "when")
ACTION_WORDS = ("emit", "report", "assert")
TIME_UNITS = ("us", "ms", "s", "min", "h")

_KINDS = {
    "VARIABLE": "a variable such as ?car",
    "TIME_POINT": "a time point such as t1",
    "NAME": "a name",
    "DURATION": "a duration such as 5s",
    "NUMBER": "a number",
    "STRING": 'a text in "quotes"',
    "INFINITE": "'oo'",
    "POSITIVE": "'+'",
    "NEGATIVE": "'-'",
    "LESS": "'<'",
    "AT_MOST": "'<='",
    "EQUAL": "'='",
    "AT_LEAST": "'>='",
    "MORE": "'>'",
    "SAME": "'=='",
    "DIFFERENT": "'!='",
    "RANGE": "'..'",
    "OPENING": "'['",
    "CLOSING": "']'",
    "_END": "';'",
    "LBRACE": "'{'",
    "RBRACE": "'}'",
    "LPAR": "'('",
    "RPAR": "')'",
    "COMMA": "','",
    "COLON": "':'",
    "VBAR": "'|'",
    "TILDE": "'~'",
    "QMARK": "'?'",
    "RECOGNISED": "'recognised'",
    "RECOGNIZED": "",
    "$END": "the end of the declaration",
}
# What may follow a finished statement says nothing about the mistake inside an unfinished one.
_MOST_LISTED = 5


def describe_kind(kind: str) -> str:
    """Name a kind of word as a reader would.

    Examples
    --------
    >>> describe_kind("TIME_POINT"), describe_kind("EVENT")
    ('a time point such as t1', "'event'")
    """
    return _KINDS[kind] if kind in _KINDS else repr(kind.lower())


def describe_unexpected(token: Token, expected: Collection[str], previous: Token | None) -> tuple[str, str]:
    """Say what was expected and what came.

    Parameters
    ----------
    token : the word that does not fit; its type is "$END" at the end of a declaration.
    expected : kinds of words that would fit.
    previous : the word before, None at the start.

    Returns
    -------
    Message and hint (may be empty).
    """
    came = "the end of the declaration" if token.type == "$END" else repr(str(token))
    after = f" after {str(previous)!r}" if previous is not None else ""
    if "EVENT" in expected and "NOEVENT" in expected:
        return f"expected a statement{after}, got {came}", _statement_hint(token, STATEMENT_WORDS)
    if "REPORT" in expected:
        return f"expected 'emit' or 'report'{after}, got {came}", _statement_hint(token, ACTION_WORDS)
    if "CHRONICLE" in expected:
        return f"expected a declaration{after}, got {came}", _statement_hint(token, DECLARATION_WORDS)
    if set(expected) <= {"$END", "_END"} or ("$END" in expected and token.type == "NAME"):
        return f"expected a new declaration{after}, got {came}", _statement_hint(token, DECLARATION_WORDS)
    listed = [text for text in dict.fromkeys(map(describe_kind, sorted(expected, key=_rank))) if text][:_MOST_LISTED]
    return f"expected {_join(listed)}{after}, got {came}", _hint(token, expected)


def _statement_hint(token: Token, words: tuple[str, ...]) -> str:
    if token.type == "NAME":
        return suggest(str(token), words)
    return "one of " + ", ".join(repr(word) for word in words) + " starts here"


def _hint(token: Token, expected: Collection[str]) -> str:
    if token.type == "SAME" and "EQUAL" in expected:
        return "time points are compared with '=', variables with '=='"
    if token.type == "EQUAL" and "SAME" in expected:
        return "variables are compared with '==' and '!=', time points with '='"
    if token.type == "NAME":
        return _name_hint(token, expected)
    if token.type == "TIME_POINT" and "NAME" in expected and "TIME_POINT" not in expected:
        return "names that start with t and a digit are time points; choose another name"
    if "NAME" in expected and str(token).isidentifier():
        return f'{str(token)!r} is a word of the language; as a value it needs quotes: "{token}"'
    return ""


def _name_hint(token: Token, expected: Collection[str]) -> str:
    if "TIME_POINT" in expected:
        return "a time point is the letter t, a digit, and letters or digits: t1, t2b"
    if "VARIABLE" in expected:
        return f"variables start with a question mark: ?{token}"
    return ""


def _rank(kind: str) -> tuple[int, str]:
    # Closing marks first: a forgotten one is the commonest mistake.
    order = ("COMMA", "RPAR", "CLOSING", "RBRACE", "COLON")
    return (order.index(kind) if kind in order else len(order), kind)


def _join(texts: list[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "something else"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
