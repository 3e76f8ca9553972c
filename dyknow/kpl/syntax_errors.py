"""How is a syntax error of KPL said, and how is it mended?"""

from collections.abc import Collection, Mapping

from dyknow.language.diagnostics import Hint, near, suggest
from dyknow.language.durations import meant
from dyknow.language.wording import Misfit, described, listed
from dyknow.language.words import Strange

STATEMENT_WORDS = ("sort", "object", "feature", "source", "compunit", "configuration", "strmgen", "configure", "stream")
_CONSTRAINT_WORDS = ("any", "sample", "no", "use", "linear", "max", "from", "to", "oldest", "monotone", "strict")
_LONGEST_WORD = 30  # longer ones are like no word of the language
_KINDS = {
    "NAME": "a name",
    "QUANTITY": "a duration such as 200ms",
    "NUMBER": "",  # Wherever a bare number fits, so does one with a unit, which says more.
    "POLICY_COMMA": "','",
    "$END": "the end",
}
_SIGNS = ("INFINITE", "EQUAL", "LPAR", "RPAR", "LSQB", "RSQB", "MORETHAN", "COMMA", "SEMICOLON")
_MARKS = frozenset({*_KINDS, *_SIGNS})  # what is no word of the language


def describe_misfit(misfit: Misfit, spellings: Mapping[str, str]) -> tuple[str, Hint]:
    """Say what was expected and what came, and how that is mended (may be empty).

    Parameters
    ----------
    spellings : what a user types, for each kind of word that has one spelling.

    Examples
    --------
    >>> from dyknow.language.words import Word
    >>> words = [Word("ANY", "any", 1, 1, 4), Word("NAME", "ordr", 1, 5, 9)]
    >>> describe_misfit(Misfit(words, 1, {"ORDER", "UPDATE"}), {"ORDER": "order", "UPDATE": "update"})
    ("expected 'order' or 'update' after 'any', got 'ordr'", Hint(text="did you mean 'order'?", edit='order'))
    """
    message = misfit.message(_expected(misfit.expected, spellings), "statement")
    if misfit.is_end:
        return message, Hint("statements end with ';'" if "SEMICOLON" in misfit.expected else "")
    hint = _hint(misfit, spellings)
    return message, hint if isinstance(hint, Hint) else Hint(hint)


def _expected(fitting: Collection[str], spellings: Mapping[str, str]) -> str:
    if "STRMGEN" in fitting:
        return "a statement"
    if "SAMPLE" in fitting:
        return "a constraint such as 'strict order'"
    if "LESSTHAN" in fitting:
        return "a type"
    kinds = _without_words_as_names(fitting)
    marks = sorted((kind for kind in kinds if kind in _MARKS), key=lambda kind: (kind == "$END", kind))
    words = described([kind for kind in kinds if kind not in _MARKS], {}, spellings)
    return listed([*words, *described(marks, _KINDS, spellings, marks)])


def _without_words_as_names(fitting: Collection[str]) -> Collection[str]:
    """Leave out the words that may be names where "a name" says it all."""
    return [kind for kind in fitting if kind in _MARKS or kind == "WITH"] if "NAME" in fitting else fitting


def _hint(at: Misfit, spellings: Mapping[str, str]) -> str | Hint:
    if "STRMGEN" in at.expected:
        return _near(at.text(), STATEMENT_WORDS) or "statements start with " + ", ".join(STATEMENT_WORDS)
    if "SAMPLE" in at.expected:
        return _hint_on_constraint(at)
    return (
        _hint_on_policy(at)
        or _hint_on_previous(at)
        or _hint_on_name(at)
        or _near(at.text(), [spellings[kind] for kind in at.expected if kind not in _MARKS])
    )


def _hint_on_constraint(at: Misfit) -> str | Hint:
    if at.kind() in ("NUMBER", "QUANTITY"):
        return "decimals have a point, as in 0.5s"
    word = _near(at.text(), _CONSTRAINT_WORDS)
    phrase = _PHRASES.get(suggest(at.text().lower()[:_LONGEST_WORD], _PHRASES).edit or "")
    if phrase and (not word or at.text() in _PHRASES):
        return Hint(f"did you mean {phrase!r}?", phrase)
    return word or "constraints start with " + ", ".join(_CONSTRAINT_WORDS)


def _hint_on_policy(at: Misfit) -> str | Hint:
    if at.kind() in _CONSTRAINT_KINDS and "WITH" in at.expected:
        return "constraints come after 'with'"
    if at.kind() in _CONSTRAINT_KINDS and "POLICY_COMMA" in at.expected:
        return "constraints are joined by ','"
    if at.kind() == "WITH" and "SEMICOLON" in at.expected:
        return "a policy comes before 'by'" if "LSQB" in at.expected else "a policy belongs to a label that is read"
    is_infinite = "INFINITE" in at.expected and at.text().lower().startswith("inf")
    return Hint("'oo' is infinite", "oo") if is_infinite else ""


def _hint_on_previous(at: Misfit) -> str | Hint:
    if at.kind(-1) in ("NUMBER", "QUANTITY") and at.kind() == "NAME":
        return meant("", at.text())
    if at.kind(-1) == "NAME" and "WITH" in at.expected:
        return _near(at.text(-1), _CONSTRAINT_WORDS).text
    return _near(at.text(-1), ("selection", "collection")).text if at.kind() == "OF" else ""


def _hint_on_name(at: Misfit) -> str:
    if at.kind() == "LPAR" and "LSQB" in at.expected:
        return "labels have their arguments in [ ]; units are applied by 'strmgen', which gives what comes out a label"
    if "NAME" in at.expected and at.text().isidentifier():
        return f"{at.text()!r} is a word of the language; choose another name"
    return ""


_PHRASES: Mapping[str, str] = {
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


def explain_character(text: str, at: int, _before: str) -> Strange:
    """Say what may have been meant by a character that no word has; nothing where nobody knows.

    Examples
    --------
    >>> explain_character("{", 0, "").hint.text, explain_character("~", 0, "").hint.text
    ('labels have their arguments in [ ]', '')
    """
    if text[at].isalnum():
        return Strange(text[at], Hint("names are made of the letters a to z and A to Z, digits and '_'"))
    hints = (hint for characters, hint in _HINTS_ON_CHARACTERS.items() if text[at] in characters)
    return Strange(text[at], Hint(next(hints, "")))


_HINTS_ON_CHARACTERS: Mapping[str, str] = {
    "{}": "labels have their arguments in [ ]",
    ":": "statements give a name by '='",
    "/*!": "comments start with # or //",
    "-+": "names have no '-', and durations are not negative",
    ".": "write 0.5s for half a second; names have no '.'",
    "\"'`\u201c\u201d\u201e\u2018\u2019": "names stand without quotes",
    "\u221e": "'oo' is infinite",
    "\uff1b\u037e": "statements end with ';'",
}
_CONSTRAINT_KINDS = frozenset(word.upper() for word in _CONSTRAINT_WORDS)


def _near(text: str, words: Collection[str]) -> Hint:
    return near(text.lower()[:_LONGEST_WORD], words)
