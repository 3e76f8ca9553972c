"""Which formulas does a text have, and where is it malformed?

The words are read once; a text of monitors is cut at the word ``monitor``, and each piece is parsed on its own, so that
one reading finds one malformed place in each monitor and everything that is wrong with the meaning of the others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from itertools import islice
from types import MappingProxyType
from typing import Any  # lark leaves the children of a tree untyped

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedToken
from lark.lexer import PatternStr

from dyknow.language.diagnostics import Reporter
from dyknow.mtl.errors import FormulaError
from dyknow.mtl.formula import Formula, Monitor
from dyknow.mtl.places import span_of
from dyknow.mtl.signature import Signature
from dyknow.mtl.syntax_errors import describe_unexpected
from dyknow.mtl.syntax_hints import hint_for_character
from dyknow.mtl.tree_builder import TreeBuilder, check_nesting

# Reading, printing and progression call themselves for each operator inside another.
_DEEPEST = 100
# More kinds of strange characters than this are counted, not shown: such a text is no text of formulas.
_MOST_STRANGE = 10


def parse_formula(
    text: str, *, name: str = "formula", variables: Collection[str] = (), signature: Signature | None = None
) -> Formula:
    """Read one formula.

    Parameters
    ----------
    text : the formula.
    name : its file name or label, for messages.
    variables : names that may stay free; the progressor wants an object for each.
    signature : if given, features, their numbers of arguments, kinds and values, and sorts are checked against it.

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
    tree = _parse(_read_words(text, reporter), "formula", reporter)
    reporter.raise_if_any()
    assert tree is not None
    formula = TreeBuilder(reporter, signature).formula(tree, dict.fromkeys(variables, None))
    check_nesting(formula, tree, reporter)
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
    starts = ["formula", "monitor", "strange"]
    return Lark(text, parser="lalr", lexer="basic", start=starts, propagate_positions=True)


@cache  # as long-lived as the grammar
def _spellings() -> Mapping[str, str]:
    """Give what a user types for each kind of word that has one spelling."""
    terminals = _grammar().terminals
    return MappingProxyType({one.name: one.pattern.value for one in terminals if isinstance(one.pattern, PatternStr)})


def _read_words(text: str, reporter: Reporter) -> list[Token]:
    """Cut a text into words; each kind of character that no word has is reported once."""
    words = list(_grammar().lex(text))
    kinds: dict[str, Token] = {}
    for word in words:
        if word.type == "STRANGE":
            kinds.setdefault(str(word), word)
    for character, first in islice(kinds.items(), _MOST_STRANGE):
        message = f"expected a word of the language, got the character {character!r}"
        reporter.error("F0101", message, span_of(first), hint_for_character(character))
    if len(kinds) > _MOST_STRANGE:
        first = list(kinds.values())[_MOST_STRANGE]
        message = f"expected words of the language, got {len(kinds) - _MOST_STRANGE} more kinds of characters from here"
        reporter.error("F0101", message, span_of(first))
    return words


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
    if any(word.type == "STRANGE" for word in words):
        return None  # reported; what else is said about such words only follows from it
    parser = _grammar().parse_interactive("", start=start)
    taken = 0
    try:
        for word in words:
            parser.feed_token(word)
            taken += 1
        last = words[-1] if words else Token("$START", "", line=1, column=1)
        tree: Tree[Any] = parser.feed_eof(last)  # type: ignore[no-untyped-call]  # lark's
    except UnexpectedToken:
        found = describe_unexpected(words, taken, _fitting(words[:taken], start), _spellings())
        reporter.error("F0103" if found.is_end else "F0102", found.message, found.span, found.hint)
        return None
    if _depth(tree) > _DEEPEST:
        message = f"expected operators in one another up to {_DEEPEST} deep, got more"
        reporter.error("F0104", message, span_of(words[0]), "give parts of it monitors of their own")
        return None
    return tree


def _fitting(words: list[Token], start: str) -> frozenset[str]:
    """Give the kinds of words that fit after these; the parser that failed has forgotten some of them."""
    parser = _grammar().parse_interactive("", start=start)
    for word in words:
        parser.feed_token(word)
    return frozenset(parser.accepts())  # type: ignore[no-untyped-call]  # lark's


def _depth(tree: Tree[Any]) -> int:
    deepest, waiting = 0, [(tree, 1)]
    while waiting:  # what reads the tree calls itself, so this must not
        node, depth = waiting.pop()
        deepest = max(deepest, depth)
        waiting += [(child, depth + 1) for child in node.children if isinstance(child, Tree)]
    return deepest
