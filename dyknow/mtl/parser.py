"""Which formulas does a text have, and where is it malformed?

The words are read once; a text of monitors is cut at the word ``monitor``, and each piece is parsed on its own, so that
one reading finds one malformed place in each monitor and everything that is wrong with the meaning of the others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from functools import cache
from importlib.resources import files
from typing import Any  # lark leaves the children of a tree untyped

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedToken

from dyknow.diagnostics import Reporter, Span
from dyknow.mtl.errors import FormulaError
from dyknow.mtl.formula import Formula, Monitor
from dyknow.mtl.signature import Signature
from dyknow.mtl.syntax_errors import describe_unexpected
from dyknow.mtl.tree_builder import TreeBuilder, span_of

# Reading, printing and progression call themselves for each operator inside another.
_DEEPEST = 100


def parse_formula(
    text: str, *, name: str = "formula", variables: Collection[str] = (), signature: Signature | None = None
) -> Formula:
    """Read one formula.

    Parameters
    ----------
    text : the formula.
    name : its file name or label, for messages.
    variables : names that may stay free; the progressor wants an object for each.
    signature : if given, features, their numbers of arguments, and sorts are checked against it.

    Raises
    ------
    FormulaError
        If the text is malformed or means nothing; it lists every error found.

    Examples
    --------
    >>> parse_formula("always eventually[0, 1s] green")
    Always(body=Eventually(body=Proposition(feature=Feature(name='green', arguments=())),
                           window=Window(start_us=0, end_us=1000000)),
           window=Window(start_us=0, end_us=None))
    >>> parse_formula("always[2s, 1s] green")
    Traceback (most recent call last):
    dyknow.mtl.errors.FormulaError: error[F0301]: expected an end that is not before the start 2s, got 1s
     --> formula:1:12
      |
    1 | always[2s, 1s] green
      |            ^^
    """
    reporter = Reporter(text, name, FormulaError)
    words = _read_words(text, reporter)
    reporter.raise_if_any()
    tree = _parse(words, "formula", reporter)
    reporter.raise_if_any()
    assert tree is not None
    formula = TreeBuilder(reporter, signature).formula(tree, dict.fromkeys(variables, None))
    reporter.raise_if_any()
    return formula


def parse_monitors(text: str, *, name: str = "monitors", signature: Signature | None = None) -> tuple[Monitor, ...]:
    """Read a text of named formulas, ``monitor NAME per SORT: FORMULA``.

    Parameters
    ----------
    text : the whole text.
    name : its file name or label, for messages.
    signature : as for `parse_formula`.

    Returns
    -------
    The monitors in the order of the text.

    Raises
    ------
    FormulaError
        If the text is malformed or means nothing; it lists every error found.

    Examples
    --------
    >>> text = "monitor careful per Car: always speed[?c] < 50 km/h"
    >>> [(one.name, one.subjects) for one in parse_monitors(text)]
    [('careful', (Subject(variable=Variable(name='c'), sort='Car'),))]
    """
    reporter = Reporter(text, name, FormulaError)
    builder = TreeBuilder(reporter, signature)
    trees = [_parse(piece, "monitor", reporter) for piece in _pieces(_read_words(text, reporter))]
    monitors = [builder.monitor(tree) for tree in trees if tree is not None]
    reporter.raise_if_any()
    return tuple(one for one in monitors if one is not None)


@cache  # The grammar is a constant that costs 50 ms to load: loaded when the first text is parsed, not on import.
def _grammar() -> Lark:
    text = files("dyknow.mtl").joinpath("formula.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", lexer="basic", start=["formula", "monitor"], propagate_positions=True)


def _read_words(text: str, reporter: Reporter) -> list[Token]:
    """Cut a text into words; each kind of character that no word has is reported once and read as a blank."""
    while True:
        try:
            return list(_grammar().lex(text))
        except UnexpectedCharacters as found:
            at = found.pos_in_stream or 0
            bad = text[at]
            hint = {'"': 'texts start and end with " on one line', "&": "write 'and'", "|": "write 'or'"}.get(bad, "")
            span = Span(found.line, found.column, found.line, found.column + 1)
            reporter.error("F0101", f"expected a word of the language, got the character {bad!r}", span, hint)
            text = text[:at] + text[at:].replace(bad, " ")


def _pieces(words: Iterable[Token]) -> Iterator[list[Token]]:
    """Cut before each ``monitor``: the word is reserved."""
    piece: list[Token] = []
    for word in words:
        if word.type == "MONITOR" and piece:
            yield piece
            piece = []
        piece.append(word)
    if piece:
        yield piece


def _parse(words: list[Token], start: str, reporter: Reporter) -> Tree[Any] | None:
    parser = _grammar().parse_interactive("", start=start)
    previous = Token("$START", "", line=1, column=1, end_line=1, end_column=1)
    try:
        for word in words:
            parser.feed_token(word)
            previous = word
        tree: Tree[Any] = parser.feed_eof(previous)  # type: ignore[no-untyped-call]  # lark's
    except UnexpectedToken as found:
        token = found.token
        fitting = set(parser.accepts())  # type: ignore[no-untyped-call]  # lark's
        message, hint = describe_unexpected(token, fitting, previous)
        at_end = token.type == "$END"
        reporter.error("F0103" if at_end else "F0102", message, span_of(previous if at_end else token), hint)
        return None
    if _depth(tree) > _DEEPEST:
        message = f"expected operators in one another up to {_DEEPEST} deep, got more"
        reporter.error("F0104", message, span_of(words[0]), "give parts of it monitors of their own")
        return None
    return tree


def _depth(tree: Tree[Any]) -> int:
    deepest, waiting = 0, [(tree, 1)]
    while waiting:  # what reads the tree calls itself, so this must not
        node, depth = waiting.pop()
        deepest = max(deepest, depth)
        waiting += [(child, depth + 1) for child in node.children if isinstance(child, Tree)]
    return deepest
