"""Which words does a text consist of, and where do they stand?

No word goes over the end of a line. Blanks are left out; comments are kept apart for those who want them.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from chronicles.language.diagnostics import Hint, Reporter, Span
from chronicles.language.grammar import load_grammar

COMMENT = "COMMENT"
_SINGLE_QUOTED = re.compile(r"'[^'\n]*'")
_OTHER_COMMENT = re.compile(r"/\*(.*?\*/)?", re.DOTALL)


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
            bad = _bad_word(text, at, line, at - line_start + 1, after_comma=bool(words) and words[-1].kind == "COMMA")
            if bad.kind or bad.text not in reported:
                _report(bad, name, reporter)
            reported.add(bad.text)
            at += len(bad.text)
            if "\n" in bad.text:  # in a comment of another language
                line += bad.text.count("\n")
                line_start = at - len(bad.text) + bad.text.rindex("\n") + 1
            if bad.kind and bad.kind != COMMENT:
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


def _bad_word(text: str, at: int, line: int, column: int, *, after_comma: bool) -> Word:
    """Give what no word matches, with the kind that was meant if that is clear: one character if nothing is."""
    kind, bad = "", text[at]
    if text[at] == '"':  # a text without its second quote, to the end of the line
        kind, bad = "STRING", text[at:].split("\n", 1)[0]
    elif found := _SINGLE_QUOTED.match(text, at):
        kind, bad = "STRING", found.group()
    elif found := _OTHER_COMMENT.match(text, at):
        kind, bad = COMMENT, found.group()
    elif text[at] == "*" and after_comma:
        kind = "INFINITE"
    return Word(kind, bad, line, column, column + len(bad))


def _report(bad: Word, name: str, reporter: Reporter) -> None:
    came, marked, hint = f"the character {bad.text[0]!r}", 1, Hint("leave it out")
    if bad.text[0] == '"':
        hint = Hint('texts start and end with " on one line')
    elif bad.kind == "STRING":
        inner, marked = bad.text[1:-1], len(bad.text)
        hint = Hint("texts stand in double quotes", None if '"' in inner or "\\" in inner else f'"{inner}"')
    elif bad.kind == COMMENT:
        came, marked, hint = f"{bad.text[:2]!r}", 2, Hint("comments start with # and end with their line")
    elif bad.kind == "INFINITE":
        hint = Hint("no bound is written oo", "oo")
    span = Span(name, bad.line, bad.column, bad.line, bad.column + marked)
    reporter.error("C0101", f"expected a word of the language, got {came}", span, hint)
