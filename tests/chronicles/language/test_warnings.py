"""Warnings: what is said and where, when nothing is said, and that the text stays usable."""

import pytest

from chronicles import library
from chronicles.chronicle_set import check_texts, load
from tests.cases import for_each, seeds
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.language.texts.doubts import DOUBTS
from tests.chronicles.language.texts.faults_of_words import HEAD, Case
from tests.chronicles.language.texts.places import place_of


@for_each("case", DOUBTS)
def test_warning_has_code_place_and_words(case: Case) -> None:
    text, line, column, end_column = place_of(case.bad)
    [found] = load(text).warnings
    assert (found.code, found.severity) == (case.code, "warning")
    assert case.message in found.message
    assert case.hint in found.hint
    assert (found.line, found.column, found.end_column) == (line, column, end_column)


@for_each("case", DOUBTS)
def test_mended_text_has_no_warning(case: Case) -> None:
    assert load(case.good).warnings == ()


def test_implied_constraint_shows_the_places_that_imply_it() -> None:
    [found] = load(place_of(DOUBTS["a constraint that a chain implies"].bad)[0]).warnings
    assert [(one.line, one.label) for one in found.related] == [
        (8, "t2 is at least 1s after t1"),
        (9, "t3 is at least 1s after t2"),
    ]


def without_implied(text: str) -> str:
    """Blank out the constraints that others imply, each with its semicolon."""
    lines = text.split("\n")
    for found in (one for one in load(text).warnings if one.code == "C0601"):
        line, end = lines[found.line - 1], found.end_column - 1
        blank = " " * (end - found.column + 1)
        lines[found.line - 1] = line[: found.column - 1] + blank + line[end:].removeprefix(";")
    return "\n".join(lines)


@pytest.mark.long
@seeds(range(150), kept=75)
def test_leaving_out_implied_constraints_changes_no_plan(seeds: range) -> None:
    changed = 0
    for text in filter(is_accepted, (CaseMaker(seed).text() for seed in seeds)):
        shorter = without_implied(text)
        mended = load(shorter)
        assert [one.distance_us for one in mended.plans] == [one.distance_us for one in load(text).plans]
        assert not [one for one in mended.warnings if one.code == "C0601"]
        changed += shorter != text
    assert changed > len(seeds) // 30


def is_accepted(text: str) -> bool:
    return all(found.severity == "warning" for found in check_texts([("text", text)]))


def test_library_has_no_doubts() -> None:
    assert check_texts(library.texts()) == ()


def test_vocabulary_may_declare_what_nothing_uses() -> None:
    texts = [("words", "domain Car = symbol constant gap = 5s"), ("mine", "chronicle c { event(a[], t1) }")]
    assert check_texts(texts) == ()


def test_variable_that_must_differ_from_another_is_no_single_use() -> None:
    assert load(HEAD + "chronicle c[?a] { event(enter[?a], t1) noevent(enter[?b], (t1 - 1s, t1)) }").warnings == ()


def test_variable_of_an_emitted_event_or_a_report_is_used() -> None:
    text = HEAD + "message m[?x] chronicle c[?a](t1) { event(on[?a, ?r]:(?, true), t1) when recognised { ACTION } }"
    assert load(text.replace("ACTION", "emit m[?r]")).warnings == ()
    assert load(text.replace("ACTION", 'report "on ?r"')).warnings == ()


def test_names_that_the_stream_lacks_are_told_once_with_the_nearest() -> None:
    text = """chronicle one[?a](t1) {
  event(enters[?a], t1)
  noevent(enters[?a], (t1 + 1s, t1 + 2s))
  hold(on[?a, ?]:true, (t1, t1 + 1s))
  when recognised { emit seen[?a] }
}
chronicle two[?a](t1) { event(seen[?a], t1) }"""
    found = check_texts([("text", text)], ["enter", "on"])
    assert [(one.code, one.line, one.hint) for one in found] == [("C0901", 2, "did you mean 'enter'?")]
    assert check_texts([("text", text)], ["enters", "on"]) == ()
    assert check_texts([("text", text)]) == ()
