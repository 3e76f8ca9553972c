"""How are words read by the tables of a grammar? In pieces, each by one loop that builds at every finished rule.

When a word does not fit, the loop tells what would have: one malformed place does not hide what is wrong elsewhere.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple  # Any: the values on the stack are words, and whatever was built

from dyknow.language.diagnostics import Hint, Related
from dyknow.language.grammar import END, Grammar, Reduction
from dyknow.language.places import Span
from dyknow.language.wording import Misfit
from dyknow.language.words import Source, Word

Parts = list[Any]
Build = Mapping[str, Callable[[Parts, Span], Any]]  # for each rule, what makes something of its parts and its place


class Node(NamedTuple):
    """What a rule is built of, for languages that read it from the outside in."""

    rule: str
    parts: Parts
    span: Span


class _Nodes(dict[str, Callable[[Parts, Span], Any]]):
    """The simplest `Build`: nodes of every rule."""

    def __missing__(self, rule: str) -> Callable[[Parts, Span], Any]:
        made = self[rule] = partial(Node, rule)
        return made


_NODES = _Nodes()


def cut(words: Iterable[Word], is_start: Callable[[Word, Word], bool]) -> Iterator[list[Word]]:
    """Cut words into pieces: before each word that, with the one before it, says so."""
    piece: list[Word] = []
    for word in words:
        if piece and is_start(piece[-1], word):
            yield piece
            piece = []
        piece.append(word)
    if piece:
        yield piece


class Reading:
    """One run of the tables over words.

    Attributes
    ----------
    tree : what was built; only where all words fit.
    failed_at : index of the word that did not fit, the number of words at the end; None if all fit.
    statement_at : index where the last state of `statements` was left, 0 if none was.

    Parameters
    ----------
    start : the rule that the words are to be.
    statements : states that are noted; see `Grammar.where`.
    """

    def __init__(
        self,
        grammar: Grammar,
        start: str,
        words: Sequence[Word],
        file: str,
        *,
        build: Build = _NODES,
        statements: frozenset[int] = frozenset(),
    ) -> None:
        self._grammar, self._start, self._words, self._file = grammar, start, words, file
        self.tree: Any = None
        self.failed_at: int | None = None
        self.statement_at = 0
        self._run(build, statements)

    def misfit(self, at: int) -> Misfit:
        """Say what would have fitted in place of a word; all words before it do fit."""
        # They are gone through once more: a run that has seen a misfit may have closed rules that took other words.
        rows, after = self._grammar.rows, self._grammar.after
        states = [self._grammar.starts[self._start]]
        for word in self._words[:at]:
            while isinstance(action := rows[states[-1]][word.kind], Reduction):
                del states[len(states) - action.count :]
                states.append(after[states[-1]][action.origin])
            states.append(action)
        return Misfit(self._words, at, self._grammar.expected(states))

    def _run(self, build: Build, statements: frozenset[int]) -> None:
        rows, after, ends, words = self._grammar.rows, self._grammar.after, self._grammar.ends, self._words
        state = self._grammar.starts[self._start]
        states, values = [state], list[Any]()
        firsts: list[int] = []  # index of the first word of each value
        for index, word in enumerate((*words, Word(END, "", 1, 1, 1))):
            kind = word.kind
            while (action := rows[state].get(kind)) is not None:
                if isinstance(action, int):
                    if state in statements:
                        self.statement_at = index
                    state = action
                    states.append(state)
                    values.append(word)
                    firsts.append(index)
                    break
                kept = len(values) - action.count
                first = firsts[kept] if action.count else index
                parts = action.select(values[kept:])
                del states[kept + 1 :], values[kept:], firsts[kept + 1 :]
                if action.is_transparent and len(parts) == 1:
                    values += parts
                elif action.builder:
                    start, end = words[first], words[index - 1]
                    span = Span(self._file, start.line, start.column, end.line, end.end_column)
                    values.append(build[action.builder](parts, span))
                else:
                    values.append(parts)
                state = after[states[-1]][action.origin]
                states.append(state)
                if kind == END and state in ends:
                    self.tree = values[-1]
                    return
            else:
                self.failed_at = index
                return
        raise AssertionError("the end of the words either fits or does not")


def report(source: Source, misfit: Misfit, message: str, hint: str | Hint) -> None:
    """Report a word that does not fit, or an end that comes too early and where that began which is not closed."""
    words, at = misfit.words, min(misfit.index, len(misfit.words) - 1)
    place = words[at].span(source.file) if words else Span(source.file, 1, 1, 1, 2)
    related: Related = ()
    if misfit.is_end and words and words[0].line != words[-1].line:
        related = [(words[0].span(source.file), "starts here")]
    code = f"{source.letter}0103" if misfit.is_end else f"{source.letter}0102"
    source.reporter.error(code, message, place, hint, related=related)
