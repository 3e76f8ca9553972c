"""How is a time constraint written that is clear to people and has another form in the language?"""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

from chronicles.language.words import Word

_MIRRORED = MappingProxyType({"<": ">", "<=": ">=", "=": "=", ">=": "<=", ">": "<"})
_LENGTHS = ("DURATION", "NUMBER", "NAME")
_SIGNS = ("POSITIVE", "NEGATIVE")


def rewritten_constraint(words: Sequence[Word], at: int) -> str:
    """Give a hint for a constraint that is read up to the word at an index, which does not fit; "" if it is none.

    Examples
    --------
    >>> from chronicles.language.diagnostics import Reporter
    >>> from chronicles.language.words import read_words
    >>> rewritten_constraint(read_words("t2 - t1 < 5s", "a", Reporter({"a": ""})), 3)
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


def _is_comparator(word: Word) -> bool:
    return word.text in _MIRRORED


def _difference(words: Sequence[Word], at: int) -> str:
    """`t2 - t1 < 5s`."""
    if not (_kinds(words, at - 3, ["TIME_POINT"], ["NEGATIVE"], ["TIME_POINT"]) and _is_comparator(words[at])):
        return ""
    if not _kinds(words, at + 1, _LENGTHS):
        return "write a range such as t2 - t1 in [0s, 5s]"
    later, earlier, length, sign = words[at - 3].text, words[at - 1].text, words[at + 1].text, words[at].text
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
