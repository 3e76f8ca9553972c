"""Which words does a text consist of, and where do they stand?

No word goes over the end of a line. Blanks are left out; comments are kept apart for those who want them.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

from dyknow.language.diagnostics import Hint, Reporter
from dyknow.language.grammar import Grammar
from dyknow.language.places import Span

COMMENT = "COMMENT"
STRANGE = "STRANGE"  # the kind of what no word matches and nobody can guess
_MOST_STRANGE = 10  # more kinds of strange characters are counted, not shown: such a text is of no language of ours


class Source(NamedTuple):
    """A text that is read: its name, the letter with which the codes of its language begin, who takes what is found."""

    file: str
    letter: str
    reporter: Reporter


class Word(NamedTuple):
    """A word: `kind` as named in the grammar, lines and columns from 1, `end_column` one past its last character."""

    kind: str
    text: str
    line: int
    column: int
    end_column: int

    def span(self, file: str) -> Span:
        """Give the place of the word in a file."""
        return Span(file, self.line, self.column, self.line, self.end_column)

    @property
    def unquoted(self) -> str:
        """What a text in quotes says."""
        return re.sub(r"\\(.)", r"\1", self.text[1:-1])


def quoted(text: str) -> str:
    """Write a text in quotes."""
    return '"' + re.sub(r'(["\\])', r"\\\1", text) + '"'


class Strange(NamedTuple):
    """Characters that no word has.

    `kind` is the kind of word that was meant, if that is clear; each of these is reported, of the others each text
    once. The first `marked` characters are told, as `came`.
    """

    text: str
    hint: Hint
    kind: str = STRANGE
    came: str = ""
    marked: int = 1


Explain = Callable[[str, int, str], Strange]  # of the text, an index, and the kind of the word before


def normalised(text: str) -> str:
    r"""Take what editors add out of a text: a byte order mark at its start, and foreign ends of lines.

    Examples
    --------
    >>> normalised("\ufeffsort A;\r\nsort B;\rsort C;")
    'sort A;\nsort B;\nsort C;'
    """
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def opened(text: str, name: str, letter: str, grammar: Grammar, explain: Explain) -> tuple[Source, list[Word]]:
    """Open a text that stands alone, with a reporter of its own, and give its words without comments.

    Parameters
    ----------
    name : what messages call the text. letter : with which the codes of its language begin.
    explain : as for `read_words`.
    """
    text = normalised(text)
    source = Source(name, letter, Reporter({name: text}))
    return source, [word for word in read_words(text, source, grammar, explain) if word.kind != COMMENT]


def read_words(text: str, source: Source, grammar: Grammar, explain: Explain) -> list[Word]:
    """Cut a text into words and comments, in the order of the text.

    Parameters
    ----------
    explain : says what strange characters may have been meant for. They are reported; what nobody can guess is a word
        of the kind `STRANGE` in the result.
    """
    ignored, keywords, match = grammar.ignored, grammar.keywords, grammar.pattern.match
    words: list[Word] = []
    strange: dict[str, tuple[Word, Strange]] = {}
    at, line, line_start = 0, 1, 0
    while at < len(text):
        found = match(text, at)
        if found is not None:
            kind, end = found.lastgroup or "", found.end()
            word = found.group()
            if kind == "NAME":
                kind = keywords.get(word, kind)
        else:
            bad = explain(text, at, words[-1].kind if words else "")
            kind, word, end = bad.kind, bad.text, at + len(bad.text)
            place = Word(kind, word, line, at - line_start + 1, at - line_start + 1 + bad.marked)
            strange.setdefault(word if kind == STRANGE else f"{word}{at}", (place, bad))
        if kind not in ignored or (kind == COMMENT and "\n" not in word):
            words.append(Word(kind, word, line, at - line_start + 1, end - line_start + 1))
        elif "\n" in word:
            line += word.count("\n")
            line_start = at + word.rindex("\n") + 1
        at = end
    _report(list(strange.values()), source)
    return words


def _report(strange: list[tuple[Word, Strange]], source: Source) -> None:
    code = f"{source.letter}0101"
    for place, bad in strange[:_MOST_STRANGE]:
        came = bad.came or f"the character {bad.text[0]!r}"
        message = f"expected a word of the language, got {came}"
        source.reporter.error(code, message, place.span(source.file), bad.hint)
    if len(strange) > _MOST_STRANGE:
        more = len(strange) - _MOST_STRANGE
        message = f"expected words of the language, got {more} more kinds of characters from here"
        source.reporter.error(code, message, strange[_MOST_STRANGE][0].span(source.file))
