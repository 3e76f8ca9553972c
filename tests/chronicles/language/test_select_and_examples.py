"""`select` and `example`: their trees, and what the check makes of examples."""

import pytest

from chronicles.chronicle_set import load, load_texts
from chronicles.language import model
from chronicles.language.parser import parse
from chronicles.language.printer import print_file, print_pattern
from dyknow.language.diagnostics import Reporter

VISIT = "message enter[?car] attribute near[?a, ?b] chronicle visit[?car](t1) { event(enter[?car], t1) }"


def read(text: str) -> model.ChronicleFile:
    reporter = Reporter({"text": text})
    file = parse(text, "text", reporter)
    assert not reporter.diagnostics
    return file


@pytest.mark.parametrize(
    ("written", "kind", "anchor"),
    [("all", "all", None), ("first(t1)", "first", "t1"), ("non_overlapping", "non_overlapping", None)],
)
def test_selection_is_a_statement(written: str, kind: str, anchor: str | None) -> None:
    [chronicle] = read(f"chronicle c {{ event(a[], t1) select {written} }}").declarations
    assert isinstance(chronicle, model.Chronicle)
    [_, found] = chronicle.statements
    assert isinstance(found, model.SelectStatement)
    assert found.kind == kind
    assert (found.anchor.name if found.anchor else None) == anchor


def test_words_of_a_selection_are_names_elsewhere() -> None:
    text = "chronicle all[](t1) { event(first[], t1) event(non_overlapping[], t1) }"
    assert load(text).names == ("all",)


def test_example_is_a_declaration_with_exact_times() -> None:
    text = """timeunit 1s
example "a car comes \\"near\\"" {
  1 enter[car1]; 1.5s near[car1, "t2"]:(unknown, true)
  until 1min
  expect visit[car=car1] 1s..1.5s
  expect other 0..2
}"""
    found = read(text).declarations[1]
    assert isinstance(found, model.Example)
    assert found.title == 'a car comes "near"'
    assert [(one.t_us, print_pattern(one.pattern)) for one in found.events] == [
        (1_000_000, "enter[car1]"),
        (1_500_000, 'near[car1, "t2"]:(unknown, true)'),
    ]
    assert found.until_us == 60_000_000
    assert [(one.chronicle, one.roles, one.start_us, one.end_us) for one in found.expected] == [
        ("visit", (("car", "car1"),), 1_000_000, 1_500_000),
        ("other", (), 0, 2_000_000),
    ]
    assert read(print_file(read(text))) == read(text)


def test_example_may_be_empty_and_expect_nothing() -> None:
    [found] = read('example "nothing" { }').declarations
    assert found == model.Example("nothing", (), None, (), span=found.span)


def test_loaded_examples_have_the_values_of_constants() -> None:
    text = (
        'constant mine = "car 1" '
        + VISIT
        + ' example "e" { 1s enter[mine] 2s near["mine", b]:(mine, x) expect visit[car=mine] 1s..1s }'
    )
    [found] = load(text).examples
    written = [print_pattern(one.pattern) for one in found.events]
    assert written == ['enter["car 1"]', 'near["mine", "b"]:("car 1", "x")']
    assert found.expected[0].roles == (("car", "car 1"),)


def test_examples_may_stand_in_a_text_of_their_own() -> None:
    loaded = load_texts([("examples", 'example "e" { 1s enter[a] expect visit[car=a] 1s..1s }'), ("visit", VISIT)])
    assert [one.title for one in loaded.examples] == ["e"]


def test_examples_do_not_change_the_version_of_a_chronicle() -> None:
    with_example = VISIT + ' example "e" { 1s enter[a] expect visit[car=a] 1s..1s }'
    assert load(with_example).plans == load(VISIT).plans


def test_item_with_an_error_is_left_out_of_an_example_and_the_rest_is_kept() -> None:
    text = 'example "e" {\n 1s enter[\n 2s enter[a]\n expect visit[car a] 1s..2s\n until 3s\n}'
    reporter = Reporter({"text": text})
    [found] = parse(text, "text", reporter).declarations
    assert [one.line for one in reporter.diagnostics] == [3, 4]
    assert isinstance(found, model.Example)
    assert ([one.t_us for one in found.events], found.until_us, found.expected) == ([2_000_000], 3_000_000, ())
