"""How is a syntax error of KPL said to somebody who has never heard of terminals?

Turns the word that came and the kinds of words that could have come into a message and a hint. No name from inside the
grammar ever reaches a message.
"""

from __future__ import annotations

from collections.abc import Collection

from lark import Token

from dyknow.diagnostics import suggest
from dyknow.durations import US_PER_UNIT

STATEMENT_WORDS = ("sort", "object", "feature", "source", "compunit", "strmgen", "stream")
_CONSTRAINT_WORDS = ("any", "sample", "no", "use", "linear", "max", "from", "to", "oldest", "monotone", "strict")
_KINDS = {
    "NAME": "a name",
    "QUANTITY": "a duration such as 200ms",
    "NUMBER": "",  # Wherever a bare number fits, so does one with a unit, which says more.
    "INFINITE": "'oo'",
    "EQUAL": "'='",
    "LPAR": "'('",
    "RPAR": "')'",
    "LSQB": "'['",
    "RSQB": "']'",
    "MORETHAN": "'>'",
    "COMMA": "','",
    "POLICY_COMMA": "','",
    "SEMICOLON": "';'",
    "$END": "the end",
}


def describe_unexpected(word: Token | None, fitting: Collection[str], previous: Token | None) -> tuple[str, str]:
    """Say what was expected and what came.

    Parameters
    ----------
    word : the word that does not fit; None where the statement ends too early.
    fitting : kinds of words that would fit.
    previous : the word before; None at the start.

    Returns
    -------
    Message and hint (may be empty).

    Examples
    --------
    >>> describe_unexpected(Token("NAME", "ordr"), {"ORDER", "UPDATE"}, Token("ANY", "any"))
    ("expected 'order' or 'update' after 'any', got 'ordr'", "did you mean 'order'?")
    """
    came = repr(str(word)) if word is not None else "the end of the statement"
    after = f" after {str(previous)!r}" if previous is not None else ""
    hint = _hint(word, fitting, previous) if word is not None else ""
    return f"expected {_expected(fitting)}{after}, got {came}", hint


def _expected(fitting: Collection[str]) -> str:
    if "STRMGEN" in fitting:
        return "a statement"
    if "SAMPLE" in fitting:
        return "a constraint such as 'strict order'"
    if "LESSTHAN" in fitting:
        return "a type"
    texts = [_KINDS.get(kind, repr(kind.lower())) for kind in sorted(_without_words_as_names(fitting), key=_rank)]
    return _join([text for text in dict.fromkeys(texts) if text])


def _without_words_as_names(fitting: Collection[str]) -> Collection[str]:
    """Leave out the words that may be names where "a name" says it all."""
    return [kind for kind in fitting if kind in _KINDS or kind == "WITH"] if "NAME" in fitting else fitting


def _rank(kind: str) -> tuple[bool, bool, str]:
    return kind in _KINDS, kind == "$END", kind


def _hint(word: Token, fitting: Collection[str], previous: Token | None) -> str:  # noqa: PLR0911 - one mistake each
    text = str(word)
    if "STRMGEN" in fitting:
        return _near(text, STATEMENT_WORDS) or "statements start with " + ", ".join(STATEMENT_WORDS)
    if "SAMPLE" in fitting:
        return _near(text, _CONSTRAINT_WORDS) or "constraints start with " + ", ".join(_CONSTRAINT_WORDS)
    if word.type in _CONSTRAINT_KINDS and "WITH" in fitting:
        return "constraints come after 'with'"
    if previous is not None and previous.type in ("NUMBER", "QUANTITY") and word.type == "NAME":
        return "units are " + ", ".join(US_PER_UNIT)
    if previous is not None and previous.type == "NAME" and _near(str(previous), _CONSTRAINT_WORDS):
        return _near(str(previous), _CONSTRAINT_WORDS)
    if "NAME" in fitting and text.isidentifier():
        return f"{text!r} is a word of the language; choose another name"
    return _near(text, [kind.lower() for kind in fitting if kind not in _KINDS])


_CONSTRAINT_KINDS = frozenset(word.upper() for word in _CONSTRAINT_WORDS)


def _near(text: str, words: Collection[str]) -> str:
    near = suggest(text, words)
    return near if near.startswith("did") else ""


def _join(texts: list[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "the end"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
