"""How is a syntax error said to somebody who has never heard of terminals?

Turns the word that came and the kinds of words that could have come into a message. What is expected is written as a
user types it, so no name from inside the grammar ever reaches a message; `syntax_hints` says how to mend it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lark import Token

from dyknow.language.diagnostics import Span
from dyknow.mtl.places import span_of
from dyknow.mtl.syntax_hints import Misfit, hint_for, round_window

# Kinds of words that have many spellings; "" where another kind says more. The others have one, which is shown.
_KINDS = MappingProxyType(
    {
        "VARIABLE": "a variable such as ?car",
        "NAME": "a name",
        "QUANTITY": "a duration such as 5s",
        "NUMBER": "",  # Wherever a bare number fits, so does one with a unit, which says more.
        "STRING": 'a text in "quotes"',
        "_END": "",
        "$END": "",
    }
)
_CLOSING = ("COMMA", "RPAR", "RSQB", "COLON")
_OPERATORS = ("'and'", "'or'", "'implies'", "'until'")
_IN_COMPARISONS = frozenset({"LESS", "AT_MOST", "EQUAL", "DIFFERENT", "AT_LEAST", "MORE", "PLUS", "NEGATIVE", "STAR"})


@dataclass(frozen=True, slots=True)
class SyntaxFinding:
    """What is wrong and where; `is_end` if the text ends too early."""

    message: str
    span: Span
    hint: str
    is_end: bool


def describe_unexpected(
    words: Sequence[Token], index: int, fitting: Collection[str], spellings: Mapping[str, str]
) -> SyntaxFinding:
    """Say what was expected and what came.

    Parameters
    ----------
    words : of the formula or monitor.
    index : of the word that does not fit; one past the last at the end of the text.
    fitting : kinds of words that would fit.
    spellings : what a user types, for each kind of word that has one spelling.
    """
    opening = round_window(words, index)
    if opening is not None:
        message = f"expected '[' after {str(words[opening - 1])!r}, got '('"
        hint = f"windows are closed on both sides: {words[opening - 1]}[0s, 1s]"
        return SyntaxFinding(message, span_of(words[opening]), hint, is_end=False)
    is_end = index == len(words)
    came = "the end of the text" if is_end else repr(str(words[index]))
    after = f" after {str(words[index - 1])!r}" if index else ""
    expected = "a number" if index and words[index - 1].type == "NEGATIVE" else _expected(fitting, spellings)
    message = f"expected {expected}{after}, got {came}"
    hint = hint_for(Misfit(words, index, frozenset(fitting)))
    return SyntaxFinding(message, _place(words, index), hint, is_end)


def _place(words: Sequence[Token], index: int) -> Span:
    if not words:
        return Span(1, 1, 1, 1)
    return span_of(words[min(index, len(words) - 1)])


def _expected(kinds: Collection[str], spellings: Mapping[str, str]) -> str:
    if "ALWAYS" in kinds:
        return "a window such as [0s, 5s] or a formula" if "LSQB" in kinds else "a formula"
    if "STRING" in kinds and "NEGATIVE" in kinds and "AND" not in kinds:
        return "something to compare"
    if "STRING" in kinds and "VARIABLE" in kinds:
        return "an object such as car7, or a variable such as ?car"
    end = ["the end"] if "$END" in kinds else []
    closing = [repr(spellings[kind]) for kind in _CLOSING if kind in kinds]
    if "AND" in kinds:
        return _join([*closing, *_OPERATORS, *end])
    if kinds and set(kinds) <= _IN_COMPARISONS | {"LSQB"}:
        return "a comparison such as '<'"
    others = [_KINDS[kind] if kind in _KINDS else repr(spellings[kind]) for kind in kinds if kind not in _CLOSING]
    return _join([*closing, *sorted(filter(None, others), key=lambda text: (text.startswith("'"), text)), *end])


def _join(texts: Sequence[str]) -> str:
    if len(texts) <= 1:
        return "".join(texts) or "the end"
    return ", ".join(texts[:-1]) + " or " + texts[-1]
