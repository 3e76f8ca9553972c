"""Which formulas does a text have, and where is it malformed?

A text of monitors is cut at the word ``monitor``, and each piece is parsed on its own, so that one reading finds one
malformed place in each monitor and everything that is wrong with the meaning of the others.
"""

from collections.abc import Collection, Iterable

from dyknow.errors import FormulaError
from dyknow.language.grammar import Grammar, load_grammar
from dyknow.language.reading import Node, Reading, cut, report
from dyknow.language.words import STRANGE, Source, Word, opened
from dyknow.mtl.formula import Formula, Monitor
from dyknow.mtl.kinds import Signature
from dyknow.mtl.syntax_errors import describe_misfit, explain_character
from dyknow.mtl.tree_builder import TreeBuilder, check_nesting

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
    dyknow.errors.FormulaError: error[F0301]: expected an end that is not before the start 2s, got 1s
     --> formula:1:12
      |
    1 | always[2s, 1s] green
      |            ^^
      |        -- the start
    """
    source, words = _opened(text, name)
    formula = _formula(words, source, signature, variables)
    source.reporter.raise_if_any(FormulaError)
    assert formula is not None
    return formula


def read_formula(words: Iterable[Word], source: Source, *, signature: Signature | None = None) -> Formula | None:
    """Read a formula that stands in a text of another language.

    Parameters
    ----------
    words : of the formula, as the other language has cut them; their kinds do not matter.
    source : of that text; its reporter takes the errors.
    signature : as for `parse_formula`.

    Returns
    -------
    The formula without free variables; None if it is malformed or means nothing.
    """
    errors, grammar = source.reporter.error_count, _grammar()
    own: list[Word] = []
    for word in words:
        found = grammar.pattern.fullmatch(word.text)
        kind = (found.lastgroup if found else None) or ""  # "" fits nowhere
        own.append(word._replace(kind=grammar.keywords.get(word.text, kind)))
    formula = _formula(own, source._replace(letter="F"), signature)
    return formula if source.reporter.error_count == errors else None


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
    source, words = _opened(text, name)
    builder = TreeBuilder(source, signature)
    pieces = cut(words, lambda _, word: word.kind == "MONITOR")
    trees = [_parse(piece, "monitor", source) for piece in pieces]
    monitors = [builder.monitor(tree) for tree in trees if tree is not None]
    source.reporter.raise_if_any(FormulaError)
    return tuple(one for one in monitors if one is not None)


def _formula(
    words: list[Word], source: Source, signature: Signature | None, variables: Collection[str] = ()
) -> Formula | None:
    tree = _parse(words, "formula", source)
    if tree is None:
        return None
    formula = TreeBuilder(source, signature).formula(tree, dict.fromkeys(variables, ""))
    check_nesting(formula, tree, source.reporter)
    return formula


def _grammar() -> Grammar:
    return load_grammar("dyknow.mtl", "formula.lark", "formula", "monitor")


def _opened(text: str, name: str) -> tuple[Source, list[Word]]:
    return opened(text, name, "F", _grammar(), explain_character)


def _parse(words: list[Word], start: str, source: Source) -> Node | None:
    if any(word.kind == STRANGE for word in words):
        return None  # reported; what else is said about such words only follows from it
    reading = Reading(_grammar(), start, words, source.file)
    if reading.failed_at is not None:
        misfit, message, hint = describe_misfit(reading.misfit(reading.failed_at), _grammar().spellings)
        report(source, misfit, message, hint)
        return None
    tree: Node = reading.tree
    if _depth(tree) > _DEEPEST:
        message = f"expected operators in one another up to {_DEEPEST} deep, got more"
        advice = "give parts of it monitors of their own"
        source.reporter.error("F0104", message, words[0].span(source.file), advice)
        return None
    return tree


def _depth(tree: Node) -> int:
    deepest, waiting = 0, [(tree, 1)]
    while waiting:  # what reads the tree calls itself, so this must not
        node, depth = waiting.pop()
        deepest = max(deepest, depth)
        waiting += [(child, depth + 1) for child in node.parts if isinstance(child, Node)]
    return deepest
