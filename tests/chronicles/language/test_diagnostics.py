"""Every finding: its code, its place, its words, and that the mended text is accepted."""

import re

import pytest

from chronicles.chronicle_set import check_texts, load, load_texts
from chronicles.errors import ChronicleError
from dyknow.language.diagnostics import Diagnostic
from tests.cases import for_each
from tests.chronicles.language.texts.doubts import DOUBTS
from tests.chronicles.language.texts.faults_of_examples import EXAMPLES
from tests.chronicles.language.texts.faults_of_meaning import MEANING
from tests.chronicles.language.texts.faults_of_words import HEAD, TWO, WORDS, Case, body
from tests.chronicles.language.texts.places import place_of
from tests.chronicles.language.texts.terminals import TERMINAL_NAMES

CASES = WORDS | EXAMPLES | MEANING


def findings(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(ChronicleError) as caught:
        load(text)
    return caught.value.diagnostics


@for_each("case", CASES)
def test_finding_has_code_place_and_words(case: Case) -> None:
    text, line, column, end_column = place_of(case.bad)
    [found] = [one for one in findings(text) if one.severity == "error"]
    assert found.code == case.code
    assert case.message in found.message
    assert case.hint in found.hint
    assert (found.line, found.column, found.end_column) == (line, column, end_column)
    assert found.source_line == text.splitlines()[line - 1]


@for_each("case", CASES)
def test_mended_text_is_accepted(case: Case) -> None:
    load(case.good)


@for_each("case", CASES)
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


def edited(text: str, found: Diagnostic) -> str:
    assert found.edit is not None
    lines = text.split("\n")
    line = lines[found.line - 1]
    lines[found.line - 1] = line[: found.column - 1] + found.edit + line[found.end_column - 1 :]
    return "\n".join(lines)


def with_edits(cases: dict[str, Case]) -> dict[str, tuple[str, Diagnostic]]:
    marked = {name: place_of(case.bad)[0] for name, case in cases.items()}
    pairs = {name: (text, check_texts([("text", text)])) for name, text in marked.items()}
    return {name: (text, one) for name, (text, found) in pairs.items() for one in found if one.edit is not None}


EDITS = with_edits(CASES | DOUBTS)


@pytest.mark.parametrize(("text", "found"), EDITS.values(), ids=EDITS.keys())
def test_certain_edit_mends_the_finding(text: str, found: Diagnostic) -> None:
    after = [(one.code, one.message) for one in check_texts([("text", edited(text, found))])]
    assert (found.code, found.message) not in after


def test_most_misspelled_names_and_swapped_bounds_have_an_edit() -> None:
    assert len(EDITS) >= 20
    swapped = body(TWO + "-1s <= t1 - t2 <= -5s")
    [found] = findings(swapped)
    assert found.edit == "-5s <= t1 - t2 <= -1s"


def test_related_places_are_shown_between_the_lines() -> None:
    text = "message enter[?car]\nmessage leave[?car]\nmessage enter[]"
    [found] = check_texts([("a", text)])
    assert [tuple(one) for one in found.related] == [("a", 1, 9, 14, "message enter[?car]", "the first")]
    assert found.render() == (
        "error[C0203]: expected one declaration of 'enter', got another one than at a:1\n"
        " --> a:3:9\n"
        "  |\n"
        "1 | message enter[?car]\n"
        "  |         ----- the first\n"
        "...\n"
        "3 | message enter[]\n"
        "  |         ^^^^^\n"
        "  = help: choose another name, or make them equal"
    )


def test_related_place_in_another_text_is_shown_with_its_name() -> None:
    [found] = check_texts([("a", "message enter[?car]"), ("b", "\nmessage enter[]")])
    assert found.render() == (
        "error[C0203]: expected one declaration of 'enter', got another one than at a:1\n"
        " --> b:2:9\n"
        "  |\n"
        "2 | message enter[]\n"
        "  |         ^^^^^\n"
        " ::: a:1:9\n"
        "  |\n"
        "1 | message enter[?car]\n"
        "  |         ----- the first\n"
        "  = help: choose another name, or make them equal"
    )


def test_contradiction_says_how_much_is_missing_and_mends_one_bound() -> None:
    text = place_of(CASES["a contradiction"].bad)[0]
    [found] = findings(text)
    assert found.hint == (
        "the lower bounds sum up to 10s, the upper bounds to 8s: together they miss by 2s; "
        "relax one of them, for example line 10 to 't3 is at most 10s after t1'"
    )
    assert [(one.line, one.label) for one in found.related] == [
        (9, "t3 is at least 5s after t2"),
        (10, "t3 is at most 8s after t1"),
    ]
    mended = text.replace("t3 - t1 in [0s, 8s]", "t3 - t1 in [0s, 10s]")
    assert load(mended).names == ("one",)


def test_contradiction_of_orders_alone_relaxes_a_lower_bound() -> None:
    text = body(TWO + "\nt2 - t1 in [3s, 9s]\nt2 < t1")
    [found] = findings(text)
    assert "together they miss by 3000001us" in found.hint
    assert found.hint.endswith("for example line 8 to 't1 is at most 1us after t2'")


def test_contradicted_hold_says_both_places() -> None:
    text, line, *_ = place_of(CASES["a hold of the value that its event changes"].bad)
    [found] = findings(text)
    assert [(one.line, one.label) for one in found.related] == [(line, "the event: behind[?a, ?b]:(false, true)")]


def test_hold_of_another_relation_or_of_others_is_no_contradiction() -> None:
    load(body("event(behind[?a, ?b]:(false, true), t2) hold(behind[?b, ?a]:false, (t2, t1)) t1 - t2 in [1s, 9s]"))
    load(body("event(behind[?a, ?b]:(false, true), t2) hold(behind[?a, ?b]:false, (t2 - 5s, t2)) t2 - t1 in [1s, 9s]"))


@pytest.mark.parametrize("text", ["timeunit 1us ", ""])
def test_zero_needs_no_unit(text: str) -> None:
    load(text + body(TWO + "t2 - t1 in [0, 9s] t2 >= t1 + 0.0"))
