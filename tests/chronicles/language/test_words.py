"""Words and tables against Lark's own lexer and parser, which read the same grammar."""

import random
from dataclasses import fields, is_dataclass
from importlib.resources import files

import pytest
from lark import Lark, LarkError, Token

from chronicles.language.parser import parse, words_and_comments
from dyknow.language.diagnostics import Reporter
from dyknow.language.words import COMMENT, STRANGE, Word
from tests.cases import for_each
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.language.texts.everything import EVERYTHING

GRAMMAR = files("chronicles.language").joinpath("chronicle.lark").read_text(encoding="utf-8")


def words_of(text: str, reporter: Reporter) -> list[Word]:
    return [word for word in words_and_comments(text, "t", reporter) if word.kind not in (COMMENT, STRANGE)]


@pytest.fixture(scope="module")
def lark() -> Lark:
    return Lark(GRAMMAR, parser="lalr", lexer="basic", start="file", propagate_positions=True)


def described(token: Token) -> tuple[str, str, int, int, int]:
    assert token.line is not None
    assert token.column is not None
    assert token.end_column is not None
    return token.type, str(token), token.line, token.column, token.end_column


@for_each("seed", range(30))
def test_words_are_those_of_the_grammar(lark: Lark, seed: int) -> None:
    text = CaseMaker(seed).text() if seed else EVERYTHING
    assert [tuple(word) for word in words_of(text, Reporter({"t": text}))] == [
        described(token) for token in lark.lex(text)
    ]


@pytest.mark.long
@for_each("seed", range(150))
def test_what_lark_refuses_is_refused_and_nothing_else(lark: Lark, seed: int) -> None:
    pick = random.Random(seed)
    source = EVERYTHING if seed % 3 else CaseMaker(seed).text()
    words = [word.text for word in words_of(source, Reporter({"t": source}))]
    start = pick.randrange(len(words))
    # A part of a text, with one word left out, doubled or changed for another: mostly wrong, sometimes right.
    words = words[start : start + pick.choice((20, 60, len(words)))] if pick.random() < 0.5 else words
    place = pick.randrange(len(words))
    words[place : place + 1] = pick.choice(([], [words[place]] * 2, [pick.choice(words)], [words[place]]))
    text = " ".join(words)
    reporter = Reporter({"t": text})
    parse(text, "t", reporter)
    is_refused = any(found.code in ("C0101", "C0102", "C0103") for found in reporter.diagnostics)
    try:
        lark.parse(text)
    except LarkError:
        assert is_refused
    else:
        assert not is_refused


@pytest.mark.parametrize("name", ["chronicle", "constant", "event", "pattern", "range"])
def test_places_are_those_of_lark(lark: Lark, name: str) -> None:
    file = parse(EVERYTHING, "t", Reporter({"t": EVERYTHING}))
    written = repr_places(file)
    for tree in lark.parse(EVERYTHING).find_data(name):
        meta = tree.meta
        assert (meta.line, meta.column, meta.end_line, meta.end_column) in written


def repr_places(node: object) -> set[tuple[int, int, int, int]]:
    """Collect the places of all nodes below one."""
    found: set[tuple[int, int, int, int]] = set()
    span = getattr(node, "span", None)
    if span is not None:
        found.add(tuple(span[1:]))
    for field in fields(node) if is_dataclass(node) else ():
        value = getattr(node, field.name)
        if field.name not in ("span", "name_span"):
            for part in value if isinstance(value, tuple) else (value,):
                found |= repr_places(part)
    return found


def test_comments_are_kept_apart_with_their_places() -> None:
    text = "message a[] # one\n  // two"
    words = words_and_comments(text, "t", Reporter({"t": text}))
    assert [tuple(word)[1:] for word in words if word.kind == COMMENT] == [("# one", 1, 13, 18), ("// two", 2, 3, 9)]


def test_each_strange_character_is_reported_once_and_the_rest_is_read() -> None:
    text = "message @a[] @ $\nmessage b[]"
    reporter = Reporter({"t": text})
    assert [word.text for word in words_of(text, reporter) if word.kind == "NAME"] == ["a", "b"]
    assert [(one.code, one.column) for one in reporter.diagnostics] == [("C0101", 9), ("C0101", 16)]


def test_lines_end_as_on_any_system() -> None:
    text = "message a[]\r\nmessage [\r\n"
    reporter = Reporter({"t": text})
    parse(text, "t", reporter)
    assert [(one.line, one.source_line) for one in reporter.diagnostics] == [(2, "message [")]


def test_lines_are_counted_in_a_comment_of_another_language() -> None:
    text = "message a[] /* one\n two */ message b[]\nmessage c["
    reporter = Reporter({"t": text})
    words = words_of(text, reporter)
    assert [(one.text, one.line, one.column) for one in words if one.text in "bc"] == [("b", 2, 17), ("c", 3, 9)]
    assert [(one.code, one.line, one.column) for one in reporter.diagnostics] == [("C0101", 1, 13)]


def test_star_is_no_bound_only_behind_a_comma() -> None:
    text = "chronicle c { event(a[], t1) t1 * t1 }"
    reporter = Reporter({"t": text})
    parse(text, "t", reporter)
    assert [one.hint for one in reporter.diagnostics if one.code == "C0101"] == ["leave it out"]
