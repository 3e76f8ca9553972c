"""Reading, writing and reading again gives the same tree."""

from chronicles import library
from chronicles.language.model import ChronicleFile
from chronicles.language.parser import parse
from chronicles.language.printer import print_file
from dyknow.language.diagnostics import Reporter, render_all
from tests.cases import for_each
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.language.texts.everything import EVERYTHING


def read(text: str) -> ChronicleFile:
    reporter = Reporter({"text": text})
    file = parse(text, "text", reporter)
    assert not reporter.diagnostics, render_all(reporter.diagnostics)
    return file


TEXTS = {"everything": EVERYTHING}
TEXTS |= {name: library.text(name) for name in library.names()}
TEXTS |= {"relations": library.relations_text()}
TEXTS |= {f"random {seed}": CaseMaker(seed).text() for seed in range(100)}


@for_each("text", TEXTS)
def test_text_read_written_and_read_is_the_same_tree(text: str) -> None:
    file = read(text)
    assert read(print_file(file)) == file


@for_each("text", TEXTS)
def test_writing_is_a_fixed_point(text: str) -> None:
    once = print_file(read(text))
    assert print_file(read(once)) == once


def test_every_construct_is_written_in_one_form() -> None:
    text = (
        'timeunit 1s chronicle a[ ?x ] ( t1 ){event( b[?x,? ] : ( ?,on ) ,t1);0.5<=t1-t2<oo when recognized{report"x"}}'
    )
    assert print_file(read(text)) == (
        "timeunit 1s\n"
        "chronicle a[?x](t1) {\n"
        "  event(b[?x, ?]:(?, on), t1)\n"
        "  500ms <= t1 - t2 < oo\n"
        "  when recognised {\n"
        '    report "x"\n'
        "  }\n"
        "}\n"
    )


def test_timeunit_holds_for_the_whole_text_wherever_it_stands() -> None:
    before = read("timeunit 1s chronicle a { t1 < t2 + 5 }")
    after = read("chronicle a { t1 < t2 + 5 } timeunit 1s")
    assert before.declarations[1] == after.declarations[0]


def test_durations_are_exact() -> None:
    assert "0.1s" not in print_file(read("chronicle a { t1 < t2 + 0.1s t1 < t2 + 0.000003s }"))
    assert "t1 < t2 + 100ms\n  t1 < t2 + 3us" in print_file(read("chronicle a { t1 < t2 + 0.1s t1 < t2 + 0.000003s }"))
