"""Unknown units: what is written instead, and that nothing rests on a duration that could not be read."""

import pytest

from chronicles.chronicle_set import check_texts
from dyknow.language.diagnostics import Diagnostic

TWO = "event(a[], t1) event(b[], t2)"


def findings(text: str) -> tuple[Diagnostic, ...]:
    return check_texts([("text", text)])


@pytest.mark.parametrize(
    ("written", "mended"),
    [
        ("5m", "5min"),
        ("1minute", "1min"),
        ("10minutes", "10min"),
        ("5sec", "5s"),
        ("1second", "1s"),
        ("0.5seconds", "0.5s"),
        ("2hours", "2h"),
        ("2.5S", "2.5s"),
        ("5MS", "5ms"),
        ("1day", "24h"),
        ("2d", "48h"),
        ("1week", "168h"),
        ("0.5d", None),
        ("3ticks", None),
        ("3mn", None),
    ],
)
def test_edit_keeps_the_number_and_gives_the_unit_that_was_meant(written: str, mended: str | None) -> None:
    text = f"constant x = {written} chronicle c {{ {TWO} t2 - t1 in [0s, x] }}"
    [found] = findings(text)
    assert (found.code, found.edit) == ("C0104", mended)
    if mended is not None:
        assert findings(text[: found.column - 1] + mended + text[found.end_column - 1 :]) == ()


def test_hint_says_that_there_is_no_day() -> None:
    [found] = findings("constant x = 1.5d")
    assert found.hint == "there is no unit above the hour: a day is 24h"


BODY = f"chronicle c {{ {TWO} t2 - t1 in [1s, LENGTH] hold(p[]:v, (t1, t1 + LENGTH)) }}"


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        (BODY.replace("LENGTH", "5m"), ["C0104", "C0104"]),
        ("constant x = 5m " + BODY.replace("LENGTH", "x"), ["C0104"]),
        ("constant x = 0.5us " + BODY.replace("LENGTH", "x"), ["C0105"]),
        ("timeunit 5m " + BODY.replace("LENGTH", "7"), ["C0104"]),
        ("timeunit 0s " + BODY.replace("LENGTH", "7"), ["C0401"]),
        ("timeunit 5m constant x = 7 " + BODY.replace("LENGTH", "x"), ["C0104"]),
        (BODY.replace("LENGTH", "gap"), ["C0204", "C0204"]),
        ('timeunit 5m chronicle c { event(a[], t1) } example "e" { 1 a[] expect c 7..3 until 0 }', ["C0104"]),
    ],
)
def test_nothing_is_said_about_what_rests_on_an_unreadable_duration(text: str, codes: list[str]) -> None:
    assert [one.code for one in findings(text)] == codes
