"""Whatever stands in a text, no message of any language gives a terminal orders or floods it."""

from collections.abc import Callable

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from dyknow.kpl.checks import check_kpl
from dyknow.language.diagnostics import Diagnostic, TextError
from dyknow.language.rendering import render_github, render_json
from dyknow.mtl.parser import parse_formula, parse_monitors
from tests.cases import for_each

READERS: dict[str, Callable[[str], object]] = {
    "chronicle": load,
    "kpl": check_kpl,
    "formula": parse_formula,
    "monitors": parse_monitors,
}
HOSTILE = {
    "control bytes": "chronicle c { event(\x1b[31ma\x07[], t1) \x9b2J } \x00",
    "a long line": "source " + "x" * 6_676 + ";",
    "a long line of short words": "a b " * 1_700,
    "a long text in quotes": 'chronicle c { event(a[], "' + "b " * 3_000 + '") }',
    "control bytes in quotes": 'p = "\x1b]0;owned\x07" =',
    "many strange characters": "".join(map(chr, range(0x4E00, 0x5E00))),
    "a long number": "always[0s, " + "9" * 6_000 + "s] p < " + "9" * 6_000,
}


def refused(read: Callable[[str], object], text: str) -> tuple[str, tuple[Diagnostic, ...]]:
    with pytest.raises((TextError, ChronicleError)) as caught:
        read(text)
    error = caught.value
    assert isinstance(error, TextError | ChronicleError)
    return str(error), error.diagnostics


@pytest.mark.long
@for_each("read", READERS)
@for_each("text", HOSTILE)
def test_message_is_printable_and_short(read: Callable[[str], object], text: str) -> None:
    shown, diagnostics = refused(read, text)
    lines = shown.split("\n")
    assert all(line.isprintable() for line in lines)
    assert max(map(len, lines)) < 1_100
    assert len(lines) < 50 * 8
    for one in diagnostics:
        assert (one.message + one.hint).isprintable()
    assert "\x1b" not in render_json(diagnostics) + render_github(diagnostics)


@for_each("read", READERS)
def test_source_line_is_shown_around_the_place(read: Callable[[str], object]) -> None:
    text = " " * 3_000 + "? wrong" + " " * 3_000
    shown, _ = refused(read, text)
    [source] = [line for line in shown.split("\n") if line.startswith("1 | ")]
    [marks] = [line for line in shown.split("\n") if "^" in line]
    assert source[marks.index("^")] in "?w"
    assert len(source) < 130


def test_name_of_a_file_is_printable() -> None:
    with pytest.raises(ChronicleError) as caught:
        load("chronicle", name="a\x1b[2J.chronicle")
    assert "--> a\\x1b[2J.chronicle:1:1" in str(caught.value)
