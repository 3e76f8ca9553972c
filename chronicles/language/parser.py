"""What tree does a chronicle text have, and where is it malformed?

The text is cut at the words that start a declaration. When a word does not fit, the statement around it is reported and
left out and the piece is read again: at most one syntax error a statement, and the rest of the text is still checked.
"""

import re
from functools import cache

from chronicles.language.model import ChronicleFile, Declaration
from chronicles.language.syntax_errors import (
    DECLARATION_WORDS,
    EXAMPLE_WORDS,
    STATEMENT_WORDS,
    WORDS_WITH_PARENTHESIS,
    describe_misfit,
    starts_statement,
)
from chronicles.language.tree_builder import Methods, TreeBuilder
from dyknow.language.diagnostics import Hint, Reporter
from dyknow.language.grammar import END, Grammar, load_grammar
from dyknow.language.reading import Reading, cut, report
from dyknow.language.wording import Misfit
from dyknow.language.words import COMMENT, STRANGE, Source, Strange, Word, read_words

_DECLARATION_KINDS = frozenset(word.upper() for word in DECLARATION_WORDS)
_STATEMENT_KINDS = frozenset(word.upper() for word in (*STATEMENT_WORDS, *EXAMPLE_WORDS, "emit", "report")) | {"RBRACE"}
_WITH_PARENTHESIS = frozenset(word.upper() for word in WORDS_WITH_PARENTHESIS)
_LINE_STARTS = frozenset({"TIME_POINT", "VARIABLE", "DURATION", "NUMBER"})  # constraints, and events of an example
_CONTINUES_AFTER = frozenset({"COMMA", "LPAR", "OPENING", "CLOSING", "COLON", "POSITIVE", "NEGATIVE", "IN", "RANGE"})
_SINGLE_QUOTED = re.compile(r"'[^'\n]*'")
_OTHER_COMMENT = re.compile(r"/\*(.*?\*/)?", re.DOTALL)


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
    words = [word for word in words_and_comments(text, name, reporter) if word.kind not in (COMMENT, STRANGE)]
    source, build = Source(name, "C", reporter), Methods(TreeBuilder(name, reporter))
    pieces = list(cut(words, lambda _, word: word.kind in _DECLARATION_KINDS))
    # The unit of bare numbers holds for the whole text, wherever it stands.
    order = sorted(range(len(pieces)), key=lambda index: pieces[index][0].kind != "TIMEUNIT")
    built = {index: _read(pieces[index], source, build) for index in order}
    found = [built[index] for index in range(len(pieces))]
    return ChronicleFile(name, tuple(one for one in found if one is not None))


def words_and_comments(text: str, name: str, reporter: Reporter) -> list[Word]:
    """Cut a text into words and comments, in the order of the text; characters that no word has go to the reporter."""
    return read_words(text, Source(name, "C", reporter), grammar(), _explained)


def grammar() -> Grammar:
    """Load the grammar of chronicles."""
    return load_grammar("chronicles.language", "chronicle.lark", "declaration")


@cache
def _statement_states() -> frozenset[int]:
    return grammar().where(starts_statement)


def _explained(text: str, at: int, before: str) -> Strange:
    """Say what characters that no word has may be: one character if nothing is clear."""
    if text[at] == '"':  # a text without its second quote, to the end of the line
        return Strange(text[at:].split("\n", 1)[0], Hint('texts start and end with " on one line'), "STRING")
    if found := _SINGLE_QUOTED.match(text, at):
        inner = found.group()[1:-1]
        edit = None if '"' in inner or "\\" in inner else f'"{inner}"'
        hint = Hint("texts stand in double quotes" + (f": {edit}" if edit else ""), edit)
        return Strange(found.group(), hint, "STRING", marked=len(found.group()))
    if found := _OTHER_COMMENT.match(text, at):
        hint = Hint("comments start with # and end with their line")
        return Strange(found.group(), hint, COMMENT, came=repr(found.group()[:2]), marked=2)
    if text[at] == "*" and before == "COMMA":
        return Strange("*", Hint("no bound is written oo", "oo"), "INFINITE")
    return Strange(text[at], Hint("leave it out"))


def _read(words: list[Word], source: Source, build: Methods) -> Declaration | None:
    """Build the declaration that words are, leaving out what is malformed; None if nothing of it can be read."""
    end_reported = False
    while words:
        reading = Reading(grammar(), "declaration", words, source.file, build=build, statements=_statement_states())
        if reading.failed_at is None:
            tree: Declaration = reading.tree
            return tree
        misfit = reading.misfit(_blamed(reading, words))
        if not (misfit.is_end and end_reported):
            report(source, misfit, *describe_misfit(misfit))
        end_reported = end_reported or misfit.is_end
        words = _mended(misfit, reading.statement_at, words)
    return None


def _blamed(reading: Reading, words: list[Word]) -> int:
    """Give which word is one too many: the name that starts a statement and is no bound of a chain, not the next."""
    at = reading.failed_at or 0
    return at - 1 if at and reading.statement_at == at - 1 and words[at - 1].kind == "NAME" else at


def _mended(misfit: Misfit, statement_at: int, words: list[Word]) -> list[Word]:
    """Leave out what was just reported; the result is shorter, or closed by a brace."""
    at, expected = misfit.index, misfit.expected
    if END in expected:
        return words[:at]
    if words[0].kind not in ("CHRONICLE", "EXAMPLE"):
        return []
    opening = next((index for index, word in enumerate(words) if word.kind == "LBRACE"), len(words))
    if at <= opening:
        return _with_plain_head(misfit, words, opening)
    if at == len(words):
        kept = words if "RBRACE" in expected else words[:statement_at]
        return [*kept, _with_kind(words[-1], "RBRACE", "}")]
    start = at if starts_statement(expected) else statement_at
    return words[:start] + words[_next_statement(words, start, at) :]


def _with_plain_head(misfit: Misfit, words: list[Word], opening: int) -> list[Word]:
    """Keep the body of a chronicle or example whose head is broken, so that the body is checked too."""
    at = misfit.index
    if "LBRACE" in misfit.expected and at < len(words) and words[at].kind in _STATEMENT_KINDS:
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
