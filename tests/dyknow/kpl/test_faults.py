"""Every error: its code, its place, its words, and that the mended text is accepted."""

import re
from functools import cache
from importlib.resources import files

import pytest
from lark import Lark

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl
from dyknow.language.diagnostics import Diagnostic
from tests.cases import for_each
from tests.dyknow.kpl.faults_of_meaning import MEANING
from tests.dyknow.kpl.faults_of_words import HEAD, WORDS, Fault

FAULTS = WORDS | MEANING


@cache
def terminals() -> set[str]:
    grammar = Lark(files("dyknow.kpl").joinpath("kpl.lark").read_text("utf-8"), parser="lalr", start="file")
    return {terminal.name for terminal in grammar.terminals}


def errors_of(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(KplError) as caught:
        check_kpl(text)
    return caught.value.diagnostics


def place_of(marked: str) -> tuple[str, int, int, int]:
    """Take the marks out of a text; return it with line, first column and column behind of what was marked."""
    before, inside, behind = re.split("«|»", HEAD + marked)
    line = before.count("\n") + 1
    column = len(before) - (before.rfind("\n") + 1) + 1
    return before + inside + behind, line, column, column + len(inside)


@for_each("fault", FAULTS)
def test_error_has_code_place_words_and_hint(fault: Fault) -> None:
    text, *place = place_of(fault.bad)
    [found] = errors_of(text)
    assert (found.code, found.message, found.hint) == (fault.code, fault.message, fault.hint)
    assert [found.line, found.column, found.end_column] == place


@for_each("fault", FAULTS)
def test_mended_text_is_accepted(fault: Fault) -> None:
    check_kpl(HEAD + fault.good)


@for_each("fault", FAULTS)
def test_no_name_of_a_terminal_leaks(fault: Fault) -> None:
    for found in errors_of(place_of(fault.bad)[0]):
        assert not terminals() & set(re.findall(r"\w+", found.message + found.hint))


def test_all_errors_of_a_text_come_in_one_go_in_the_order_of_their_places() -> None:
    text = """source Pont gps;
compunit float speed(float;
strmgen pos = gps;
strmgen fast = speed(poss);
stream a = fast with sample every 1s;
strem b = fast;
stream c = pos with strict order, max delay 5;
"""
    assert [(found.code, found.line) for found in errors_of(text)] == [
        ("K0202", 1),
        ("K0102", 2),
        ("K0202", 4),
        ("K0404", 5),
        ("K0102", 6),
        ("K0104", 7),
    ]


def test_what_a_malformed_statement_may_have_declared_is_not_called_unknown() -> None:
    [found] = errors_of("source float gps\nstrmgen pos = gps;\nstream a = pos;")
    assert (found.code, found.line) == ("K0103", 1)


def test_each_cycle_is_reported_once() -> None:
    text = """compunit float f(float, float); strmgen a = f(a, b); strmgen b = f(c, c); strmgen c = f(b, a);
    strmgen d = f(a, d);"""
    assert [found.message.partition("got ")[2] for found in errors_of(text)] == [
        "the cycle a -> a",
        "the cycle a -> c -> b -> a",
        "the cycle b -> c -> b",
        "the cycle d -> d",
    ]


def test_message_shows_the_line_with_a_caret_under_the_place() -> None:
    with pytest.raises(KplError) as caught:
        check_kpl("source float gps;\nstream seen = gps with max delay 1s;", name="traffic.kpl")
    assert str(caught.value) == (
        "error[K0202]: expected a declared label, got 'gps'\n"
        " --> traffic.kpl:2:15\n"
        "  |\n"
        "2 | stream seen = gps with max delay 1s;\n"
        "  |               ^^^\n"
        "  = help: that is host code; 'strmgen' gives its stream a label"
    )


def test_label_that_nobody_reads_is_a_warning() -> None:
    [found] = check_kpl("source float gps;\nstrmgen pos = gps;\nstrmgen read = gps;\nstream a = read;").warnings
    assert found.render().startswith("warning[K0601]: label 'pos' is read by no unit and no stream\n")
    assert (found.line, found.column) == (2, 9)
