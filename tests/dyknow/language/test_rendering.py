"""Findings of all languages for editors and for the annotations of a code host."""

import json
from collections.abc import Callable

import pytest

from chronicles.chronicle_set import check_texts
from dyknow.kpl.checks import check_kpl
from dyknow.language.diagnostics import Diagnostic, TextError
from dyknow.language.rendering import render_github, render_json
from dyknow.mtl.parser import parse_formula, parse_monitors

TEXT = (
    "domain Truth = {true, false}\nattribute on[?a] { value in Truth }\nchronicle c { event(on[a]:(true, ture), t1) }"
)


def test_json_has_ranges_from_zero_and_the_edit_that_mends_it() -> None:
    [found] = json.loads(render_json(check_texts([("cars.chronicle", TEXT)])))
    place = {"start": {"line": 2, "character": 33}, "end": {"line": 2, "character": 37}}
    assert found == {
        "code": "C0303",
        "severity": "error",
        "message": "expected a value of Truth, got ture",
        "file": "cars.chronicle",
        "range": place,
        "hint": "did you mean 'true'?",
        "edit": {"range": place, "newText": "true"},
        "related": [],
    }


def test_json_counts_utf16_units() -> None:
    [found] = json.loads(render_json(check_texts([("t", 'chronicle c { event(a["\U0001f697"], t1) x }')])))
    assert found["range"] == {"start": {"line": 0, "character": 33}, "end": {"line": 0, "character": 34}}
    assert found["message"].endswith("got 'x'")


def test_json_has_related_places() -> None:
    [found] = json.loads(render_json(check_texts([("a", "message m[?x]"), ("b", "message m[]")])))
    place = {"start": {"line": 0, "character": 8}, "end": {"line": 0, "character": 9}}
    assert found["related"] == [{"file": "a", "range": place, "message": "the first"}]
    assert found["edit"] is None


def test_no_findings_are_an_empty_list() -> None:
    assert (render_json([]), render_github([])) == ("[]", "")


def test_commands_escape_what_ends_a_property_or_a_message() -> None:
    [found] = check_texts([("50%, a:b", "message m[?x]\nmessage m[]")])
    assert render_github([found]) == (
        "::error file=50%25%2C a%3Ab,line=2,col=9,endColumn=10,title=C0203::"
        "expected one declaration of 'm', got another one than at 50%25, a:b:1%0A"
        "50%25, a:b:1: the first%0A"
        "help: choose another name, or make them equal"
    )


def test_warnings_have_their_own_command() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [-1s, 1s] }"
    assert render_github(check_texts([("t", text)])).startswith(
        "::warning file=t,line=1,col=17,endColumn=19,title=C0406::"
    )


FOUND = {
    "kpl": ("source int s; source int s;", "K0201", 25, "the first"),
    "monitors": ("monitor a: p monitor a: p", "F0206", 21, "the first"),
    "formula": ("always[2s, 1s] p", "F0301", 11, "the start"),
}


def refused(language: str, text: str) -> tuple[Diagnostic, ...]:
    read: dict[str, Callable[[str], object]] = {"kpl": check_kpl, "monitors": parse_monitors, "formula": parse_formula}
    with pytest.raises(TextError) as caught:
        read[language](text)
    return caught.value.diagnostics


@pytest.mark.parametrize(("language", "case"), FOUND.items(), ids=FOUND.keys())
def test_every_language_has_related_places(language: str, case: tuple[str, str, int, str]) -> None:
    text, code, column, label = case
    [found] = json.loads(render_json(refused(language, text)))
    assert (found["code"], found["range"]["start"]["character"]) == (code, column)
    assert [one["message"] for one in found["related"]] == [label]


@pytest.mark.parametrize(
    ("language", "text", "mended"),
    [
        ("kpl", "source float gps; strmgen pos = gsp; stream a = pos;", "gps"),
        ("kpl", "source float gps; strmgen a = gps; stream b = a with max delay 5 sec;", "s"),
        ("kpl", "source float gps; strmgen a = gps; stream b = a with stirct order;", "strict"),
        ("formula", "always[0s, 5m] p", "5min"),
        ("formula", "exists x in Car: near[?x]", "?x"),
        ("monitors", "moniter a: p", "monitor"),
    ],
)
def test_every_language_has_edits_that_mend(language: str, text: str, mended: str) -> None:
    [found] = json.loads(render_json(refused(language, text)))
    assert found["edit"]["newText"] == mended
    start, end = (found["edit"]["range"][one]["character"] for one in ("start", "end"))
    read: dict[str, Callable[[str], object]] = {"kpl": check_kpl, "monitors": parse_monitors, "formula": parse_formula}
    read[language](text[:start] + mended + text[end:])
