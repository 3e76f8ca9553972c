"""Examples in chronicle texts: what is compared, and how a failure reads."""

import pytest

from chronicles.errors import ChronicleError
from chronicles.examples import render, run_examples

TWICE = """
message honk[?car]
chronicle twice[?car, ?first](t1, t2) { event(honk[?car], t1) event(honk[?car], t2) event(wake[?first], t1)
  t2 - t1 in ]0s, 5s] }
message wake[?by]
"""
STREAM = "1s honk[a] 1s wake[u] 2s honk[a]"


def passes(example: str, text: str = TWICE) -> bool:
    [result] = run_examples([("horn", f'{text} example "e" {{ {example} }}')])
    return result.passed


def test_example_passes_when_all_that_is_expected_comes_and_nothing_else() -> None:
    assert passes(f"{STREAM} expect twice[car=a, first=u] 1s..2s")
    assert passes("1s honk[a] 1s wake[u] 7s honk[a]")


@pytest.mark.parametrize(
    "expected",
    [
        "",
        "expect twice[car=a, first=v] 1s..2s",
        "expect twice[car=a, first=u] 1s..3s",
        "expect twice[car=a, first=u] 1s..2s expect twice[car=a, first=u] 1s..2s",
    ],
    ids=["nothing", "another role", "another end", "twice"],
)
def test_example_fails_when_something_else_comes(expected: str) -> None:
    assert not passes(f"{STREAM} {expected}")


def test_each_occurrence_answers_one_expectation_whatever_their_order() -> None:
    stream = "1s honk[a] 1s wake[u] 1s wake[v] 2s honk[a]"
    assert passes(f"{stream} expect twice[car=a, first=v] 1s..2s expect twice[first=u, car=a] 1s..2s")
    assert not passes(f"{stream} expect twice[car=a, first=u] 1s..2s expect twice[car=a, first=u] 1s..2s")


def test_absence_needs_time_to_go_on() -> None:
    alone = (
        "message honk[?car] chronicle alone[?car](t1) { event(honk[?car], t1) noevent(honk[?], (t1 + 1us, t1 + 5s)) }"
    )
    assert passes("1s honk[a] until 6s expect alone[car=a] 1s..1s", alone)
    assert passes("1s honk[a]", alone)


def test_only_the_chronicles_of_the_own_text_are_compared_but_all_run() -> None:
    base = (
        "message honk[?car] message pair[?car] "
        "chronicle pair[?car](t1, t2) { event(honk[?car], t1) event(honk[?car], t2) t2 - t1 in ]0s, 2s] "
        "when recognised { emit pair[?car] } }"
    )
    own = "chronicle told[?car](t1) { event(pair[?car], t1) } "
    own += 'example "built on another text" { 1s honk[a] 2s honk[a] expect told[car=a] 2s..2s }'
    [result] = run_examples([("base", base), ("own", own)])
    assert result.passed
    assert (result.file, result.line, result.title) == ("own", 1, "built on another text")


def test_failure_shows_what_is_missing_and_what_came_instead() -> None:
    text = TWICE + f'example "honks" {{\n  {STREAM} 3s honk[a]\n'
    text += "  expect twice[car=a, first=u] 1s..2s expect twice[car=b, first=u] 1.5s..3s }"
    [result] = run_examples([("horn", text)])
    assert render(result) == (
        "FAIL horn:6: honks\n"
        "    twice[car=a, first=u] 1s..2s\n"
        "  - twice[car=b, first=u] 1500ms..3s\n"
        "  + twice[car=a, first=u] 1s..3s"
    )


def test_success_is_one_line() -> None:
    [result] = run_examples([("horn", TWICE + f'example "honks" {{ {STREAM} expect twice[car=a, first=u] 1s..2s }}')])
    assert render(result) == "ok   horn:6: honks"


def test_text_without_examples_has_no_results() -> None:
    assert run_examples([("horn", TWICE)]) == ()


def test_text_with_an_error_is_refused() -> None:
    with pytest.raises(ChronicleError, match="twise"):
        run_examples([("horn", TWICE + 'example "e" { 1s honk[a] expect twise[car=a] 1s..2s }')])
