"""How is a syntax error of KPL said to somebody who has never heard of terminals?

Turns the word that came and the kinds of words that could have come into a message and a hint. No name from inside the
grammar ever reaches a message.
"""

from __future__ import annotations

from collections.abc import Collection
from types import MappingProxyType

from lark import Token

from dyknow.kpl.findings import shown
from dyknow.language.diagnostics import suggest
from dyknow.language.durations import US_PER_UNIT

STATEMENT_WORDS = ("sort", "object", "feature", "source", "compunit", "configuration", "strmgen", "configure", "stream")
_CONSTRAINT_WORDS = ("any", "sample", "no", "use", "linear", "max", "from", "to", "oldest", "monotone", "strict")
_LONGEST_WORD = 30  # longer ones are like no word of the language
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
    came = shown(str(word)) if word is not None else "the end of the statement"
    after = f" after {shown(str(previous))}" if previous is not None else ""
    hint = _hint(word, fitting, previous) if word is not None else _hint_on_end(fitting)
    return f"expected {_expected(fitting)}{after}, got {came}", hint


def _hint_on_end(fitting: Collection[str]) -> str:
    return "statements end with ';'" if "SEMICOLON" in fitting else ""


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


def _hint(word: Token, fitting: Collection[str], previous: Token | None) -> str:
    text = str(word)
    if "STRMGEN" in fitting:
        return _near(text, STATEMENT_WORDS) or "statements start with " + ", ".join(STATEMENT_WORDS)
    if "SAMPLE" in fitting:
        return _hint_on_constraint(word)
    return (
        _hint_on_policy(word, fitting)
        or _hint_on_previous(word, fitting, previous)
        or _hint_on_name(word, fitting)
        or _near(text, [kind.lower() for kind in fitting if kind not in _KINDS])
    )


def _hint_on_constraint(word: Token) -> str:
    if word.type in ("NUMBER", "QUANTITY"):
        return "decimals have a point, as in 0.5s"
    near = _near(word, _CONSTRAINT_WORDS)
    later = suggest(word.lower()[:_LONGEST_WORD], _PHRASES)
    phrase = next((phrase for inside, phrase in _PHRASES.items() if repr(inside) in later), "")
    if phrase and (not near or str(word) in _PHRASES):
        return f"did you mean {phrase!r}?"
    return near or "constraints start with " + ", ".join(_CONSTRAINT_WORDS)


def _hint_on_policy(word: Token, fitting: Collection[str]) -> str:
    if word.type in _CONSTRAINT_KINDS and "WITH" in fitting:
        return "constraints come after 'with'"
    if word.type in _CONSTRAINT_KINDS and "POLICY_COMMA" in fitting:
        return "constraints are joined by ','"
    if word.type == "WITH" and "SEMICOLON" in fitting:
        return "a policy comes before 'by'" if "LSQB" in fitting else "a policy belongs to a label that is read"
    return "'oo' is infinite" if "INFINITE" in fitting and word.lower().startswith("inf") else ""


def _hint_on_previous(word: Token, fitting: Collection[str], previous: Token | None) -> str:
    if previous is None:
        return ""
    if previous.type in ("NUMBER", "QUANTITY") and word.type == "NAME":
        return "units are " + ", ".join(US_PER_UNIT)
    if previous.type == "NAME" and "WITH" in fitting:
        return _near(previous, _CONSTRAINT_WORDS)
    return _near(previous, ("selection", "collection")) if word.type == "OF" else ""


def _hint_on_name(word: Token, fitting: Collection[str]) -> str:
    if word.type == "LPAR" and "LSQB" in fitting:
        return "labels have their arguments in [ ]; units are applied by 'strmgen', which gives what comes out a label"
    if "NAME" in fitting and word.isidentifier():
        return f"{shown(str(word))} is a word of the language; choose another name"
    return ""


_PHRASES = MappingProxyType(
    {
        "update": "any update",
        "change": "any change",
        "every": "sample every",
        "approximation": "no approximation",
        "most": "use most recent",
        "recent": "use most recent",
        "interpolation": "linear interpolation",
        "interpolate": "linear interpolation",
        "delay": "max delay",
        "order": "strict order",
    }
)


def hint_on_character(character: str) -> str:
    """Say what may have been meant by a character that no word has; empty where nobody knows.

    Examples
    --------
    >>> hint_on_character("{"), hint_on_character("é"), hint_on_character("~")
    ('labels have their arguments in [ ]', "names are made of the letters a to z and A to Z, digits and '_'", '')
    """
    if character.isalnum():
        return "names are made of the letters a to z and A to Z, digits and '_'"
    return next((hint for characters, hint in _HINTS_ON_CHARACTERS.items() if character in characters), "")


_HINTS_ON_CHARACTERS = MappingProxyType(
    {
        "{}": "labels have their arguments in [ ]",
        ":": "statements give a name by '='",
        "/*!": "comments start with # or //",
        "-+": "names have no '-', and durations are not negative",
        ".": "write 0.5s for half a second; names have no '.'",
        "\"'`\u201c\u201d\u201e\u2018\u2019": "names stand without quotes",
        "\u221e": "'oo' is infinite",
        "\uff1b\u037e": "statements end with ';'",
    }
)
_CONSTRAINT_KINDS = frozenset(word.upper() for word in _CONSTRAINT_WORDS)


def _near(text: str, words: Collection[str]) -> str:
    near = suggest(text.lower()[:_LONGEST_WORD], words)
    return near if near.startswith("did") else ""


def _join(texts: list[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "the end"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
