"""How is a syntax error of a chronicle said, and how is it mended?

Many mistakes are constraints that are clear to people and have another form in the language.
"""

from collections.abc import Collection, Container, Sequence
from types import MappingProxyType

from dyknow.language.diagnostics import Hint, suggest
from dyknow.language.grammar import load_grammar
from dyknow.language.wording import Misfit, described, listed
from dyknow.language.words import Word

DECLARATION_WORDS = ("timeunit", "constant", "domain", "attribute", "message", "chronicle", "example")
WORDS_WITH_PARENTHESIS = ("event", "noevent", "occurs", "hold", "assert")
STATEMENT_WORDS = (*WORDS_WITH_PARENTHESIS, "allow", "select", "confidence", "when")
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
    "RECOGNIZED": "",
    "$END": "the end of the declaration",
}
# Closing marks first: a forgotten one is the commonest mistake.
_CLOSING = ("COMMA", "RPAR", "CLOSING", "RBRACE", "COLON")
# Where a new statement may start, which words start one says more than all that fits: (kinds, what it is, words).
_STARTS = (
    (frozenset({"EVENT", "NOEVENT"}), "a statement", STATEMENT_WORDS),
    (frozenset({"REPORT"}), "'emit', 'report' or 'assert'", ACTION_WORDS),
    (frozenset({"UNTIL"}), "a time and an event, 'expect' or 'until'", EXAMPLE_WORDS),
    (frozenset({"CHRONICLE"}), "a declaration", DECLARATION_WORDS),
)
_MIRRORED = MappingProxyType({"<": ">", "<=": ">=", "=": "=", ">=": "<=", ">": "<"})
_LENGTHS = ("DURATION", "NUMBER", "NAME")
_SIGNS = ("POSITIVE", "NEGATIVE")
_UNITS = MappingProxyType({"second": "s", "sec": "s", "": "s", "minute": "min", "min": "min", "hour": "h", "h": "h"})
# What logic and other languages write where a statement of this one starts.
_FOREIGN = MappingProxyType(
    {
        "and": "all statements must hold anyway: leave out 'and'",
        "or": "write a chronicle for each way it can happen; all may emit the same event",
        "not": "write noevent(...) for what must not happen, with its window: noevent(stopped[?car], (t1, t2))",
    }
)
# What may follow a finished statement says nothing about the mistake inside an unfinished one.
_MOST_LISTED = 5


def starts_statement(kinds: Container[str]) -> bool:
    """Say whether a statement, an action or an item of an example may start where words of these kinds fit."""
    return ("EVENT" in kinds and "NOEVENT" in kinds) or "REPORT" in kinds or "UNTIL" in kinds


def describe_misfit(misfit: Misfit) -> tuple[str, Hint]:
    """Say what was expected and what came, and how that is mended (may be empty)."""
    wanted, words = _expected(misfit)
    message = misfit.message(wanted, "declaration")
    if misfit.is_end:
        first = misfit.words[0]
        return message, Hint(f"the {first.text} that starts in line {first.line} is not closed")
    rewritten = rewritten_constraint(misfit.words, misfit.index)
    if rewritten:
        return message, Hint(rewritten)
    return message, _statement_hint(misfit, words) if words else _hint(misfit)


def _expected(misfit: Misfit) -> tuple[str, tuple[str, ...]]:
    """Say what was expected, and which words start it where it is a statement or the like."""
    expected = misfit.expected
    for kinds, wanted, words in _STARTS:
        if kinds <= expected:
            return wanted, words
    if expected <= {"$END", "_END"} or ("$END" in expected and misfit.kind() == "NAME"):
        return "a new declaration", DECLARATION_WORDS
    spellings = load_grammar("chronicles.language", "chronicle.lark", "declaration").spellings
    texts = [text for text in described(expected, _KINDS, spellings, _CLOSING) if text]
    return listed(texts[:_MOST_LISTED], "something else"), ()


def _statement_hint(misfit: Misfit, words: tuple[str, ...]) -> Hint:
    text, after = misfit.text(), misfit.words[misfit.index + 1 : misfit.index + 2]
    if text in _FOREIGN and "EVENT" in misfit.expected:
        return Hint(_FOREIGN[text])
    if misfit.kind() == "NAME" and [one.text for one in after] == ["["]:
        return Hint(
            "a value is compared by a monitor, and its verdict is an event here: "
            f"monitor m per Car: always {text}[?car] < 90 km/h gives event(m_violated[?car], t1)"
        )
    if misfit.kind() == "NAME":
        return suggest(text, words)
    return Hint("one of " + ", ".join(map(repr, words)) + " starts here")


def _hint(misfit: Misfit) -> Hint:  # noqa: PLR0911 - one mistake each
    word, expected = misfit.words[misfit.index], misfit.expected
    if word.kind == "SAME" and "EQUAL" in expected:
        return Hint("time points are compared with '=', variables with '=='", "=")
    if word.kind == "EQUAL" and "SAME" in expected:
        return Hint("variables are compared with '==' and '!=', time points with '='", "==")
    if word.text == "," and "COLON" in expected:
        return Hint("say which value is held, such as hold(moving[?car]:true, (t1, t2))")
    before = misfit.words[misfit.index - 1]
    if before.kind == "NUMBER" and (unit := _unit(misfit.words, misfit.index)):
        return Hint(f"the unit stands close by: {before.text}{unit}")
    if before.text == ":" and "LPAR" in expected:
        return Hint(
            "an event is a change: moving[?car]:(false, true), where ? stands for any value; what lasts is a hold"
        )
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


def rewritten_constraint(words: Sequence[Word], at: int) -> str:
    """Give a hint for a constraint that is read up to the word at an index, which does not fit; "" if it is none.

    Examples
    --------
    >>> from chronicles.language.parser import words_and_comments
    >>> from dyknow.language.diagnostics import Reporter
    >>> rewritten_constraint(words_and_comments("t2 - t1 < 5s", "a", Reporter({"a": ""})), 3)
    'write t2 < t1 + 5s, or a range such as t2 - t1 in [0s, 5s]'
    """
    for hint in (_difference, _offset_on_the_left, _chain):
        if text := hint(words, at):
            return text
    return ""


def _kinds(words: Sequence[Word], start: int, *wanted: Sequence[str]) -> bool:
    """Say whether words of certain kinds stand from an index on."""
    found = words[start : start + len(wanted)] if start >= 0 else ()
    return len(found) == len(wanted) and all(one.kind in kinds for one, kinds in zip(found, wanted, strict=True))


def _unit(words: Sequence[Word], at: int) -> str:
    """Give the unit of time that is written out at an index; "" if none is."""
    return _UNITS.get(words[at].text.lower().rstrip("s"), "") if _kinds(words, at, ["NAME"]) else ""


def _is_comparator(word: Word) -> bool:
    return word.text in _MIRRORED


def _difference(words: Sequence[Word], at: int) -> str:
    """`t2 - t1 < 5s`."""
    if not (_kinds(words, at - 3, ["TIME_POINT"], ["NEGATIVE"], ["TIME_POINT"]) and _is_comparator(words[at])):
        return ""
    if not _kinds(words, at + 1, _LENGTHS):
        return "write a range such as t2 - t1 in [0s, 5s]"
    later, earlier, length, sign = words[at - 3].text, words[at - 1].text, words[at + 1].text, words[at].text
    length += _unit(words, at + 2)
    low, high = ("0s", length) if sign[0] == "<" else (length, length if sign == "=" else "oo")
    return f"write {later} {sign} {earlier} + {length}, or a range such as {later} - {earlier} in [{low}, {high}]"


def _offset_on_the_left(words: Sequence[Word], at: int) -> str:
    """`t1 + 5s < t2`: fails at the plus, or behind the minus."""
    sign = at if words[at].kind == "POSITIVE" else at - 1
    if not (_kinds(words, sign - 1, ["TIME_POINT"], _SIGNS, _LENGTHS) and sign + 3 < len(words)):
        return ""
    point, comparator, other = words[sign - 1].text, words[sign + 2], words[sign + 3]
    if not _is_comparator(comparator) or other.kind != "TIME_POINT":
        return ""
    offset = f"{words[sign].text} {words[sign + 1].text}"
    return f"the offset stands on the right: write {other.text} {_MIRRORED[comparator.text]} {point} {offset}"


def _chain(words: Sequence[Word], at: int) -> str:
    """`t1 <= t2 <= t3`: fails at the second comparator."""
    if not (
        _is_comparator(words[at]) and at > 2 and words[at - 1].kind == "TIME_POINT" and _is_comparator(words[at - 2])
    ):
        return ""
    first, middle = words[at - 3], words[at - 1]
    if first.kind != "TIME_POINT" or not _kinds(words, at + 1, ["TIME_POINT"]):
        return ""
    has_offset = _kinds(words, at + 2, _SIGNS, _LENGTHS)
    last = " ".join(one.text for one in words[at + 1 : at + (4 if has_offset else 2)])
    left, right = words[at - 2].text, words[at].text
    return f"write two constraints: {first.text} {left} {middle.text}; {middle.text} {right} {last}"
