"""What is left of a text with errors, and texts that other tools write."""

from chronicles.chronicle_set import load
from chronicles.language.model import Chronicle, ChronicleFile
from chronicles.language.parser import parse
from chronicles.language.printer import print_declaration
from dyknow.language.diagnostics import Reporter
from tests.chronicles.support import run, shown


def read(text: str) -> tuple[ChronicleFile, list[tuple[int, int]]]:
    reporter = Reporter({"text": text})
    file = parse(text, "text", reporter)
    return file, [(one.line, one.column) for one in reporter.diagnostics]


def test_statement_with_an_error_is_left_out_and_the_rest_is_kept() -> None:
    file, places = read("chronicle a {\n event(b[], t1)\n event(c[) t2)\n t2 - t1 in [0s, 1s]\n}\nmessage d[]")
    assert places == [(3, 10)]
    assert print_declaration(file.declarations[0]) == "chronicle a() {\n  event(b[], t1)\n  t2 - t1 in [0s, 1s]\n}"
    assert len(file.declarations) == 2


def test_unfinished_statement_does_not_take_the_next_one_with_it() -> None:
    file, places = read("chronicle a { event(b[], t1 event(c[], t2) }")
    assert places == [(1, 29)]
    assert print_declaration(file.declarations[0]) == "chronicle a() {\n  event(c[], t2)\n}"


def test_braces_inside_a_bad_statement_do_not_end_the_chronicle() -> None:
    file, places = read("chronicle a { ?x in {b c} event(d[?x], t1) }")
    assert places == [(1, 24)]
    assert isinstance(file.declarations[0], Chronicle)
    assert len(file.declarations[0].statements) == 1


def test_chronicle_that_is_not_closed_ends_at_the_next_declaration() -> None:
    file, places = read("chronicle a { event(b[], t1)\nchronicle c { event(d[], t1) }")
    assert len(places) == 1
    assert [print_declaration(one).count("event(") for one in file.declarations] == [1, 1]


def test_body_of_a_chronicle_with_a_bad_head_is_still_read() -> None:
    file, places = read("chronicle a[x] { event(b[], t1) evnt(c[], t2) }")
    assert [column for _, column in places] == [13, 33]
    assert isinstance(file.declarations[0], Chronicle)
    assert len(file.declarations[0].statements) == 1


def test_any_prefix_of_a_text_is_read_without_a_crash() -> None:
    text = 'message e[?x] chronicle a[?x](t1) { event(e[?x], t1) ?x in {b} t1 < t2 when recognised { report "c" } }'
    for length in range(len(text)):
        read(text[:length])
        read(text[length:])


def test_text_of_crs_tools_is_recognised() -> None:
    text = """timeunit 1us
chronicle C1[]()
{
    event(A[], t001)
    event(B[], t002)
    t002-t001 in [-5,20]
}"""
    assert shown(run(load(text), "0us B[]\n3us A[]\n17us B[]")) == ["C1[] 0s..3e-06s", "C1[] 3e-06s..1.7e-05s"]


def test_head_may_be_left_out() -> None:
    assert shown(run("chronicle a { event(b, t1) }", "1s b[]")) == ["a[] 1s..1s"]
