"""How is a syntax error said to somebody who has never heard of terminals?

Turns the parser's position (the word that came, the kinds of words that could have come) into a code, a message and a
hint. No name from inside the grammar ever reaches a message.
"""

from __future__ import annotations

from collections.abc import Collection

from chronicles.language.diagnostics import Hint, suggest
from chronicles.language.words import Word

DECLARATION_WORDS = ("timeunit", "constant", "domain", "attribute", "message", "chronicle", "example")
STATEMENT_WORDS = ("event", "noevent", "occurs", "hold", "assert", "allow", "select", "when")
ACTION_WORDS = ("emit", "report", "assert")
EXAMPLE_WORDS = ("expect", "until")
INFINITIES = frozenset({"inf", "infinity", "infinite"})  # what other tools write for oo, in lower case
SELECTIONS = ("all", "first", "non_overlapping")

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
# Where a new statement may start, which words start one says more than all that fits: (kinds, what it is, words).
_STARTS = (
    (frozenset({"EVENT", "NOEVENT"}), "a statement", STATEMENT_WORDS),
    (frozenset({"REPORT"}), "'emit', 'report' or 'assert'", ACTION_WORDS),
    (frozenset({"UNTIL"}), "a time and an event, 'expect' or 'until'", EXAMPLE_WORDS),
    (frozenset({"CHRONICLE"}), "a declaration", DECLARATION_WORDS),
)
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


def describe_unexpected(word: Word, expected: frozenset[str], previous: Word | None) -> tuple[str, Hint]:
    """Say what was expected and what came.

    Parameters
    ----------
    word : the word that does not fit; its kind is "$END" at the end of a declaration.
    expected : kinds of words that would fit.
    previous : the word before, None at the start.

    Returns
    -------
    Message and hint (may be empty).
    """
    came = "the end of the declaration" if word.kind == "$END" else repr(word.text)
    after = f" after {previous.text!r}" if previous is not None else ""
    for kinds, wanted, words in _STARTS:
        if kinds <= expected:
            return f"expected {wanted}{after}, got {came}", _statement_hint(word, words)
    if expected <= {"$END", "_END"} or ("$END" in expected and word.kind == "NAME"):
        return f"expected a new declaration{after}, got {came}", _statement_hint(word, DECLARATION_WORDS)
    listed = [text for text in dict.fromkeys(map(describe_kind, sorted(expected, key=_rank))) if text][:_MOST_LISTED]
    return f"expected {_join(listed)}{after}, got {came}", _hint(word, expected)


def _statement_hint(word: Word, words: tuple[str, ...]) -> Hint:
    if word.kind == "NAME":
        return suggest(word.text, words)
    return Hint("one of " + ", ".join(map(repr, words)) + " starts here")


def _hint(word: Word, expected: Collection[str]) -> Hint:
    if word.kind == "SAME" and "EQUAL" in expected:
        return Hint("time points are compared with '=', variables with '=='", "=")
    if word.kind == "EQUAL" and "SAME" in expected:
        return Hint("variables are compared with '==' and '!=', time points with '='", "==")
    if word.kind == "INFINITE":
        return Hint("'oo' is the end of a range without a bound, such as t2 - t1 in [0s, oo]")
    if word.kind == "NAME":
        return _name_hint(word, expected)
    if word.kind == "TIME_POINT" and "NAME" in expected and "TIME_POINT" not in expected:
        return Hint("names that start with t and a digit are time points; choose another name")
    return _keyword_hint(word, expected) if word.text.isidentifier() and "NAME" in expected else Hint()


def _keyword_hint(word: Word, expected: Collection[str]) -> Hint:
    if "STRING" not in expected:
        return Hint(f"{word.text!r} is a word of the language; choose another name")
    quoted = f'"{word.text}"'
    return Hint(f"{word.text!r} is a word of the language; as a value it needs quotes: {quoted}", quoted)


def _name_hint(word: Word, expected: Collection[str]) -> Hint:
    if "RECOGNISED" in expected:
        return suggest(word.text, ["recognised"])
    if "INFINITE" in expected and word.text.lower() in INFINITIES:
        return Hint("no bound is written oo", "oo")
    if "TIME_POINT" in expected:
        return Hint("a time point is the letter t, a digit, and letters or digits: t1, t2b")
    if "VARIABLE" in expected:
        return Hint(f"variables start with a question mark: ?{word.text}", f"?{word.text}")
    return Hint()


def _rank(kind: str) -> tuple[int, str]:
    # Closing marks first: a forgotten one is the commonest mistake.
    order = ("COMMA", "RPAR", "CLOSING", "RBRACE", "COLON")
    return (order.index(kind) if kind in order else len(order), kind)


def _join(texts: list[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "something else"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
