"""Which statements does a KPL text have, and where is it malformed?

The words are read once and cut into statements; each is parsed on its own, so one reading finds one malformed place in
each statement.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files
from typing import Any  # lark leaves the children of a tree untyped

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedToken
from lark.parsers.lalr_interactive_parser import InteractiveParser

from dyknow.kpl import model
from dyknow.kpl.findings import KplError, normalised
from dyknow.kpl.syntax_errors import STATEMENT_WORDS, describe_unexpected, hint_on_character
from dyknow.kpl.tree_builder import TreeBuilder, span_of
from dyknow.language.diagnostics import Reporter, Span

_STATEMENT_KINDS = frozenset(word.upper() for word in STATEMENT_WORDS)


def parse_kpl(text: str, *, name: str = "kpl") -> model.Specification:
    """Read a KPL text.

    Parameters
    ----------
    text : the whole text.
    name : its file name, for messages.

    Returns
    -------
    The statements in their order; whether they mean anything is for `dyknow.kpl.checks` to say.

    Raises
    ------
    KplError
        If the text is malformed; it lists one error for each malformed statement.

    Examples
    --------
    >>> parse_kpl("source float gps; strmgen pos = gps;").statements[1]
    GeneratorDeclaration(label=Label(name=Name(text='pos'), arguments=()), function=Name(text='gps'), inputs=())
    >>> parse_kpl("stream fast = pos with sample evry 100ms;")
    Traceback (most recent call last):
    dyknow.kpl.findings.KplError: error[K0102]: expected 'every' after 'sample', got 'evry'
     --> kpl:1:31
      |
    1 | stream fast = pos with sample evry 100ms;
      |                               ^^^^
      = help: did you mean 'every'?
    """
    reporter = Reporter(normalised(text), name, KplError)
    specification, _ = read_statements(text, reporter)
    reporter.raise_if_any()
    return specification


def read_statements(text: str, reporter: Reporter) -> tuple[model.Specification, frozenset[str]]:
    """Read the statements that are well formed and report the others; see `parse_kpl`.

    Returns
    -------
    The statements, and every name in the malformed ones: those may be what they were to declare.

    Examples
    --------
    >>> text = "source float gps strmgen pos = gps;"
    >>> specification, doubtful = read_statements(text, Reporter(text, "kpl"))
    >>> len(specification.statements), "pos" in doubtful
    (0, True)
    """
    builder = TreeBuilder(reporter)
    statements: list[model.Statement] = []
    doubtful: set[str] = set()
    for piece in _pieces(_read_words(text, reporter)):
        tree = _parse(piece, "statement", reporter)
        if tree is None:
            doubtful.update(str(word) for word in piece if word.isidentifier())
        else:
            statements.append(builder.statement(tree))
    return model.Specification(tuple(statements)), frozenset(doubtful)


def read_constraints(text: str, reporter: Reporter) -> tuple[model.Constraint, ...]:
    """Read the constraints of a policy that stands alone.

    Examples
    --------
    >>> text = "sample every 200ms, max delay oo"
    >>> [(one.kind.value, one.us) for one in read_constraints(text, Reporter(text, "policy"))]
    [('sample every', 200000), ('max delay', None)]
    """
    tree = _parse(_read_words(text, reporter), "policy", reporter)
    return TreeBuilder(reporter).constraints(tree) if tree is not None else ()


def parse_type(text: str, *, name: str = "type") -> model.Type:
    """Read a type that stands alone.

    Raises
    ------
    KplError
        If the text is malformed.

    Examples
    --------
    >>> str(parse_type("set(<float,float>)"))
    'set(<float, float>)'
    """
    reporter = Reporter(normalised(text), name, KplError)
    tree = _parse(_read_words(text, reporter), "type", reporter)
    type_ = TreeBuilder(reporter).type(tree) if tree is not None else None
    reporter.raise_if_any()
    assert type_ is not None
    return type_


@cache  # The grammar is a constant that costs 50 ms to load: loaded when the first text is parsed, not on import.
def _grammar() -> Lark:
    text = files("dyknow.kpl").joinpath("kpl.lark").read_text(encoding="utf-8")
    starts = ["statement", "policy", "type", "file", "strange"]
    return Lark(text, parser="lalr", lexer="basic", start=starts, propagate_positions=True, maybe_placeholders=True)


def _read_words(text: str, reporter: Reporter) -> list[Token]:
    """Cut a text into words; each kind of character that no word has is reported once."""
    words = list(_grammar().lex(normalised(text)))
    strange = {str(word): word for word in reversed(words) if word.type == "STRANGE"}
    for bad, word in strange.items():
        message = f"expected a word of the language, got the character {bad!r}"
        reporter.error("K0101", message, span_of(word), hint_on_character(bad))
    return words


def _pieces(words: Iterable[Token]) -> Iterator[list[Token]]:
    """Cut behind each ';' and before each statement word at the start of a line: there a ';' was forgotten."""
    piece: list[Token] = []
    for word in words:
        if piece and word.type in _STATEMENT_KINDS and (word.line or 0) > (piece[-1].line or 0):
            yield piece
            piece = []
        piece.append(word)
        if word.type == "SEMICOLON":
            yield piece
            piece = []
    if piece:
        yield piece


def _parse(words: list[Token], start: str, reporter: Reporter) -> Tree[Any] | None:
    """Parse words from a start symbol; None if they do not fit or if one is strange, which is reported already."""
    if any(word.type == "STRANGE" for word in words):
        return None
    parser = _grammar().parse_interactive("", start=start)
    end = Token.new_borrow_pos("$END", "", words[-1]) if words else Token("$END", "", 0, 1, 1)
    for count, word in enumerate([*words, end]):
        try:
            tree = parser.feed_token(word)
        except UnexpectedToken:
            _report_misfit(words, count, start, reporter)
            return None
    result: Tree[Any] = tree
    return result


def _report_misfit(words: list[Token], count: int, start: str, reporter: Reporter) -> None:
    """Report that the word behind the first ``count`` ones does not fit.

    Those are fed once more: a parser that has seen a misfit may have closed rules that still took other words.
    """
    parser = _grammar().parse_interactive("", start=start)
    for word in words[:count]:
        parser.feed_token(word)
    fitting = _fitting(parser)
    if count < len(words) and words[count].type == "COMMA" and "COMMA" not in fitting and "POLICY_COMMA" in fitting:
        # The comma is not at fault: what follows does not start a constraint, and nothing else may follow here.
        parser.feed_token(Token.new_borrow_pos("POLICY_COMMA", ",", words[count]))
        fitting, count = _fitting(parser), count + 1
    previous = words[count - 1] if count else None
    found = words[count] if count < len(words) else None
    message, hint = describe_unexpected(found, fitting, previous)
    place = found if found is not None else previous
    span = span_of(place) if place is not None else Span(1, 1, 1, 2)
    reporter.error("K0102" if found is not None else "K0103", message, span, hint)


def _fitting(parser: InteractiveParser) -> frozenset[str]:
    return frozenset(parser.accepts())  # type: ignore[no-untyped-call]  # lark's
