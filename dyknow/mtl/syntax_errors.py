"""How is a syntax error of a formula said, and what may have been meant? One rule for each mistake common elsewhere.

The rules know how other temporal logics, programming languages and mathematics write what this language writes.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from dyknow.language.diagnostics import Hint, near
from dyknow.language.wording import Misfit, described, listed
from dyknow.language.words import Strange
from dyknow.mtl.kinds import UNITS

# Kinds of words that have many spellings; "" where another kind says more. The others have one, which is shown.
_KINDS: Mapping[str, str] = {
    "VARIABLE": "a variable such as ?car",
    "NAME": "a name",
    "QUANTITY": "a duration such as 5s",
    "NUMBER": "",  # Wherever a bare number fits, so does one with a unit, which says more.
    "STRING": 'a text in "quotes"',
    "_END": "",
    "$END": "",
}
_CLOSING = ("COMMA", "RPAR", "RSQB", "COLON")
_BETWEEN_FORMULAS = ("'and'", "'or'", "'implies'", "'until'")
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
        return listed([*closing, *_BETWEEN_FORMULAS, *end])
    if kinds and set(kinds) <= _IN_COMPARISONS | {"LSQB"}:
        return "a comparison such as '<'"
    others = described([kind for kind in kinds if kind not in _CLOSING], _KINDS, spellings)
    return listed([*closing, *sorted(others, key=lambda text: (text.startswith("'"), text)), *end])


_OPERATORS = ("and", "or", "implies", "iff", "until")
_PREFIXES = ("not", "always", "eventually", "next", "forall", "exists", "tolerate")
_TENSES = ("ALWAYS", "EVENTUALLY", "UNTIL")
_COMPARATORS = frozenset({"LESS", "AT_MOST", "EQUAL", "DIFFERENT", "AT_LEAST", "MORE"})
_ELSEWHERE: Mapping[str, str] = {
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
_ADVICE: Mapping[str, str] = {
    "if": "write p implies q",
    "xor": "write not (p iff q)",
    **dict.fromkeys(
        ("since", "once", "historically", "previously"),
        "there are no past operators: begin where it began, as in always (p implies eventually[0s, 10s] q)",
    ),
}
_TWO_SIGNS: Mapping[str, str] = {
    "= =": "values are compared with '='",
    "= >": "write 'implies' or '->'; at least is '>='",
    "= <": "at most is '<='",
    "< >": "different is '!='",
    "<= >": "write 'iff' or '<->'",
    "<= =": "write 'iff' or '<->'",
    "> =": "at least is '>=', without a blank",
    "< =": "at most is '<=', without a blank",
}
_CHARACTERS: Mapping[str, str] = {
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
    "\ufeff": "save the file without a byte order mark",
}


def explain_character(text: str, at: int, _before: str) -> Strange:
    """Say what to write instead of a character that no word has.

    Examples
    --------
    >>> explain_character("p ∧ q", 2, "NAME").hint.text, explain_character("$", 0, "").hint.text
    ("write 'and'", '')
    """
    return Strange(text[at], Hint(_CHARACTERS.get(text[at], "")))


def round_window(misfit: Misfit) -> int | None:
    """Find the parenthesis of a window such as ``(0s, 1s]`` around a word; None if there is none.

    To the grammar it begins a formula, so that only the comma after the first duration does not fit.
    """
    for opening in range(max(misfit.index - 3, 1), min(misfit.index + 1, len(misfit.words))):
        kinds = [word.kind for word in misfit.words[opening - 1 : opening + 3]]
        is_window = len(kinds) == 4 and kinds[2] in ("QUANTITY", "NUMBER") and kinds[3] == "COMMA"
        if is_window and kinds[1] == "LPAR" and kinds[0] in _TENSES:
            return opening
    return None


def hint_for(misfit: Misfit) -> Hint:
    """Say how to mend a text at the word that does not fit; nothing where no rule knows."""
    found = next((hint for rule in _RULES if (hint := rule(misfit))), "")
    return found if isinstance(found, Hint) else Hint(found)


def _signs(at: Misfit) -> str:
    """Two signs where the language has one, or another."""
    if at.text() == "[" and at.text(1) == "]":
        return "write 'always'"
    if "ALWAYS" in at.expected and at.text() == "<" and at.text(1) == ">":
        return "write 'eventually'"
    return _TWO_SIGNS.get(f"{at.text(-1)} {at.text()}", "")


def _comparisons(at: Misfit) -> str:
    if at.kind() == "IFF" or at.text() == "<->":
        return "put one 'iff' in parentheses"
    if at.kind() in _COMPARATORS and "AND" in at.expected and at.kind(-2) in _COMPARATORS:
        return "join two comparisons by 'and'"
    is_left = at.kind() in _COMPARATORS and at.kind(-1) in ("TRUE", "FALSE")
    if is_left or (at.kind() in ("TRUE", "FALSE") and "NEGATIVE" in at.expected):
        return "truth values stand alone: p, or not p"
    if at.text() == "*" and at.kind(-1) in ("NAME", "RSQB"):
        return "the number comes first: 2 * speed[?c]"
    closes_sum = at.text() == ")" and _COMPARATORS & at.expected and "AND" not in at.expected
    opens_sum = at.text() == "(" and (at.kind(-1) in _COMPARATORS or at.text(-1) in ("*", "+", "-"))
    if closes_sum or opens_sum:
        return "sums and products stand without parentheses"
    return ""


def _is_call(at: Misfit) -> bool:
    return at.text() == "(" and at.kind(-1) == "NAME"


def _windows(at: Misfit) -> str | Hint:  # noqa: PLR0911 - one mistake each
    text = at.text()
    if (text == ")" and at.expected == {"RSQB"}) or (text == "]" and at.kind(-1) in _TENSES):
        return "windows are closed on both sides: [0s, 1s]"
    if text == "]" and at.expected == {"COMMA"}:
        return f"windows have two ends: [0s, {at.text(-1)}]"
    if text == "-" and "QUANTITY" in at.expected:
        return "windows reach into the future only: they start at 0s or later"
    if at.kind(-1) == "QUANTITY" and at.kind(-2) in _TENSES:
        return f"windows stand in brackets: {at.text(-2)}[0s, {at.text(-1)}]"
    if at.kind() == "QUANTITY" and at.kind(-1) == "NAME" and at.kind(-2) in _TENSES:
        return f"windows stand in brackets: {at.text(-2)}[0s, {at.text()}]"
    if text == "[" and at.kind(-1) in ("NEXT", "NOT"):
        return "windows stand after always, eventually and until"
    if at.kind() == "INFINITE":
        return "only the end of a window may be 'oo'"
    if _ELSEWHERE.get(text) == "oo" and "INFINITE" in at.expected:
        return Hint("write 'oo'", "oo")
    return ""


def _arguments(at: Misfit) -> str:  # noqa: PLR0911 - one mistake each
    text = at.text()
    if _is_call(at):
        return _near(at.text(-1), _PREFIXES).text or f"arguments stand in brackets: {at.text(-1)}[...]"
    if {"VARIABLE", "STRING"} <= at.expected and "NEGATIVE" not in at.expected:
        if text == "]" and at.text(-1) == "[":
            return "without arguments, leave the brackets out"
        if at.kind() in ("NUMBER", "QUANTITY"):
            prefix = _near(at.text(-2), _PREFIXES).text
            if prefix or at.kind() == "QUANTITY" or at.text(1) == ",":
                return prefix or "windows stand after always, eventually and until"
            return f'such a name stands in quotes: "{text}"'
    if at.expected == {"COMMA", "RSQB"} and at.kind() == "VARIABLE":
        return "a ',' stands between arguments"
    if at.expected == {"COMMA", "RSQB"} and at.kind(-1) == "NAME" and at.kind():
        return 'names with blanks or signs stand in "quotes"'
    return ""


def _variables(at: Misfit) -> str | Hint:  # noqa: PLR0911 - one mistake each
    if "VARIABLE" in at.expected and "NAME" not in at.expected and at.kind() == "NAME":
        return Hint(f"variables start with a question mark: ?{at.text()}", f"?{at.text()}")
    if at.kind() == "ANY" or (at.kind(-1) == "ANY" and at.kind() == "NAME"):
        return "variables are written ?car, without a blank"
    if at.expected == {"IN"}:
        return f"name the sort: {at.text(-1)} in Car"
    if at.kind() == "IN" and at.kind(-1) == "NAME":
        return f"variables start with a question mark: ?{at.text(-1)}"
    if "COLON" in at.expected and at.kind():
        if at.kind(-2) == "MONITOR":
            return f"a ':' ends the name: monitor {at.text(-1)}: ..."
        return "a ',' stands between variables" if at.kind() == "VARIABLE" else "a ':' ends what is bound"
    return ""


def _numbers(at: Misfit) -> str | Hint:
    if at.kind(-1) not in ("NUMBER", "QUANTITY") or at.kind() != "NAME":
        return ""
    if re.match(r"[eE][0-9]", at.text()):
        return "numbers are written in full: 1000, 0.001"
    unit = near(at.text(), UNITS)
    if not unit and (at.kind(1) in _COMPARATORS or at.text(1) == "["):
        return f"products are written {at.text(-1)} * {at.text()}"
    return unit or "units are " + ", ".join(UNITS)


def _brackets(at: Misfit) -> str:
    if at.kind(-1) == "TOLERATE" or (at.kind() in ("RPAR", "COMMA", "QUANTITY") and _is_in_tolerate(at)):
        return "write tolerate(p, 1s, 500ms): p, or its return within 1s for at least 500ms"
    for opening, closing in (("(", ")"), ("[", "]")):
        before = [word.text for word in at.words[: at.index]]
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


def _spelling(at: Misfit) -> str | Hint:  # noqa: PLR0911 - one mistake each
    """A word that is nearly one of the language, or one of another language."""
    text, previous = at.text(), at.text(-1)
    if "MONITOR" in at.expected:
        return _near(text, ("monitor",)) or "each formula has a name: monitor NAME: FORMULA"
    if at.kind() == "MONITOR" and "ALWAYS" in at.expected:
        return "one formula is asked for here, without 'monitor' and a name"
    if text in _OPERATORS and "ALWAYS" in at.expected:
        return f"{text!r} stands between two formulas"
    if at.kind() == "NAME" and "AND" in at.expected:
        return _ADVICE.get(text) or _ADVICE.get(previous) or _near(text, _OPERATORS) or _near(previous, _PREFIXES).text
    if "NAME" in at.expected and at.kind() != "NAME" and text.isidentifier():
        return f"{text!r} is a word of the language; choose another name"
    if at.kind(-1) == "NAME" and "LSQB" in at.expected:
        return _near(previous, _PREFIXES).text
    return ""


def _near(text: str, words: Sequence[str]) -> Hint:
    elsewhere = _ELSEWHERE.get(text, _ELSEWHERE.get(text.lower(), "") if len(text) > 1 else "")
    if elsewhere in words or elsewhere == "=":
        return Hint(f"write {elsewhere!r}", elsewhere)
    return near(text.lower(), words)


_RULES: tuple[Callable[[Misfit], str | Hint], ...] = (
    _signs,
    _windows,
    _comparisons,
    _arguments,
    _variables,
    _numbers,
    _brackets,
    _spelling,
)
