"""Reading, writing and reading again gives the same tree."""

import pytest

from chronicles import library
from chronicles.language.diagnostics import Reporter, render_all
from chronicles.language.model import ChronicleFile
from chronicles.language.parser import parse
from chronicles.language.printer import print_file
from tests.chronicles.execution.random_cases import CaseMaker

EVERYTHING = """
timeunit 1ms; constant gap = 1.5s  constant place = "Main Street"  constant many = -3
domain Car = symbol ~ {ghost}; domain Level = ([1..5] | {6, 8}) ~ ({2} | {3})
attribute p[?a, ?b] { ?a in Car; ?b in Level; value in {on, "in", "t1"}; default on }  attribute q[]  message m[?a]
chronicle all_of_it[?a, ?b](t0, t1, t2x) {
  event(p[?a, ?]:(?, "in"), t1); event(m[place], t2x)  event(q[]:(x, -3), t3)
  noevent(m[?z], (t1 + 1us, t2x - gap))
  occurs((1, oo), m[?a], (t1, t2x))  occurs(0, 3, m[?a], (t1, t2x))
  hold(p[?a, 4]:?v, (t0, t1 + 1h))  assert(q[]:"a \\"b\\" \\\\c", (t1, t1 + 90min))
  t1 - t0 in [1s, 1s]  t2x - t1 in ]-oo, oo[  t2x - t1 in [-gap, many[  t1 < t2x  t1 <= t2x + 5  t1 = t3 - 0.5us
  t2x >= t1 + gap  t3 > t1;
  -2s < t3 - t1 <= oo;  +1 <= t3 - t1 < 5
  ?a == ?b  ?a != car1  ?b in Car | {x}  allow ?a == ?v
  when recognized { emit event(m[?a], t1 + 1s); emit m[?b] emit m[?b] at t3 report "?a was # here" assert(q[]:on, t1) }
}
chronicle bare {
}
"""


def read(text: str) -> ChronicleFile:
    reporter = Reporter({"text": text})
    file = parse(text, "text", reporter)
    assert not reporter.diagnostics, render_all(reporter.diagnostics)
    return file


TEXTS = {"everything": EVERYTHING.replace("0.5us", "500us")}
TEXTS |= {name: library.text(name) for name in library.names()}
TEXTS |= {"relations": library.relations_text()}
TEXTS |= {f"random {seed}": CaseMaker(seed).text() for seed in range(100)}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS.keys())
def test_text_read_written_and_read_is_the_same_tree(text: str) -> None:
    file = read(text)
    assert read(print_file(file)) == file


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS.keys())
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
