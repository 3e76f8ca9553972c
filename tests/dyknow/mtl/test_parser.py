"""What formulas a text has, and what is said about texts that have none."""

import re

import numpy as np
import pytest

from dyknow.errors import FormulaError
from dyknow.language.words import Strange
from dyknow.mtl import parser
from dyknow.mtl.formula import And, Formula, Monitor, Not, Quantified, Subject, Truth, Variable
from dyknow.mtl.kinds import Signature
from dyknow.mtl.parser import parse_formula, parse_monitors
from dyknow.mtl.printer import print_formula, print_monitors
from dyknow.mtl.structure import MOST_CHANGES, window_changes
from dyknow.mtl.syntax_errors import explain_character
from tests.dyknow.mtl.support import pick, random_formula

OVERTAKE = "overtake[?overtaker, ?overtaken, ?road]"
SIGNATURE = Signature({"speed": 1, "behind": 2, "green": 0, "overtake": 3}, ["Car"], events={"overtake": OVERTAKE})


def parse(text: str) -> Formula:
    return parse_formula(text, variables=["a", "b"])


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("p and q or r implies s iff t", "(((p and q) or r) implies s) iff t"),
        ("p implies q implies r", "p implies (q implies r)"),
        ("p or q and r", "p or (q and r)"),
        ("p and q until r", "p and (q until r)"),
        ("p until q until r", "p until (q until r)"),
        ("always p until q", "(always p) until q"),
        ("not p and q", "(not p) and q"),
        ("not always next eventually p", "not (always (next (eventually p)))"),
        ("p -> q <-> r", "(p implies q) iff r"),
        ("p and forall ?x in C: q and r", "p and (forall ?x in C: (q and r))"),
        ("always exists ?x in C: q until r", "always (exists ?x in C: (q until r))"),
        ("forall ?x in C, ?y in D: p[?x, ?y]", "forall ?x in C: forall ?y in D: p[?x, ?y]"),
        ("always[0, oo] p", "always p"),
        ("always[0, 60s] p", "always[0ms, 1min] p"),
        ("v - w + 1 < 2 * u", "(v - w + 1 < 2 * u)"),
        ('not speed[?a] < 3 # always\n and // more\n road = "main"', 'not (speed[?a] < 3) and (road = "main")'),
    ],
)
def test_operators_bind_as_the_grammar_lists_them(text: str, meant: str) -> None:
    assert parse(text) == parse(meant)


def test_groups_in_parentheses_stay_groups() -> None:
    assert parse("(p and q) and r") != parse("p and q and r")


def test_reading_what_was_written_gives_the_same_formula() -> None:
    for seed in range(500):
        rng = np.random.default_rng([1, seed])
        formula = random_formula(rng, 1 + pick(rng, 5))
        if window_changes(formula) <= MOST_CHANGES:
            assert parse(print_formula(formula)) == formula, seed


@pytest.mark.parametrize(
    "text",
    [
        "speed[?a] >= -3.5 m/s2",
        "1.25 * speed[?a] - speed[car7] + 0.50 km/h != 30 m/s",
        'p["car 7", "say \\"hi\\" \\\\", "until"]',
        "tolerate(p until[1us, oo] q, 500ms, 2h)",
        "?a = ?b iff not (true iff false)",
        "(p implies q) implies r",
        "not (p and q)",
        "always (p or q)",
        "(forall ?x in C: p) and (exists ?x in C: p[?x])",
        "(p until q) until r",
    ],
)
def test_written_form_is_stable(text: str) -> None:
    formula = parse(text)
    written = print_formula(formula)
    assert parse(written) == formula
    assert print_formula(parse(written)) == written


def test_a_formula_built_by_hand_can_be_written() -> None:
    assert print_formula(Not(And((Truth(True), Truth(False))))) == "not (true and false)"


def test_monitors_are_read_and_written() -> None:
    text = """
    # One variable may stay without a quantifier.
    monitor careful per Car: always speed[?c] < 50 km/h
    monitor apart per ?a in Car, ?b in Car: always (?a != ?b implies not close[?a, ?b]);
    monitor lights: always eventually[0s, 2min] green
    """
    monitors = parse_monitors(text)
    assert [one.name for one in monitors] == ["careful", "apart", "lights"]
    assert monitors[0].subjects == (Subject(Variable("c"), "Car"),)
    assert [len(one.subjects) for one in monitors] == [1, 2, 0]
    assert parse_monitors(print_monitors(monitors)) == monitors


def test_a_text_without_monitors_has_none() -> None:
    assert parse_monitors("# nothing yet\n") == ()


def test_per_sort_looks_past_the_variables_of_quantifiers() -> None:
    (monitor,) = parse_monitors("monitor m per Car: forall ?y in Car: ?y = ?x or p[?y, ?x]")
    assert isinstance(monitor, Monitor)
    assert isinstance(monitor.formula, Quantified)
    assert monitor.subjects == (Subject(Variable("x"), "Car"),)


@pytest.mark.parametrize(
    ("text", "code", "place", "message", "hint"),
    [
        ("p & q", "F0101", (1, 3), "expected a word of the language, got the character '&'", "write 'and'"),
        ('road = "main', "F0101", (1, 8), "got the character '\"'", 'texts start and end with " on one line'),
        (
            "not " * 3000 + "p",
            "F0104",
            (1, 1),
            "expected operators in one another up to 100 deep",
            "monitors of their own",
        ),
        ("p q", "F0102", (1, 3), "expected 'and', 'or', 'implies', 'until' or the end after 'p', got 'q'", ""),
        ("alwys p", "F0102", (1, 7), "after 'alwys', got 'p'", "did you mean 'always'?"),
        ("p untill q", "F0102", (1, 3), "got 'untill'", "did you mean 'until'?"),
        ("eventualy[0s, 3s] p", "F0102", (1, 11), "got '0s'", "did you mean 'eventually'?"),
        ("a == b", "F0102", (1, 4), "expected something to compare after '=', got '='", "compared with '='"),
        ("a < b < c", "F0102", (1, 7), "got '<'", "join two comparisons by 'and'"),
        ("a iff b iff c", "F0102", (1, 9), "or the end after 'b', got 'iff'", "put one 'iff' in parentheses"),
        ("speed < 30 mph", "F0102", (1, 12), "after '30', got 'mph'", "units are us, ms"),
        ("forall x in C: p", "F0102", (1, 8), "expected a variable such as ?car", "start with a question mark: ?x"),
        ("always[oo, 3s] p", "F0102", (1, 8), "expected a duration such as 5s", "only the end of a window may be 'oo'"),
        ("p[until]", "F0102", (1, 3), "got 'until'", "'until' is a word of the language; choose another name"),
        ("p and", "F0103", (1, 3), "expected a formula after 'and', got the end of the text", ""),
        (
            "(p\n or q",
            "F0103",
            (2, 5),
            "expected ')', 'and', 'or', 'implies' or 'until' after 'q', got the end of the text",
            "",
        ),
        ("", "F0103", (1, 1), "expected a formula, got the end of the text", ""),
        ("a + 1", "F0103", (1, 5), "expected a comparison such as '<' after '1', got the end of the text", ""),
        ("tolerate(p, 1s)", "F0102", (1, 15), "expected ',' after '1s', got ')'", "write tolerate(p, 1s, 500ms)"),
        ("always spead[?a] < 3", "F0201", (1, 8), "expected a known feature, got 'spead'", "did you mean 'speed'?"),
        ("behind[?a]", "F0202", (1, 1), "expected 2 arguments of 'behind', got 1", ""),
        ("overtake[?a, ?b]", "F0202", (1, 1), "expected 3 arguments of 'overtake', got 2", f"write {OVERTAKE}, with ?"),
        ("behind[?, ?a]", "F0208", (1, 8), "expected an object or a variable in 'behind', got '?'", "exists ?x in"),
        ("overtake[?a, ? b, we]", "F0102", (1, 16), "after '?', got 'b'", "written ?car, without a blank"),
        ("forall ?x in Cars: green", "F0203", (1, 14), "expected a known sort, got 'Cars'", "did you mean 'Car'?"),
        ("always speed[?c] < 3", "F0204", (1, 14), "expected a bound variable, got '?c'", "known: 'a', 'b'"),
        ("forall ?a in Car: green", "F0205", (1, 8), "expected a new variable, got '?a' again", "different names"),
        (
            "always[3s, 2500ms] green",
            "F0301",
            (1, 12),
            "expected an end that is not before the start 3s, got 2500ms",
            "",
        ),
        (
            "always[0s, 5] green",
            "F0302",
            (1, 12),
            "expected a duration with a unit of time, got '5'",
            "us, ms, s, min, h",
        ),
        (
            "always[0s, 5m] green",
            "F0302",
            (1, 12),
            "expected a duration with a unit of time, got '5m'",
            "did you mean '5min'?",
        ),
        ("always[0s, 0.5us] green", "F0303", (1, 12), "expected a whole number of microseconds, got '0.5us'", ""),
        (
            "next[0s, 400000h] green",
            "F0102",
            (1, 5),
            "expected a formula after 'next', got '['",
            "windows stand after always",
        ),
        ("always[0s, 400000h] green", "F0303", (1, 12), "expected a duration of at most 35 years", ""),
    ],
)
def test_error_says_where_what_was_expected_and_what_came(
    text: str, code: str, place: tuple[int, int], message: str, hint: str
) -> None:
    with pytest.raises(FormulaError) as raised:
        parse_formula(text, variables=["a", "b"], signature=SIGNATURE if code.startswith("F02") else None)
    (found,) = raised.value.diagnostics
    assert (found.code, (found.line, found.column)) == (code, place)
    assert message in found.message
    assert hint in found.hint
    assert bool(hint) == bool(found.hint)


def test_an_event_may_be_asked_of_whichever_object() -> None:
    text = "always not overtake[?a, ?, we]"
    formula = parse_formula(text, variables=["a"], signature=SIGNATURE)
    assert print_formula(formula) == text
    assert parse_formula(print_formula(formula), variables=["a"]) == formula


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("monitor a: p monitor a: q", "F0206", "expected a new name of a monitor, got 'a' again"),
        ("monitor a per Car: p", "F0207", "expected one variable without a quantifier for 'Car', got none"),
        ("monitor a per Car: p[?x, ?y]", "F0207", "for 'Car', got ?x and ?y"),
        ("monitor a per Car, Car: p[?x]", "F0207", "expected variables for several sorts, got 'Car'"),
        ("monitor per Car: p", "F0102", "expected a name after 'monitor', got 'per'"),
        ("always p", "F0102", "expected 'monitor', got 'always'"),
        ("monitor a per ?x in Car, ?x in Car: p[?x]", "F0205", "expected a new variable, got '?x' again"),
    ],
)
def test_error_in_a_monitor(text: str, code: str, message: str) -> None:
    with pytest.raises(FormulaError, match=re.escape(message)) as raised:
        parse_monitors(text)
    assert [one.code for one in raised.value.diagnostics] == [code]


def test_one_reading_finds_the_errors_of_all_monitors() -> None:
    text = "monitor a: p[\nmonitor b: always[2s, 1s] q[?x]\nmonitor c per Car: true;\nmonitor d: ok"
    with pytest.raises(FormulaError) as raised:
        parse_monitors(text, name="site.mtl")
    found = raised.value.diagnostics
    assert [(one.code, one.line) for one in found] == [("F0103", 1), ("F0301", 2), ("F0204", 2), ("F0207", 3)]
    assert str(raised.value).count("--> site.mtl:") == 4


def test_a_bad_character_is_reported_once() -> None:
    with pytest.raises(FormulaError) as raised:
        parse_formula("p & q & r | s")
    assert [(one.code, one.column) for one in raised.value.diagnostics] == [("F0101", 3), ("F0101", 11)]


def test_only_the_first_bad_characters_are_shown() -> None:
    strange = "".join(chr(0x4E00 + k) for k in range(5000))
    with pytest.raises(FormulaError) as raised:
        parse_formula(f"p and\n{strange}")
    assert [one.column for one in raised.value.diagnostics] == list(range(1, 12))
    assert raised.value.diagnostics[-1].message.endswith("got 4990 more kinds of characters from here")


def test_the_words_are_read_once_however_many_characters_are_strange(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []

    def counted(text: str, at: int, before: str) -> Strange:
        read.append(at)
        return explain_character(text, at, before)

    monkeypatch.setattr(parser, "explain_character", counted)
    text = "".join(chr(0x4E00 + k) for k in range(300))
    with pytest.raises(FormulaError):
        parse_formula(text)
    assert read == list(range(300))


def test_a_monitor_with_bad_characters_does_not_hide_what_is_wrong_with_others() -> None:
    with pytest.raises(FormulaError) as raised:
        parse_monitors("monitor a: p & q\nmonitor b: always[2s, 1s] p")
    assert [(one.code, one.line) for one in raised.value.diagnostics] == [("F0101", 1), ("F0301", 2)]


def test_windows_that_take_turns_too_often_are_refused() -> None:
    turns = "always[0s, 1s] eventually[0s, 1s] "
    parse_formula(f"{turns * 2}always[0s, 1s] p")
    with pytest.raises(FormulaError) as raised:
        parse_monitors(f"monitor fine: p\nmonitor m:\n  {turns * 3}p")
    (found,) = raised.value.diagnostics
    assert (found.code, found.line, found.column) == ("F0105", 3, 3)
    assert "in turn at most 5 deep, got 6" in found.message
    with pytest.raises(FormulaError, match="F0105"):
        parse_monitors(f"monitor m per Car: {turns * 3}p[?c]")


@pytest.mark.parametrize(
    ("text", "changes"),
    [
        ("always (not p implies eventually[0s, 1s] always[0s, 1s] p)", 3),
        ("always[0s, 1s] not eventually[0s, 1s] p", 1),
        ("always tolerate(p, 1s, 1s)", 3),
        ("tolerate(tolerate(p, 1s, 1s), 1s, 1s)", 4),
        ("p iff eventually[0s, 1s] (q iff eventually[0s, 1s] p)", 2),
        ("(p until[0s, 1s] q) until[0s, 1s] (q until[0s, 1s] p)", 1),
        ("(eventually[0s, 1s] p) implies always[0s, 1s] q", 1),
        ("always eventually always p", 0),
        ("always eventually always[1s, oo] p", 1),
        ("forall ?c in Car: next eventually[0s, 1s] p", 1),
    ],
)
def test_turns_are_counted(text: str, changes: int) -> None:
    assert window_changes(parse_formula(text)) == changes
