"""What tree does a chronicle text have, and where is it malformed?

The words are read once; the text is cut at the words that start a declaration, and each piece is parsed with Lark's
LALR tables. When a word does not fit, the statement around it is reported and left out and the piece is parsed again:
at most one error a statement, and the rest of the text is still checked.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from functools import cache
from importlib.resources import files
from typing import Any  # lark leaves the values of its parse stacks untyped

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedToken
from lark.parsers.lalr_analysis import Shift
from lark.parsers.lalr_parser_state import ParserState

from chronicles.language.diagnostics import Reporter, Span
from chronicles.language.model import ChronicleFile, Declaration
from chronicles.language.syntax_errors import DECLARATION_WORDS, STATEMENT_WORDS, describe_unexpected
from chronicles.language.tree_builder import TreeBuilder

_DECLARATION_KINDS = frozenset(word.upper() for word in DECLARATION_WORDS)
_STATEMENT_KINDS = frozenset(word.upper() for word in (*STATEMENT_WORDS, "emit", "report")) | {"RBRACE"}
_WITH_PARENTHESIS = frozenset({"EVENT", "NOEVENT", "OCCURS", "HOLD", "ASSERT"})
_CONSTRAINT_STARTS = frozenset({"TIME_POINT", "VARIABLE"})
_CONTINUES_AFTER = frozenset({"COMMA", "LPAR", "OPENING", "CLOSING", "COLON", "POSITIVE", "NEGATIVE", "IN"})


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
    words = _read_words(text, name, reporter)
    builder = TreeBuilder(name, reporter)
    trees = [tree for piece in _pieces(words) if (tree := _parse_piece(piece, name, reporter)) is not None]
    # The unit of bare numbers holds for the whole text, wherever it stands.
    trees_first = sorted(trees, key=lambda tree: tree.data != "timeunit")
    built: dict[int, Declaration] = {id(tree): builder.declaration(tree) for tree in trees_first}
    return ChronicleFile(name, tuple(built[id(tree)] for tree in trees))


@cache  # The grammar is a constant that costs 50 ms to load: loaded when the first text is parsed, not on import.
def _grammar() -> Lark:
    text = files("chronicles.language").joinpath("chronicle.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", lexer="basic", start=["declaration", "file"], propagate_positions=True)


def _read_words(text: str, name: str, reporter: Reporter) -> list[Token]:
    words: list[Token] = []
    rest = text
    while True:
        try:
            words = list(_grammar().lex(rest))
        except UnexpectedCharacters as found:
            at = found.pos_in_stream or 0
            bad = rest[at]
            span = Span(name, found.line, found.column, found.line, found.column + 1)
            hint = 'texts start and end with " on one line' if bad == '"' else ""
            reporter.error("C0101", f"expected a word of the language, got the character {bad!r}", span, hint)
            rest = rest[:at] + _without(bad, rest[at:])
        else:
            return words


def _without(bad: str, rest: str) -> str:
    """Blank out a bad character wherever it comes again, since each would say the same; keep all places."""
    if bad != '"':
        return rest.replace(bad, " ")
    end = rest.find("\n") if "\n" in rest else len(rest)
    return '""' + " " * (end - 2) + rest[max(end, 2) :]


def _pieces(words: Iterable[Token]) -> Iterator[list[Token]]:
    """Cut before each word that starts a declaration: those words are reserved."""
    piece: list[Token] = []
    for word in words:
        if word.type in _DECLARATION_KINDS and piece:
            yield piece
            piece = []
        piece.append(word)
    if piece:
        yield piece


def _parse_piece(words: list[Token], name: str, reporter: Reporter) -> Tree[Any] | None:
    end_reported = False
    while words:
        attempt = _Attempt(words)
        if attempt.tree is not None:
            return attempt.tree
        at_end = attempt.failed_at == len(words)
        if not (at_end and end_reported):
            _report(attempt, words, name, reporter)
        end_reported = end_reported or at_end
        words = _mended(attempt, words)
    return None


class _Attempt:
    """One run of the parser over the words of a declaration.

    `tree` is None when a word did not fit: then `failed_at` is its index (the number of words at the end), `expected`
    the kinds that would have fitted, and `statement_at` the index where the latest statement started, 0 if none did.
    """

    def __init__(self, words: list[Token]) -> None:
        self._state: ParserState[Any] = _grammar().parse_interactive("", start="declaration").parser_state
        self.tree: Tree[Any] | None = None
        self.failed_at = 0
        self.statement_at = 0
        self.expected: frozenset[str] = frozenset()
        self._run(words)

    def _run(self, words: list[Token]) -> None:
        feed = self._state.feed_token
        try:
            for word in words:
                feed(word)
                self.failed_at += 1
            self.tree = feed(Token.new_borrow_pos("$END", "", words[-1]), is_end=True)
        except UnexpectedToken:
            row = self._row(self._state.state_stack[-1])
            self.expected = frozenset(kind for kind in row if _is_word_kind(kind) and self._accepts(kind))
            self.statement_at = self._statement_start(words)

    def _statement_start(self, words: list[Token]) -> int:
        """Run once more, noting each word that was read where a statement may start."""
        state: ParserState[Any] = _grammar().parse_interactive("", start="declaration").parser_state
        start = 0
        for index, word in enumerate(words[: self.failed_at]):
            state.feed_token(word)
            if _starts_statement(self._shifts(state.state_stack[-2])):
                start = index
        return start

    def _accepts(self, kind: str) -> bool:
        """Say whether a word of this kind fits here: the same tables, without building values."""
        stack = list(self._state.state_stack)
        while (action := self._row(stack[-1]).get(kind)) is not None:
            if action[0] is Shift:
                return True
            rule = action[1]
            del stack[len(stack) - len(rule.expansion) :]
            stack.append(self._row(stack[-1])[rule.origin.name][1])
            if kind == "$END" and stack[-1] == self._state.parse_conf.end_state:
                return True
        return False

    def _row(self, state: Any) -> dict[str, tuple[Any, Any]]:  # Any: lark's tables
        row: dict[str, tuple[Any, Any]] = self._state.parse_conf.states[state]
        return row

    def _shifts(self, state: Any) -> set[str]:  # Any: lark's tables
        return {kind for kind in ("EVENT", "NOEVENT", "REPORT") if self._row(state).get(kind, (None,))[0] is Shift}

    @property
    def before_is_complete(self) -> bool:
        """Whether a new statement could have started at the failing word."""
        return _starts_statement(self.expected)


def _starts_statement(kinds: Container[str]) -> bool:
    return ("EVENT" in kinds and "NOEVENT" in kinds) or "REPORT" in kinds


def _is_word_kind(kind: str) -> bool:
    return kind == "$END" or kind.replace("_", "").isupper()


def _report(attempt: _Attempt, words: list[Token], name: str, reporter: Reporter) -> None:
    at = attempt.failed_at
    previous = words[at - 1] if at else None
    if at < len(words):
        message, hint = describe_unexpected(words[at], attempt.expected, previous)
        reporter.error("C0102", message, _span(words[at], name), hint)
    else:
        message, _ = describe_unexpected(Token("$END", ""), attempt.expected, previous)
        hint = f"the {words[0]} that starts in line {words[0].line} is not closed"
        reporter.error("C0103", message, _span(words[-1], name), hint)


def _mended(attempt: _Attempt, words: list[Token]) -> list[Token]:
    """Leave out what was just reported; the result is shorter, or closed by a brace."""
    at = attempt.failed_at
    if "$END" in attempt.expected:
        return words[:at]
    if words[0].type != "CHRONICLE":
        return []
    opening = next((index for index, word in enumerate(words) if word.type == "LBRACE"), len(words))
    if at <= opening:
        return _with_plain_head(attempt, words, opening)
    if at == len(words):
        kept = words if "RBRACE" in attempt.expected else words[: attempt.statement_at]
        return [*kept, Token.new_borrow_pos("RBRACE", "}", words[-1])]
    start = at if attempt.before_is_complete else attempt.statement_at
    return words[:start] + words[_next_statement(words, start, at) :]


def _with_plain_head(attempt: _Attempt, words: list[Token], opening: int) -> list[Token]:
    """Keep the body of a chronicle whose head is broken, so that the body is checked too."""
    at = attempt.failed_at
    if "LBRACE" in attempt.expected and at < len(words) and words[at].type in _STATEMENT_KINDS:
        return [*words[:at], Token.new_borrow_pos("LBRACE", "{", words[at]), *words[at:]]
    if opening == len(words):
        return []
    named = len(words) > 1 and words[1].type == "NAME"
    name = words[1] if named else Token.new_borrow_pos("NAME", f"unnamed_{words[0].line}", words[0])
    return [words[0], name, *words[opening:]]


def _next_statement(words: list[Token], start: int, at: int) -> int:
    """Find where reading can go on after the statement that starts at `start` and failed at `at`."""
    depth = 0
    for index in range(start, len(words)):
        kind = words[index].type
        if index > start and index >= at and depth == 0 and _can_start(words, index):
            return index
        depth += (kind == "LBRACE") - (kind == "RBRACE" and depth > 0)
    return len(words)


def _can_start(words: list[Token], index: int) -> bool:
    word, previous = words[index], words[index - 1]
    if word.type in _WITH_PARENTHESIS:  # without one it is a value, or a name
        return index + 1 < len(words) and words[index + 1].type == "LPAR"
    if word.type in _STATEMENT_KINDS or previous.type == "_END":
        return True
    starts_line = previous.line != word.line
    return starts_line and word.type in _CONSTRAINT_STARTS and previous.type not in _CONTINUES_AFTER


def _span(word: Token, name: str) -> Span:
    line, column = word.line or 1, word.column or 1
    return Span(name, line, column, word.end_line or line, word.end_column or column + 1)
