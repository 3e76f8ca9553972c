"""How is a chronicle text laid out?

There is one layout: a statement a line, two spaces of indent, at most 120 characters a line where a comma allows it.
Words stay as they are written, so `1000ms` stays `1000ms`; only semicolons that nothing needs are dropped. Comments
stay where they stand between the words, behind a line or on a line of their own. At most one blank line is kept.

The layout depends on the words, on where comments stand between them, and on blank lines between statements. All of
these are the same in the result, so formatting it again changes nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from chronicles.errors import ChronicleError
from chronicles.language import model
from chronicles.language.parser import parse, words_and_comments
from chronicles.language.syntax_errors import DECLARATION_WORDS
from dyknow.language.diagnostics import Reporter
from dyknow.language.words import COMMENT, Word

_WIDTH = 120
_INDENT = "  "
_CONTINUED = _INDENT * 2
_BETWEEN_ITEMS = "  "
_DECLARATIONS = frozenset(word.upper() for word in DECLARATION_WORDS)
_ITEM_WORDS = frozenset({"WHEN", "VALUE", "DEFAULT", "UNTIL", "EXPECT"})
_SIGNS = frozenset({"POSITIVE", "NEGATIVE"})


def format_text(text: str, name: str = "<text>") -> str:
    """Lay out a chronicle text.

    Parameters
    ----------
    text : the whole text.
    name : what messages call it.

    Raises
    ------
    ChronicleError
        With all diagnostics, if the syntax of the text has an error.

    Examples
    --------
    >>> print(format_text('''message m[ ?a ]{?a in {x,y}} // ours
    ... chronicle c{event(m[?], t1) // now
    ...   t1-t0 in [-3s ,10s] ; }'''), end="")
    message m[?a] { ?a in {x, y} }  // ours
    chronicle c {
      event(m[?], t1)  // now
      t1 - t0 in [-3s, 10s]
    }
    """
    reporter = Reporter({name: text})
    file = parse(text, name, reporter)
    if reporter.errors:
        raise ChronicleError.from_diagnostics(reporter.diagnostics)
    words = _without_needless_ends(words_and_comments(text, name, reporter))
    return "".join(line + "\n" for line in _Layout(words, file).lines())


def _without_needless_ends(words: Sequence[Word]) -> list[Word]:
    """Leave out semicolons but those without which a sign would read as the offset of the time point before."""
    spoken = [word for word in words if word.kind != COMMENT]
    needed = {
        (end.line, end.column)
        for before, end, after in zip(spoken, spoken[1:], spoken[2:], strict=False)
        if end.kind == "_END" and before.kind == "TIME_POINT" and after.kind in _SIGNS
    }
    return [word for word in words if word.kind != "_END" or (word.line, word.column) in needed]


def _statement_places(file: model.ChronicleFile) -> frozenset[tuple[int, int]]:
    """Give line and column of each statement, action and item of a declaration."""
    parts = ("statements", "actions", "domains", "events")
    found = [item for one in file.declarations for part in parts for item in getattr(one, part, ())]
    return frozenset((one.span.line, one.span.column) for one in found)


def _blocks(words: Sequence[Word]) -> dict[int, int]:
    """Give for each brace around a body the index of its partner; the braces of `{a, b}` are left out."""
    pairs: dict[int, int] = {}
    open_at: list[tuple[int, bool]] = []
    before = ""
    for index, word in enumerate(words):
        if word.kind == "LBRACE":
            open_at.append((index, before not in ("EQUAL", "IN", "VBAR", "TILDE", "LPAR")))
        elif word.kind == "RBRACE":
            start, is_body = open_at.pop()
            if is_body:
                pairs |= {start: index, index: start}
        if word.kind != COMMENT:
            before = word.kind
    return pairs


@dataclass(slots=True)
class _Line:
    """The words, by index, that stand on one line if they fit and no comment interrupts them."""

    depth: int
    is_after_blank: bool
    indices: list[int] = field(default_factory=list)


class _Layout:
    """Lays out the words of one text.

    `_starts` are the indices of words with which a line starts; `_gaps` what is written before each other word.
    """

    def __init__(self, words: Sequence[Word], file: model.ChronicleFile) -> None:
        self._words = words
        self._blocks = _blocks(words)
        self._gaps = gaps(words)
        places = _statement_places(file)
        self._starts = {index for index, word in enumerate(words) if self._may_start(index, word, places)}
        self._flatten()
        for index in reversed(range(len(words))):
            if words[index].kind == COMMENT and self._stands_alone(index):
                self._starts.add(index)

    def _may_start(self, index: int, word: Word, places: frozenset[tuple[int, int]]) -> bool:
        if word.kind in _DECLARATIONS or word.kind in _ITEM_WORDS or (word.line, word.column) in places:
            return True
        return word.kind == "RBRACE" and index in self._blocks and self._blocks[index] != index - 1

    def _stands_alone(self, index: int) -> bool:
        """Say whether a comment is behind no word and interrupts no statement."""
        return not self._is_behind(index) and (index + 1 == len(self._words) or index + 1 in self._starts)

    def _flatten(self) -> None:
        """Put bodies of attributes and messages, and single actions, on one line where they fit and have no comment."""
        head = 0
        for index in range(len(self._words)):
            head = index if index in self._starts else head
            end = self._blocks.get(index, -1)
            if end > index + 1 and all(self._words[one].kind != COMMENT for one in range(head, end)):
                items = [one for one in range(index + 1, end) if one in self._starts]
                kind = self._words[head].kind
                if kind in ("ATTRIBUTE", "MESSAGE") or (kind == "WHEN" and len(items) == 1):
                    self._flatten_body(head, items, end)

    def _flatten_body(self, head: int, items: Sequence[int], end: int) -> None:
        gaps_inside = dict.fromkeys(items[1:], _BETWEEN_ITEMS) | {items[0]: " ", end: " "}
        indent = _INDENT if self._words[head].kind == "WHEN" else ""
        width = sum(len(gaps_inside.get(one, self._gaps[one])) for one in range(head + 1, end + 1))
        width += len(indent) + sum(len(self._words[one].text) for one in range(head, end + 1))
        if width <= _WIDTH:
            self._gaps |= gaps_inside
            self._starts -= {*items, end}
            del self._blocks[self._blocks.pop(end)]

    def lines(self) -> Iterator[str]:
        """Give the lines of the result."""
        for line in self._logical_lines():
            if line.is_after_blank:
                yield ""
            yield from self._physical_lines(line)

    def _logical_lines(self) -> list[_Line]:
        lines: list[_Line] = []
        depth = 0
        for index, word in enumerate(self._words):
            closes = word.kind == "RBRACE" and index in self._blocks
            depth -= closes
            if index in self._starts or not lines:
                is_apart = bool(lines) and word.line > self._words[index - 1].line + 1
                lines.append(_Line(depth, is_apart and not closes and not self._opens_block(lines[-1])))
            lines[-1].indices.append(index)
            depth += word.kind == "LBRACE" and index in self._blocks
        return lines

    def _opens_block(self, line: _Line) -> bool:
        """Say whether a line ends with the brace before a body; a comment may be behind it."""
        spoken = [index for index in line.indices if self._words[index].kind != COMMENT]
        return bool(spoken) and self._words[spoken[-1]].kind == "LBRACE"

    def _physical_lines(self, line: _Line) -> Iterator[str]:
        """Break a line after comments, and where it is too long after commas."""
        indent = _INDENT * line.depth
        current = ""
        for segment in self._segments(line.indices):
            text = "".join(self._written(index) for index in segment)
            is_comment = self._words[segment[0]].kind == COMMENT
            if is_comment and current and self._is_behind(segment[0]):
                current += "  " + text
            elif not current:
                current = indent + text.lstrip()
            elif is_comment or len(current) + len(text) > _WIDTH:
                yield current
                indent = _INDENT * line.depth + _CONTINUED
                current = indent + text.lstrip()
            else:
                current += text
            if is_comment:
                yield current
                indent = _INDENT * line.depth + _CONTINUED
                current = ""
        if current:
            yield current

    def _is_behind(self, index: int) -> bool:
        """Say whether a comment stands on the line of the word before it."""
        return index > 0 and self._words[index - 1].line == self._words[index].line

    def _written(self, index: int) -> str:
        return self._gaps.get(index, "") + self._words[index].text

    def _segments(self, indices: Sequence[int]) -> Iterator[list[int]]:
        """Cut a line where it may be broken: after commas, and around comments."""
        segment: list[int] = []
        for index in indices:
            if self._words[index].kind == COMMENT and segment:
                yield segment
                segment = []
            segment.append(index)
            if self._words[index].kind in ("COMMA", COMMENT):
                yield segment
                segment = []
        if segment:
            yield segment


_BRACKETS = frozenset({"OPENING", "CLOSING"})
_GLUED = frozenset({"COMMA", "RPAR", "COLON", "RANGE", "_END"})  # to the word before
_GLUING = frozenset({"LPAR", "COLON", "RANGE"})  # the word after
_BEFORE_VALUES = frozenset({"COMMA", "EQUAL", "IN", "VBAR", "TILDE"})


def gaps(words: Sequence[Word]) -> dict[int, str]:
    """Give what stands before each word: a space or nothing; nothing before comments and the first word."""
    state = _Spacing()
    found: dict[int, str] = {}
    for index, word in enumerate(words):
        found[index] = "" if word.kind == COMMENT else state.before(word)
    return found


class _Spacing:
    """Reads words one after the other; remembers what brackets, braces and signs around the place mean."""

    def __init__(self) -> None:
        self._previous = ""
        self._glues = True
        self._in_brackets = False
        self._in_example = False
        self._values_depth = 0

    def before(self, word: Word) -> str:
        """Give what stands before the next word."""
        kind = word.kind
        glued, glues = kind in _GLUED, kind in _GLUING
        if kind in _BRACKETS:
            # ]0s, 3s[ is a range too: the first bracket opens, whichever it is.
            glued = self._in_brackets or self._previous not in _BEFORE_VALUES
            glues = not self._in_brackets
            self._in_brackets = not self._in_brackets
        elif kind == "LPAR":
            glued = self._previous not in _BEFORE_VALUES
        elif kind == "LBRACE":
            glues = self._previous in _BEFORE_VALUES or self._previous == "LPAR"
            self._values_depth += glues
        elif kind == "RBRACE" and self._values_depth:
            glued = True
            self._values_depth -= 1
        elif kind in _SIGNS:
            # After a time point the sign stands between two things, elsewhere it belongs to what follows.
            glues = self._previous != "TIME_POINT"
        elif kind == "EQUAL":
            glued = glues = self._in_example
        elif kind == "EXAMPLE":
            self._in_example = True
        elif kind == "CHRONICLE":
            self._in_example = False
        gap = "" if glued or self._glues else " "
        self._previous, self._glues = kind, glues
        return gap
