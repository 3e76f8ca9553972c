"""What did somebody mean who wrote a word that does not fit? One rule for each mistake that is common elsewhere.

The rules know how other temporal logics, programming languages and mathematics write what this language writes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lark import Token

from dyknow.language.diagnostics import suggest
from dyknow.mtl.units import UNITS

_OPERATORS = ("and", "or", "implies", "iff", "until")
_PREFIXES = ("not", "always", "eventually", "next", "forall", "exists", "tolerate")
_TENSES = ("ALWAYS", "EVENTUALLY", "UNTIL")
_COMPARATORS = frozenset({"LESS", "AT_MOST", "EQUAL", "DIFFERENT", "AT_LEAST", "MORE"})
_ELSEWHERE = MappingProxyType(
    {
        **dict.fromkeys(("G", "globally", "henceforth"), "always"),
        **dict.fromkeys(("F", "finally", "sometime", "sometimes"), "eventually"),
        **dict.fromkeys(("X", "nexttime"), "next"),
        **dict.fromkeys(("U", "unless"), "until"),
        "then": "implies",
        **dict.fromkeys(("all", "every", "each"), "forall"),
        **dict.fromkeys(("some", "any"), "exists"),
        **dict.fromkeys(("inf", "infinity", "Inf", "forever"), "oo"),
        **dict.fromkeys(("equals", "is"), "="),
    }
)
_ADVICE = MappingProxyType(
    {
        "if": "write p implies q",
        "xor": "write not (p iff q)",
        **dict.fromkeys(("since", "once", "historically", "previously"), "formulas speak of the future only"),
    }
)
_TWO_SIGNS = MappingProxyType(
    {
        "= =": "values are compared with '='",
        "= >": "write 'implies' or '->'; at least is '>='",
        "= <": "at most is '<='",
        "< >": "different is '!='",
        "<= >": "write 'iff' or '<->'",
        "<= =": "write 'iff' or '<->'",
        "> =": "at least is '>=', without a blank",
        "< =": "at most is '<=', without a blank",
    }
)
_CHARACTERS = MappingProxyType(
    {
        '"': 'texts start and end with " on one line',
        "'": 'texts stand in "double quotes"',
        **dict.fromkeys("“”„«»", 'texts stand in "straight double quotes"'),
        **dict.fromkeys("&∧", "write 'and'"),
        **dict.fromkeys("|∨", "write 'or'"),
        **dict.fromkeys("!~¬", "write 'not'; different is '!='"),
        **dict.fromkeys("→⇒⊃", "write 'implies' or '->'"),
        **dict.fromkeys("↔⇔≡", "write 'iff' or '<->'"),
        "≤": "write '<='",
        "≥": "write '>='",
        "≠": "write '!='",
        "□": "write 'always'",
        **dict.fromkeys("◇◊", "write 'eventually'"),
        "○": "write 'next'",
        "∀": "write 'forall'",
        "∃": "write 'exists'",
        "∈": "write 'in'",
        "∞": "write 'oo'",
        "µ": "microseconds are written us",
        "μ": "microseconds are written us",
        "°": "degrees are written deg",
        "²": "m/s2 is written without a raised 2",
        **dict.fromkeys("−–—", "write '-'"),
        **dict.fromkeys("·×", "write '*'"),
        ".": "numbers are written 0.5; quantifiers end with ':'",
        "/": "units are written km/h or m/s; features can be multiplied by a number, not divided",
        **dict.fromkeys("{}", "write '(' and ')', or '[' and ']' for windows and arguments"),
        "?": "variables are written ?car, without a blank",
        "\ufeff": "save the file without a byte order mark",
    }
)


@dataclass(frozen=True, slots=True)
class Misfit:
    """A word that does not fit: `words[index]`, or the end of the text; `fitting` are the kinds that would."""

    words: Sequence[Token]
    index: int
    fitting: frozenset[str]

    def kind(self, offset: int = 0) -> str:
        """Give the kind of the word, or of one near it; "" beyond the text."""
        at = self.index + offset
        return str(self.words[at].type) if 0 <= at < len(self.words) else ""

    def text(self, offset: int = 0) -> str:
        """Give the word, or one near it; "" beyond the text."""
        at = self.index + offset
        return str(self.words[at]) if 0 <= at < len(self.words) else ""


def hint_for_character(character: str) -> str:
    """Say what to write instead of a character that no word has; "" where nothing is near.

    Examples
    --------
    >>> hint_for_character("∧"), hint_for_character("$")
    ("write 'and'", '')
    """
    return _CHARACTERS.get(character, "")


def round_window(words: Sequence[Token], index: int) -> int | None:
    """Find the parenthesis of a window such as ``(0s, 1s]`` around a word; None if there is none.

    To the grammar it begins a formula, so that only the comma after the first duration does not fit.
    """
    for opening in range(max(index - 3, 1), min(index + 1, len(words))):
        kinds = [word.type for word in words[opening - 1 : opening + 3]]
        is_window = len(kinds) == 4 and kinds[2] in ("QUANTITY", "NUMBER") and kinds[3] == "COMMA"
        if is_window and kinds[1] == "LPAR" and kinds[0] in _TENSES:
            return opening
    return None


def hint_for(misfit: Misfit) -> str:
    """Say how to mend a text at the word that does not fit; "" where no rule knows."""
    return next((hint for rule in _RULES if (hint := rule(misfit))), "")


def _signs(at: Misfit) -> str:
    """Two signs where the language has one, or another."""
    if at.text() == "[" and at.text(1) == "]":
        return "write 'always'"
    if "ALWAYS" in at.fitting and at.text() == "<" and at.text(1) == ">":
        return "write 'eventually'"
    return _TWO_SIGNS.get(f"{at.text(-1)} {at.text()}", "")


def _comparisons(at: Misfit) -> str:
    if at.kind() == "IFF" or at.text() == "<->":
        return "put one 'iff' in parentheses"
    if at.kind() in _COMPARATORS and "AND" in at.fitting and at.kind(-2) in _COMPARATORS:
        return "join two comparisons by 'and'"
    is_left = at.kind() in _COMPARATORS and at.kind(-1) in ("TRUE", "FALSE")
    if is_left or (at.kind() in ("TRUE", "FALSE") and "NEGATIVE" in at.fitting):
        return "truth values stand alone: p, or not p"
    if at.text() == "*" and at.kind(-1) in ("NAME", "RSQB"):
        return "the number comes first: 2 * speed[?c]"
    closes_sum = at.text() == ")" and _COMPARATORS & at.fitting and "AND" not in at.fitting
    opens_sum = at.text() == "(" and (at.kind(-1) in _COMPARATORS or at.text(-1) in ("*", "+", "-"))
    if closes_sum or opens_sum:
        return "sums and products stand without parentheses"
    return ""


def _is_call(at: Misfit) -> bool:
    return at.text() == "(" and at.kind(-1) == "NAME"


def _windows(at: Misfit) -> str:  # noqa: PLR0911 - one mistake each
    text = at.text()
    if (text == ")" and at.fitting == {"RSQB"}) or (text == "]" and at.kind(-1) in _TENSES):
        return "windows are closed on both sides: [0s, 1s]"
    if text == "]" and at.fitting == {"COMMA"}:
        return f"windows have two ends: [0s, {at.text(-1)}]"
    if text == "-" and "QUANTITY" in at.fitting:
        return "windows reach into the future only: they start at 0s or later"
    if at.kind(-1) == "QUANTITY" and at.kind(-2) in _TENSES:
        return f"windows stand in brackets: {at.text(-2)}[0s, {at.text(-1)}]"
    if at.kind() == "QUANTITY" and at.kind(-1) == "NAME" and at.kind(-2) in _TENSES:
        return f"windows stand in brackets: {at.text(-2)}[0s, {at.text()}]"
    if text == "[" and at.kind(-1) in ("NEXT", "NOT"):
        return "windows stand after always, eventually and until"
    if at.kind() == "INFINITE":
        return "only the end of a window may be 'oo'"
    if _ELSEWHERE.get(text) == "oo" and "INFINITE" in at.fitting:
        return "write 'oo'"
    return ""


def _arguments(at: Misfit) -> str:  # noqa: PLR0911 - one mistake each
    text = at.text()
    if _is_call(at):
        return _near(at.text(-1), _PREFIXES) or f"arguments stand in brackets: {at.text(-1)}[...]"
    if {"VARIABLE", "STRING"} <= at.fitting and "NEGATIVE" not in at.fitting:
        if text == "]" and at.text(-1) == "[":
            return "without arguments, leave the brackets out"
        if at.kind() in ("NUMBER", "QUANTITY"):
            near = _near(at.text(-2), _PREFIXES)
            if near or at.kind() == "QUANTITY" or at.text(1) == ",":
                return near or "windows stand after always, eventually and until"
            return f'such a name stands in quotes: "{text}"'
    if at.fitting == {"COMMA", "RSQB"} and at.kind() == "VARIABLE":
        return "a ',' stands between arguments"
    if at.fitting == {"COMMA", "RSQB"} and at.kind(-1) == "NAME" and at.kind():
        return 'names with blanks or signs stand in "quotes"'
    return ""


def _variables(at: Misfit) -> str:
    if "VARIABLE" in at.fitting and "NAME" not in at.fitting and at.kind() == "NAME":
        return f"variables start with a question mark: ?{at.text()}"
    if at.fitting == {"IN"}:
        return f"name the sort: {at.text(-1)} in Car"
    if at.kind() == "IN" and at.kind(-1) == "NAME":
        return f"variables start with a question mark: ?{at.text(-1)}"
    if "COLON" in at.fitting and at.kind():
        if at.kind(-2) == "MONITOR":
            return f"a ':' ends the name: monitor {at.text(-1)}: ..."
        return "a ',' stands between variables" if at.kind() == "VARIABLE" else "a ':' ends what is bound"
    return ""


def _numbers(at: Misfit) -> str:
    if at.kind(-1) not in ("NUMBER", "QUANTITY") or at.kind() != "NAME":
        return ""
    if re.match(r"[eE][0-9]", at.text()):
        return "numbers are written in full: 1000, 0.001"
    near = suggest(at.text(), UNITS)
    if not near and (at.kind(1) in _COMPARATORS or at.text(1) == "["):
        return f"products are written {at.text(-1)} * {at.text()}"
    return near or "units are " + ", ".join(UNITS)


def _brackets(at: Misfit) -> str:
    if at.kind(-1) == "TOLERATE" or (at.kind() in ("RPAR", "COMMA", "QUANTITY") and _is_in_tolerate(at)):
        return "write tolerate(p, 1s, 500ms): p, or its return within 1s for at least 500ms"
    for opening, closing in (("(", ")"), ("[", "]")):
        before = [str(word) for word in at.words[: at.index]]
        if at.text() == closing and before.count(opening) <= before.count(closing):
            return f"no {opening!r} is open here"
    return ""


def _is_in_tolerate(at: Misfit) -> bool:
    """Look back to the innermost parenthesis that is open."""
    depth = 0
    for offset in range(-1, -at.index - 1, -1):
        depth += {"RPAR": 1, "LPAR": -1}.get(at.kind(offset), 0)
        if depth < 0:
            return at.kind(offset - 1) == "TOLERATE"
    return False


def _spelling(at: Misfit) -> str:  # noqa: PLR0911 - one mistake each
    """A word that is nearly one of the language, or one of another language."""
    text, previous = at.text(), at.text(-1)
    if "MONITOR" in at.fitting:
        return _near(text, ("monitor",)) or "each formula has a name: monitor NAME: FORMULA"
    if at.kind() == "MONITOR" and "ALWAYS" in at.fitting:
        return "one formula is asked for here, without 'monitor' and a name"
    if text in _OPERATORS and "ALWAYS" in at.fitting:
        return f"{text!r} stands between two formulas"
    if at.kind() == "NAME" and "AND" in at.fitting:
        return _ADVICE.get(text) or _ADVICE.get(previous) or _near(text, _OPERATORS) or _near(previous, _PREFIXES)
    if "NAME" in at.fitting and at.kind() != "NAME" and text.isidentifier():
        return f"{text!r} is a word of the language; choose another name"
    if at.kind(-1) == "NAME" and "LSQB" in at.fitting:
        return _near(previous, _PREFIXES)
    return ""


def _near(text: str, words: Sequence[str]) -> str:
    elsewhere = _ELSEWHERE.get(text, _ELSEWHERE.get(text.lower()) if len(text) > 1 else None)
    if elsewhere in words or elsewhere == "=":
        return f"write {elsewhere!r}"
    near = suggest(text.lower(), words)
    return near if near.startswith("did") else ""


_RULES: tuple[Callable[[Misfit], str], ...] = (
    _signs,
    _windows,
    _comparisons,
    _arguments,
    _variables,
    _numbers,
    _brackets,
    _spelling,
)
