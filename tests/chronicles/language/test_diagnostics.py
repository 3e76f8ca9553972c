"""Every finding: its code, its place, its words, and that the mended text is accepted."""

import re

import pytest

from chronicles.chronicle_set import check_texts, load, load_texts
from chronicles.errors import ChronicleError
from chronicles.language.diagnostics import Diagnostic
from tests.chronicles.language.faults_of_meaning import MEANING
from tests.chronicles.language.faults_of_words import HEAD, WORDS, Case
from tests.chronicles.language.terminals import TERMINAL_NAMES

CASES = WORDS | MEANING


def place_of(marked: str) -> tuple[str, int, int, int]:
    """Take the marks out of a text; give it with line, column and end column of the marked place."""
    start = marked.index("<<")
    end = marked.index(">>") - 2
    text = marked.replace("<<", "").replace(">>", "")
    line_start = text.rfind("\n", 0, start) + 1
    return text, text.count("\n", 0, start) + 1, start - line_start + 1, end - line_start + 1


def findings(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(ChronicleError) as caught:
        load(text)
    return caught.value.diagnostics


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_finding_has_code_place_and_words(case: Case) -> None:
    text, line, column, end_column = place_of(case.bad)
    [found] = [one for one in findings(text) if one.severity == "error"]
    assert found.code == case.code
    assert case.message in found.message
    assert case.hint in found.hint
    assert (found.line, found.column, found.end_column) == (line, column, end_column)
    assert found.source_line == text.splitlines()[line - 1]


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_mended_text_is_accepted(case: Case) -> None:
    load(case.good)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_no_name_of_a_terminal_leaks(case: Case) -> None:
    words = {word for one in findings(place_of(case.bad)[0]) for word in re.findall(r"\w+", one.message + one.hint)}
    assert not words & TERMINAL_NAMES


def test_contradiction_names_each_constraint_with_its_line() -> None:
    text = place_of(CASES["a contradiction"].bad)[0]
    [found] = findings(text)
    assert "t2 is at least 5s after t1 (line 8)" in found.message
    assert "t3 is at least 5s after t2 (line 9)" in found.message
    assert "t3 is at most 8s after t1 (line 10)" in found.message


def test_all_errors_of_a_text_come_in_one_go() -> None:
    text = """message enter[?car]
chronicle one[?a](t1) {
  evnt(enter[?a], t1)
  event(enter[?a, t1)
  t2 - t1 in [1sec, 5s]
  event(entr[?a], t1)
  hold(enter[?b], (t1, t2))
}
chronicle two[?c](t1) { event(entr[?c], t1) }
message
"""
    found = findings(text)
    assert [(one.code, one.line) for one in found] == [
        ("C0102", 3),
        ("C0102", 4),
        ("C0104", 5),
        ("C0201", 6),
        ("C0102", 7),
        ("C0201", 9),
        ("C0103", 10),
    ]


def test_rendered_finding_has_a_caret_line() -> None:
    with pytest.raises(ChronicleError) as caught:
        load(HEAD + "chronicle one {\n  event(entr[?a], t1)\n}", name="cars.chronicle")
    assert str(caught.value) == (
        "error[C0201]: expected an attribute or a message, got the unknown name 'entr'\n"
        " --> cars.chronicle:8:9\n"
        "  |\n"
        "8 |   event(entr[?a], t1)\n"
        "  |         ^^^^\n"
        "  = help: did you mean 'enter'?"
    )


def test_findings_of_several_texts_name_their_file() -> None:
    found = check_texts(
        [("a", "message enter[?car]"), ("b", "message enter[]"), ("c", "chronicle x { event(y[], t1) }")]
    )
    assert [(one.file, one.code) for one in found] == [("b", "C0203"), ("c", "C0201")]


def test_one_declaration_may_stand_in_several_texts() -> None:
    texts = [("a", "message enter[?car]"), ("b", "message enter[?car] chronicle x { event(enter[?], t1) }")]
    assert load_texts(texts).names == ("x",)


def test_end_that_may_come_before_the_start_is_a_warning() -> None:
    loaded = load("chronicle one(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [-1s, 5s] }")
    [found] = loaded.warnings
    assert (found.code, found.severity, found.hint) == ("C0406", "warning", "add t1 <= t2")
    assert found.message == "the end t2 of 'one' may be before its start t1"
