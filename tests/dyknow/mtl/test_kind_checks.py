"""What may be compared with what in a formula, and where the mistake is."""

import pytest

from dyknow.errors import FormulaError
from dyknow.mtl.kinds import Kind, Signature
from dyknow.mtl.parser import parse_formula, parse_monitors

FEATURES = {"speed": 1, "limit": 1, "x": 1, "heading": 1, "road": 1, "class": 1, "moving": 1, "load": 1}
KINDS = {
    "speed": Kind.SPEED,
    "limit": Kind.SPEED,
    "x": Kind.LENGTH,
    "heading": Kind.ANGLE,
    "road": Kind.WORD,
    "class": Kind.WORD,
    "moving": Kind.TRUTH,
}
SIGNATURE = Signature(FEATURES, ["Car"], kinds=KINDS, values={"class": ("car", "bus", "truck")})


@pytest.mark.parametrize(
    "text",
    [
        "moving[?a]",
        "speed[?a] < 30",
        "speed[?a] > 1.2 * limit[?a] + 5 km/h",
        "x[?a] - 3 m >= 2 km",
        "heading[?a] = 90 deg",
        'road[?a] != "main"',
        'exists ?b in Car: (?a != ?b and ?b != "car7")',
        "moving[?a] = moving[car7]",
        'class[?a] = "bus" or "truck" != class[?a]',
        "class[?a] = road[?a]",
        "load[?a]",
        "load[?a] < 3 m and load[?a] < 3 s and load[?a]",
        "x[?a] = ?a".replace("x[", "road["),
        "5 < 6 km/h",
    ],
)
def test_what_is_of_one_kind_can_be_compared(text: str) -> None:
    parse_formula(text, variables=["a"], signature=SIGNATURE)


@pytest.mark.parametrize(
    ("text", "code", "columns", "message", "hint"),
    [
        ("always speed[?a]", "F0401", (8, 17), "a truth value, got 'speed[?a]', which is a speed", "speed[?a] = ..."),
        ("speed[?a] < 36 m", "F0402", (13, 17), "expected a speed, as 'speed[?a]' is, got a length", "m/s, km/h"),
        ("36 m > speed[?a]", "F0402", (1, 5), "expected a speed, as 'speed[?a]' is, got a length", "m/s, km/h"),
        ("x[?a] > speed[?a]", "F0402", (9, 18), "expected a length, as 'x[?a]' is, got a speed", "are m, km"),
        ("3 m < 5 s", "F0402", (7, 10), "expected a length, as '3 m' is, got a duration", "are m, km"),
        ('speed[?a] = "fast"', "F0402", (13, 19), "expected a speed, as 'speed[?a]' is, got a word", ""),
        ("road[?a] = 5", "F0402", (12, 13), "expected a word, as 'road[?a]' is, got a number", '"quotes"'),
        ("moving[?a] = 1", "F0402", (14, 15), "expected a truth value, as 'moving[?a]' is, got a", "or not moving"),
        ('road[?a] < "main"', "F0403", (10, 11), "expected '=' or '!=' between words, got '<'", ""),
        ('load[?a] < "main"', "F0403", (10, 11), "expected '=' or '!=' between words, got '<'", ""),
        ("?a < ?b", "F0403", (4, 5), "expected '=' or '!=' between objects, got '<'", ""),
        ("2 * road[?a] = 3", "F0404", (5, 13), "a number to reckon with, got 'road[?a]', which is a word", ""),
        ("?a + 3 = 4", "F0404", (1, 3), "a number to reckon with, got '?a', which is an object", ""),
        ("speed[?a] + 3 + x[?a] > 4", "F0402", (17, 22), "as 'speed[?a] + 3' is, got a length", "m/s, km/h"),
        ("x[?a] + 3 - 2 s = 4", "F0402", (13, 16), "expected a length, as 'x[?a] + 3' is, got a duration", ""),
        ('class[?a] = "cra"', "F0405", (13, 18), "a value that 'class' can have, got 'cra'", "did you mean 'car'?"),
        ('"van" != class[?a]', "F0405", (1, 6), "can have, got 'van'", "known: 'bus', 'car', 'truck'"),
    ],
)
def test_what_is_not_is_refused_at_its_place(
    text: str, code: str, columns: tuple[int, int], message: str, hint: str
) -> None:
    with pytest.raises(FormulaError) as raised:
        parse_formula("true and\n  " + text, variables=["a", "b"], signature=SIGNATURE)
    (found,) = raised.value.diagnostics
    assert (found.code, found.line) == (code, 2)
    assert (found.column - 2, found.end_column - 2) == columns
    assert message in found.message
    assert hint in found.hint
    assert (raised.value.line, raised.value.column) == (2, found.column)


def test_one_mistake_in_a_term_is_told_once() -> None:
    with pytest.raises(FormulaError) as raised:
        parse_formula("2 * road[?a] + 3 m = 4 km", variables=["a"], signature=SIGNATURE)
    assert [one.code for one in raised.value.diagnostics] == ["F0404"]


def test_an_unknown_feature_is_not_judged_by_its_kind_too() -> None:
    with pytest.raises(FormulaError) as raised:
        parse_formula("spede[?a] < 3 m", variables=["a"], signature=SIGNATURE)
    assert [one.code for one in raised.value.diagnostics] == ["F0201"]


def test_every_mistake_of_a_text_is_told_with_a_caret() -> None:
    text = "monitor m per Car:\n  always (speed[?c] or\n    eventually[0s, 1s] x[?c] < 3 s)"
    with pytest.raises(FormulaError) as raised:
        parse_monitors(text, name="a.monitors", signature=SIGNATURE)
    assert [(one.line, one.column) for one in raised.value.diagnostics] == [(2, 11), (3, 32)]
    shown = str(raised.value)
    assert " --> a.monitors:3:32\n" in shown
    assert "\n  |                                ^^^\n" in shown


def test_units_are_checked_without_a_signature() -> None:
    with pytest.raises(FormulaError, match="expected a speed, as 'speed \\+ 3 km/h' is, got an angle"):
        parse_formula("speed + 3 km/h != 30 deg")
