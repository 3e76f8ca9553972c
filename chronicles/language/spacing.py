"""What is written between two words that stand on one line?"""

from __future__ import annotations

from collections.abc import Sequence

from dyknow.language.words import COMMENT, Word

_SIGNS = frozenset({"POSITIVE", "NEGATIVE"})
_BRACKETS = frozenset({"OPENING", "CLOSING"})
_GLUED = frozenset({"COMMA", "RPAR", "COLON", "RANGE", "_END"})  # to the word before
_GLUING = frozenset({"LPAR", "COLON", "RANGE"})  # the word after
_BEFORE_VALUES = frozenset({"COMMA", "EQUAL", "IN", "VBAR", "TILDE"})


def gaps(words: Sequence[Word]) -> dict[int, str]:
    """Give what stands before each word: a space or nothing; nothing before comments and the first word."""
    state = _Spacing()
    found: dict[int, str] = {}
    for index, word in enumerate(words):
        found[index] = "" if word.kind == COMMENT else state.before(word)
    return found


class _Spacing:
    """Reads words one after the other; remembers what brackets, braces and signs around the place mean."""

    def __init__(self) -> None:
        self._previous = ""
        self._glues = True
        self._in_brackets = False
        self._in_example = False
        self._values_depth = 0

    def before(self, word: Word) -> str:
        """Give what stands before the next word."""
        kind = word.kind
        glued, glues = kind in _GLUED, kind in _GLUING
        if kind in _BRACKETS:
            # ]0s, 3s[ is a range too: the first bracket opens, whichever it is.
            glued = self._in_brackets or self._previous not in _BEFORE_VALUES
            glues = not self._in_brackets
            self._in_brackets = not self._in_brackets
        elif kind == "LPAR":
            glued = self._previous not in _BEFORE_VALUES
        elif kind == "LBRACE":
            glues = self._previous in _BEFORE_VALUES or self._previous == "LPAR"
            self._values_depth += glues
        elif kind == "RBRACE" and self._values_depth:
            glued = True
            self._values_depth -= 1
        elif kind in _SIGNS:
            # After a time point the sign stands between two things, elsewhere it belongs to what follows.
            glues = self._previous != "TIME_POINT"
        elif kind == "EQUAL":
            glued = glues = self._in_example
        elif kind == "EXAMPLE":
            self._in_example = True
        elif kind == "CHRONICLE":
            self._in_example = False
        gap = "" if glued or self._glues else " "
        self._previous, self._glues = kind, glues
        return gap
