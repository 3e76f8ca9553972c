"""The parser takes any text: it reads it, or says what is wrong with it."""

import random
from importlib.resources import files

import pytest
from lark import Lark

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl
from dyknow.kpl.model import ConstraintKind, GeneratorDeclaration
from dyknow.kpl.parser import parse_kpl, parse_type
from dyknow.kpl.policies import parse_policy
from tests.cases import for_each
from tests.dyknow.kpl.test_printer import EVERY_FORM

WORDS = [*EVERY_FORM.replace(";", " ; ").replace(",", " , ").replace("[", " [ ").split(), "@", "é", "#", "\n", "5"]


@pytest.mark.long
@for_each("seed", range(300))
def test_any_text_is_read_or_refused_with_a_place_inside_it(seed: int) -> None:
    rng = random.Random(seed)
    words = EVERY_FORM.split(" ")
    for _ in range(rng.randrange(1, 6)):
        at = rng.randrange(len(words))
        words[at : at + rng.randrange(3)] = [rng.choice(WORDS) for _ in range(rng.randrange(3))]
    text = " ".join(words)
    with pytest.raises(KplError) as caught:  # also because its labels lead nowhere
        check_kpl(text)
    lines = text.split("\n")
    for found in caught.value.diagnostics:
        assert found.source_line == lines[found.line - 1]
        assert 1 <= found.column < found.end_column <= len(found.source_line) + 2


def test_comma_of_a_policy_is_told_from_that_of_arguments() -> None:
    text = (
        "strmgen d = f(a with any update, # all\n // of it\n strict order, b, any_c with max delay 1s, d with to oo);"
    )
    [statement] = parse_kpl(text).statements
    assert isinstance(statement, GeneratorDeclaration)
    read = [(str(term.label), [constraint.kind for constraint in term.constraints]) for term in statement.inputs]
    assert read == [
        ("a", [ConstraintKind.ANY_UPDATE, ConstraintKind.STRICT_ORDER]),
        ("b", []),
        ("any_c", [ConstraintKind.MAX_DELAY]),
        ("d", [ConstraintKind.TO]),
    ]


def test_the_grammar_reads_a_whole_file_as_it_does_statements_one_by_one() -> None:
    grammar = Lark(
        files("dyknow.kpl").joinpath("kpl.lark").read_text("utf-8"), parser="lalr", lexer="basic",
        start="file",
    )  # fmt: skip
    assert len(grammar.parse(EVERY_FORM).children) == len(parse_kpl(EVERY_FORM).statements)


def test_statement_word_starts_a_statement_only_at_the_start_of_a_line() -> None:
    with pytest.raises(KplError) as caught:
        parse_kpl("strmgen a = b\nstrmgen c = sort;\nstrmgen d = e")
    assert [(found.line, found.code) for found in caught.value.diagnostics] == [
        (1, "K0103"),
        (2, "K0102"),
        (3, "K0103"),
    ]


def test_empty_text_declares_nothing() -> None:
    assert parse_kpl(" # nothing\n").statements == ()


def test_statement_with_a_strange_character_is_reported_once() -> None:
    with pytest.raises(KplError) as caught:
        parse_kpl("strmgen a = b{c}{d};\nstrmgen e = ;")
    assert [(found.code, found.line, found.column) for found in caught.value.diagnostics] == [
        ("K0101", 1, 14),
        ("K0101", 1, 16),
        ("K0102", 2, 13),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a constraint such as 'strict order', got the end of the statement"),
        ("any update,", "expected a constraint such as 'strict order' after ',', got the end of the statement"),
        ("any update;", "expected ',' or the end after 'update', got ';'"),
        ("any update, any change", "expected one constraint of each kind, got 'any change' besides 'any update'"),
    ],
)
def test_policy_that_stands_alone_is_checked(text: str, message: str) -> None:
    with pytest.raises(KplError) as caught:
        parse_policy(text)
    assert [found.message for found in caught.value.diagnostics] == [message]


@pytest.mark.parametrize("text", ["", "<float", "float; sort X = int", "set(@)"])
def test_type_that_stands_alone_must_be_one(text: str) -> None:
    with pytest.raises(KplError):
        parse_type(text)
