"""What tree does a chronicle text have, and where is it malformed?

The words are read once; the text is cut at the words that start a declaration, and each piece is run through the LALR
tables of the grammar. When a word does not fit, the statement around it is reported and left out and the piece is read
again: at most one syntax error a statement, and the rest of the text is still checked.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any  # the values on the stack are words, and whatever the rules built

from chronicles.language.constraint_hints import rewritten_constraint
from chronicles.language.diagnostics import Reporter, Span
from chronicles.language.grammar import END, Grammar, load_grammar, starts_statement
from chronicles.language.model import ChronicleFile, Declaration
from chronicles.language.syntax_errors import DECLARATION_WORDS, EXAMPLE_WORDS, STATEMENT_WORDS, describe_unexpected
from chronicles.language.tree_builder import TreeBuilder
from chronicles.language.words import Word, read_words

_DECLARATION_KINDS = frozenset(word.upper() for word in DECLARATION_WORDS)
_STATEMENT_KINDS = frozenset(word.upper() for word in (*STATEMENT_WORDS, *EXAMPLE_WORDS, "emit", "report")) | {"RBRACE"}
_WITH_PARENTHESIS = frozenset({"EVENT", "NOEVENT", "OCCURS", "HOLD", "ASSERT"})
_LINE_STARTS = frozenset({"TIME_POINT", "VARIABLE", "DURATION", "NUMBER"})  # constraints, and events of an example
_CONTINUES_AFTER = frozenset({"COMMA", "LPAR", "OPENING", "CLOSING", "COLON", "POSITIVE", "NEGATIVE", "IN", "RANGE"})


def parse(text: str, name: str, reporter: Reporter) -> ChronicleFile:
    """Read a chronicle text; what is malformed goes to the reporter and is left out of the tree.

    Parameters
    ----------
    text : the whole text.
    name : its file name or label, for messages; the reporter must know it.

    Examples
    --------
    >>> text = "message honk[?car]"
    >>> parse(text, "a", Reporter({"a": text})).declarations[0].name
    'honk'
    """
    reader = _PieceReader(name, reporter)
    pieces = list(_pieces(read_words(text, name, reporter)))
    # The unit of bare numbers holds for the whole text, wherever it stands.
    order = sorted(range(len(pieces)), key=lambda index: pieces[index][0].kind != "TIMEUNIT")
    built = {index: reader.read(pieces[index]) for index in order}
    found = [built[index] for index in range(len(pieces))]
    return ChronicleFile(name, tuple(one for one in found if one is not None))


def _pieces(words: Iterable[Word]) -> Iterator[list[Word]]:
    """Cut before each word that starts a declaration: those words are reserved."""
    piece: list[Word] = []
    for word in words:
        if word.kind in _DECLARATION_KINDS and piece:
            yield piece
            piece = []
        piece.append(word)
    if piece:
        yield piece


class _PieceReader:
    """Reads the words of one declaration at a time, leaving out what is malformed."""

    def __init__(self, name: str, reporter: Reporter) -> None:
        self._name = name
        self._reporter = reporter
        self._builder = TreeBuilder(name, reporter)
        self._grammar = load_grammar()

    def read(self, words: list[Word]) -> Declaration | None:
        """Build the declaration; None if nothing of it can be read."""
        end_reported = False
        while words:
            attempt = _Attempt(self._grammar, self._builder, self._name)
            if attempt.run(words):
                tree: Declaration = attempt.tree
                return tree
            at_end = attempt.failed_at == len(words)
            if not (at_end and end_reported):
                self._report(attempt, words)
            end_reported = end_reported or at_end
            words = _mended(attempt, words)
        return None

    def _report(self, attempt: _Attempt, words: list[Word]) -> None:
        at = attempt.failed_at
        previous = words[at - 1] if at else None
        if at < len(words):
            message, hint = describe_unexpected(words[at], attempt.expected, previous)
            rewritten = rewritten_constraint(words, at)
            self._reporter.error("C0102", message, self._span(words[at]), rewritten or hint)
        else:
            message, _ = describe_unexpected(_with_kind(words[-1], END, ""), attempt.expected, previous)
            unclosed = f"the {words[0].text} that starts in line {words[0].line} is not closed"
            related = [(self._span(words[0]), "starts here")] if words[0].line != words[-1].line else []
            self._reporter.error("C0103", message, self._span(words[-1]), unclosed, related=related)

    def _span(self, word: Word) -> Span:
        return Span(self._name, word.line, word.column, word.line, word.end_column)


class _Attempt:
    """One run of the tables over the words of a declaration.

    When a word did not fit, `failed_at` is its index (the number of words at the end), `expected` the kinds that would
    have fitted, and `statement_at` the index where the latest statement started, 0 if none did.
    """

    def __init__(self, grammar: Grammar, builder: TreeBuilder, name: str) -> None:
        self._grammar = grammar
        self._builder = builder
        self._name = name
        self._states = [grammar.start]
        self.tree: Any = None
        self.failed_at = 0
        self.statement_at = 0

    def run(self, words: list[Word]) -> bool:
        """Run over all words; give whether they fit."""
        rows, after, starts = self._grammar.rows, self._grammar.after, self._grammar.statement_starts
        states, state = self._states, self._grammar.start
        values: list[Any] = []
        firsts: list[int] = []  # index of the first word of each value
        for index, word in enumerate((*words, _with_kind(words[-1], END, ""))):
            kind = word.kind
            while (action := rows[state].get(kind)) is not None:
                if isinstance(action, int):
                    if state in starts:
                        self.statement_at = index
                    state = action
                    states.append(state)
                    values.append(word)
                    firsts.append(index)
                    break
                kept = len(values) - action.count
                first = firsts[kept]
                parts = action.select(values[kept:])
                del states[kept + 1 :], values[kept:], firsts[kept + 1 :]
                if action.is_transparent and len(parts) == 1:
                    values += parts
                elif action.builder:
                    start, end = words[first], words[index - 1]
                    span = Span(self._name, start.line, start.column, end.line, end.end_column)
                    values.append(getattr(self._builder, action.builder)(parts, span))
                else:
                    values.append(parts)
                state = after[states[-1]][action.origin]
                states.append(state)
                if state == self._grammar.end:
                    self.tree = values[-1]
                    return True
            else:
                self._stop(words, index)
                return False
        raise AssertionError("the end of the words either fits or does not")

    def _stop(self, words: list[Word], index: int) -> None:
        """Note which word did not fit: a name that starts a statement and is no bound of a chain was one too many."""
        self.failed_at = index
        if index and self.statement_at == index - 1 and words[index - 1].kind == "NAME":
            self.failed_at -= 1
            self._states.pop()

    @property
    def expected(self) -> frozenset[str]:
        """The kinds of words that would have fitted."""
        return self._grammar.expected(self._states)

    @property
    def before_is_complete(self) -> bool:
        """Whether a new statement could have started at the failing word."""
        return starts_statement(self.expected)


def _mended(attempt: _Attempt, words: list[Word]) -> list[Word]:
    """Leave out what was just reported; the result is shorter, or closed by a brace."""
    at, expected = attempt.failed_at, attempt.expected
    if END in expected:
        return words[:at]
    if words[0].kind not in ("CHRONICLE", "EXAMPLE"):
        return []
    opening = next((index for index, word in enumerate(words) if word.kind == "LBRACE"), len(words))
    if at <= opening:
        return _with_plain_head(attempt, words, opening)
    if at == len(words):
        kept = words if "RBRACE" in expected else words[: attempt.statement_at]
        return [*kept, _with_kind(words[-1], "RBRACE", "}")]
    start = at if attempt.before_is_complete else attempt.statement_at
    return words[:start] + words[_next_statement(words, start, at) :]


def _with_plain_head(attempt: _Attempt, words: list[Word], opening: int) -> list[Word]:
    """Keep the body of a chronicle or example whose head is broken, so that the body is checked too."""
    at = attempt.failed_at
    if "LBRACE" in attempt.expected and at < len(words) and words[at].kind in _STATEMENT_KINDS:
        return [*words[:at], _with_kind(words[at], "LBRACE", "{"), *words[at:]]
    if opening == len(words):
        return []
    kind, text = ("NAME", "unnamed_{}") if words[0].kind == "CHRONICLE" else ("STRING", '"unnamed {}"')
    named = len(words) > 1 and words[1].kind == kind
    name = words[1] if named else _with_kind(words[0], kind, text.format(words[0].line))
    return [words[0], name, *words[opening:]]


def _next_statement(words: list[Word], start: int, at: int) -> int:
    """Find where reading can go on after the statement that starts at `start` and failed at `at`."""
    depth = 0
    for index in range(start, len(words)):
        kind = words[index].kind
        if index > start and index >= at and depth == 0 and _can_start(words, index):
            return index
        depth += (kind == "LBRACE") - (kind == "RBRACE" and depth > 0)
    return len(words)


def _can_start(words: list[Word], index: int) -> bool:
    word, previous = words[index], words[index - 1]
    if word.kind in _WITH_PARENTHESIS:  # without one it is a value, or a name
        return index + 1 < len(words) and words[index + 1].kind == "LPAR"
    if word.kind in _STATEMENT_KINDS or previous.kind == "_END":
        return True
    if previous.line == word.line or word.kind not in _LINE_STARTS:
        return False
    return words[0].kind == "EXAMPLE" or previous.kind not in _CONTINUES_AFTER


def _with_kind(place: Word, kind: str, text: str) -> Word:
    """Make a word that the text lacks, at the place of another."""
    return place._replace(kind=kind, text=text)
