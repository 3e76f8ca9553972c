"""Which words does a text consist of, and where do they stand?

No word goes over the end of a line. Blanks are left out; comments are kept apart for those who want them.
"""

from __future__ import annotations

from typing import NamedTuple

from chronicles.language.diagnostics import Reporter, Span
from chronicles.language.grammar import load_grammar

COMMENT = "COMMENT"


class Word(NamedTuple):
    """A word: `kind` as named in the grammar, lines and columns from 1, `end_column` one past its last character."""

    kind: str
    text: str
    line: int
    column: int
    end_column: int


def read_words(text: str, name: str, reporter: Reporter) -> list[Word]:
    """Cut a text into words; characters that no word has go to the reporter and are left out.

    Examples
    --------
    >>> [(one.kind, one.text) for one in read_words("t2-t1 in [-3, 2s]  # why", "a", Reporter({"a": ""}))][:4]
    [('TIME_POINT', 't2'), ('NEGATIVE', '-'), ('TIME_POINT', 't1'), ('IN', 'in')]
    """
    return [word for word in read_words_and_comments(text, name, reporter) if word.kind != COMMENT]


def read_words_and_comments(text: str, name: str, reporter: Reporter) -> list[Word]:
    """Cut a text into words and comments, in the order of the text."""
    grammar = load_grammar()
    keywords, match = grammar.keywords, grammar.pattern.match
    words: list[Word] = []
    reported: set[str] = set()
    at, line, line_start = 0, 1, 0
    while at < len(text):
        found = match(text, at)
        if found is None:
            bad = _bad_word(text, at, line, at - line_start + 1)
            if bad.kind == "STRING" or bad.text not in reported:
                _report(bad, name, reporter)
            reported.add(bad.text)
            at += len(bad.text)
            if bad.kind == "STRING":
                words.append(bad)
            continue
        kind, end = found.lastgroup or "", found.end()
        word = found.group()
        if kind == "NAME":
            kind = keywords.get(word, kind)
        if kind not in grammar.ignored or kind == COMMENT:
            words.append(Word(kind, word, line, at - line_start + 1, end - line_start + 1))
        elif "\n" in word:
            line += word.count("\n")
            line_start = at + word.rindex("\n") + 1
        at = end
    return words


def _bad_word(text: str, at: int, line: int, column: int) -> Word:
    """Give what no word matches: a text without its second quote, to the end of the line, or one character."""
    if text[at] != '"':
        return Word("", text[at], line, column, column + 1)
    end = text.find("\n", at)
    rest = text[at:] if end < 0 else text[at:end]
    return Word("STRING", rest, line, column, column + len(rest))


def _report(bad: Word, name: str, reporter: Reporter) -> None:
    span = Span(name, bad.line, bad.column, bad.line, bad.column + 1)
    hint = 'texts start and end with " on one line' if bad.kind == "STRING" else "leave it out"
    message = f"expected a word of the language, got the character {bad.text[0]!r}"
    reporter.error("C0101", message, span, hint)
