"""Which statements does a KPL text have, and where is it malformed?

The words are read once and cut into statements; each is parsed on its own, so one reading finds one malformed place in
each statement.
"""

from __future__ import annotations

from dyknow.errors import KplError
from dyknow.kpl import model
from dyknow.kpl.syntax_errors import STATEMENT_WORDS, describe_misfit, explain_character
from dyknow.kpl.tree_builder import TreeBuilder
from dyknow.language.diagnostics import Reporter
from dyknow.language.grammar import Grammar, load_grammar
from dyknow.language.reading import Node, Reading, cut, report
from dyknow.language.words import COMMENT, STRANGE, Source, Word, normalised, read_words

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
    dyknow.errors.KplError: error[K0102]: expected 'every' after 'sample', got 'evry'
     --> kpl:1:31
      |
    1 | stream fast = pos with sample evry 100ms;
      |                               ^^^^
      = help: did you mean 'every'?
    """
    specification, _, reporter = open_kpl(text, name)
    reporter.raise_if_any(KplError)
    return specification


def open_kpl(text: str, name: str) -> tuple[model.Specification, frozenset[str], Reporter]:
    """Read the statements that are well formed and report the others; see `parse_kpl`.

    Returns
    -------
    The statements, every name in the malformed ones (those may be what they were to declare), and who has the findings.

    Examples
    --------
    >>> specification, doubtful, reporter = open_kpl("source float gps strmgen pos = gps;", "kpl")
    >>> len(specification.statements), "pos" in doubtful, reporter.error_count
    (0, True, 1)
    """
    source, words = _opened(text, name)
    builder = TreeBuilder(source)
    statements: list[model.Statement] = []
    doubtful: set[str] = set()
    for piece in cut(words, _starts_statement):
        tree = _parse(piece, "statement", source)
        if tree is None:
            doubtful.update(word.text for word in piece if word.text.isidentifier())
        else:
            statements.append(builder.statement(tree))
    return model.Specification(tuple(statements)), frozenset(doubtful), source.reporter


def open_constraints(text: str, name: str) -> tuple[tuple[model.Constraint, ...], Reporter]:
    """Read the constraints of a policy that stands alone.

    Examples
    --------
    >>> constraints, _ = open_constraints("sample every 200ms, max delay oo", "policy")
    >>> [(one.kind.value, one.us) for one in constraints]
    [('sample every', 200000), ('max delay', None)]
    """
    source, words = _opened(text, name)
    tree = _parse(words, "policy", source)
    return TreeBuilder(source).constraints(tree) if tree is not None else (), source.reporter


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
    source, words = _opened(text, name)
    tree = _parse(words, "type", source)
    type_ = TreeBuilder(source).type(tree) if tree is not None else None
    source.reporter.raise_if_any(KplError)
    assert type_ is not None
    return type_


def _grammar() -> Grammar:
    return load_grammar("dyknow.kpl", "kpl.lark", "statement", "policy", "type")


def _opened(text: str, name: str) -> tuple[Source, list[Word]]:
    text = normalised(text)
    source = Source(name, "K", Reporter({name: text}))
    return source, [word for word in read_words(text, source, _grammar(), explain_character) if word.kind != COMMENT]


def _starts_statement(before: Word, word: Word) -> bool:
    """Tell whether a statement begins: behind a ';', and, where one is missing, with its word in a new line."""
    return before.kind == "SEMICOLON" or (word.kind in _STATEMENT_KINDS and word.line > before.line)


def _parse(words: list[Word], start: str, source: Source) -> Node | None:
    """Parse words from a start symbol; None if they do not fit or if one is strange, which is reported already."""
    if any(word.kind == STRANGE for word in words):
        return None
    reading = Reading(_grammar(), start, words, source.file)
    if reading.failed_at is None:
        tree: Node = reading.tree
        return tree
    misfit = reading.misfit(reading.failed_at)
    if misfit.kind() == "COMMA" and "COMMA" not in misfit.expected and "POLICY_COMMA" in misfit.expected:
        # The comma is not at fault: what follows does not start a constraint, and nothing else may follow here.
        words[misfit.index] = words[misfit.index]._replace(kind="POLICY_COMMA")
        misfit = reading.misfit(misfit.index + 1)
    report(source, misfit, *describe_misfit(misfit, _grammar().spellings))
    return None
