"""How is a syntax error of a formula said? `syntax_hints` says how to mend it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from types import MappingProxyType

from dyknow.language.diagnostics import Hint
from dyknow.language.wording import Misfit, described, listed
from dyknow.mtl.syntax_hints import hint_for, round_window

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


def describe_misfit(misfit: Misfit, spellings: Mapping[str, str]) -> tuple[Misfit, str, Hint]:
    """Say which word is at fault, what was expected and what came, and how it is mended.

    Parameters
    ----------
    spellings : what a user types, for each kind of word that has one spelling.
    """
    opening = round_window(misfit)
    if opening is not None:
        at = replace(misfit, index=opening)
        hint = f"windows are closed on both sides: {at.text(-1)}[0s, 1s]"
        return at, at.message("'['", "text"), Hint(hint)
    expected = "a number" if misfit.kind(-1) == "NEGATIVE" else _expected(misfit.expected, spellings)
    return misfit, misfit.message(expected, "text"), hint_for(misfit)


def _expected(kinds: Collection[str], spellings: Mapping[str, str]) -> str:
    if "ALWAYS" in kinds:
        return "a window such as [0s, 5s] or a formula" if "LSQB" in kinds else "a formula"
    if "STRING" in kinds and "NEGATIVE" in kinds and "AND" not in kinds:
        return "something to compare"
    if "STRING" in kinds and "VARIABLE" in kinds:
        return "an object such as car7, or a variable such as ?car"
    closing = described([kind for kind in _CLOSING if kind in kinds], {}, spellings, _CLOSING)
    end = ["the end"] if "$END" in kinds else []
    if "AND" in kinds:
        return listed([*closing, *_OPERATORS, *end])
    if kinds and set(kinds) <= _IN_COMPARISONS | {"LSQB"}:
        return "a comparison such as '<'"
    others = described([kind for kind in kinds if kind not in _CLOSING], _KINDS, spellings)
    return listed([*closing, *sorted(others, key=lambda text: (text.startswith("'"), text)), *end])
