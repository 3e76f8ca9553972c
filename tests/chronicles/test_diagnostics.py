"""Every finding: its code, its place, its words, and that the mended text is accepted."""

import re
from dataclasses import dataclass

import pytest

from chronicles.chronicle_set import check_texts, load, load_texts
from chronicles.diagnostics import Diagnostic
from chronicles.errors import ChronicleError
from tests.chronicles.terminals import TERMINAL_NAMES

HEAD = """domain Car = symbol
domain Road = symbol
domain Truth = {true, false}
message enter[?car] { ?car in Car }
attribute behind[?a, ?b] { ?a in Car ?b in Car value in Truth }
attribute on[?car, ?road] { ?car in Car ?road in Road value in Truth }
"""


@dataclass(frozen=True)
class Case:
    """A text, where `<<` and `>>` stand around the place of the finding, and how it is mended."""

    code: str
    bad: str
    message: str
    hint: str
    good: str


def body(statements: str, head: str = "[?a](t1)") -> str:
    return f"{HEAD}chronicle one{head} {{ event(enter[?a], t1) {statements} }}"


TWO = "event(enter[?b], t2) "
CASES = {
    "a character no word has": Case(
        "C0101", body("<<@>>"), "expected a word of the language, got the character '@'", "", body("")
    ),
    "an unfinished text": Case(
        "C0101",
        body('when recognised { report <<">>x\n}'),
        "got the character '\"'",
        "texts start and end with",
        body('when recognised { report "x"\n}'),
    ),
    "a misspelled statement": Case(
        "C0102",
        body("<<evnt>>(enter[?b], t2) t2 - t1 in [0s, 1s]"),
        "expected a statement after ')', got 'evnt'",
        "did you mean 'event'?",
        body(TWO + "t2 - t1 in [0s, 1s]"),
    ),
    "a misspelled declaration": Case(
        "C0102",
        "message a[] <<mesage>> b[]",
        "expected a new declaration after ']', got 'mesage'",
        "'message'?",
        "message a[]",
    ),
    "a first word that declares nothing": Case(
        "C0102", "<<chronicel>> x { }", "expected a declaration, got 'chronicel'", "'chronicle'?", "message x[]"
    ),
    "a forgotten parenthesis": Case(
        "C0102",
        body("noevent(enter[?], (t1, t1 + 1s) <<event>>(enter[?b], t1)"),
        "expected ')' after ')', got 'event'",
        "",
        body("event(enter[?b], t1)"),
    ),
    "a forgotten time point": Case(
        "C0102",
        body("event(enter[?b]<<)>>"),
        "expected ',' or ':' after ']', got ')'",
        "",
        body("event(enter[?b], t1)"),
    ),
    "a time point with a bad name": Case(
        "C0102",
        body("event(enter[?b], <<start>>)"),
        "got 'start'",
        "the letter t, a digit",
        body("event(enter[?b], t1)"),
    ),
    "a variable without its mark": Case(
        "C0102",
        "message enter[<<car>>]",
        "got 'car'",
        "variables start with a question mark: ?car",
        "message enter[?car]",
    ),
    "a name like a time point": Case(
        "C0102", "message <<t1>>[]", "expected a name after 'message', got 't1'", "choose another name", "message t[]"
    ),
    "a word of the language as a value": Case(
        "C0102",
        body("?a != <<event>>"),
        "got 'event'",
        'as a value it needs quotes: "event"',
        body('?a != "event"'),
    ),
    "== between time points": Case(
        "C0102",
        body(TWO + "t2 <<==>> t1"),
        "after 't2', got '=='",
        "time points are compared with '='",
        body(TWO + "t2 = t1"),
    ),
    "= between variables": Case(
        "C0102", body(TWO + "t2 = t1 ?a <<=>> ?b"), "got '='", "'==' and '!='", body(TWO + "t2 = t1 ?a == ?b")
    ),
    "an unknown action": Case(
        "C0102",
        body("when recognised { <<emt>> enter[?a] }"),
        "expected 'emit' or 'report' after '{', got 'emt'",
        "'emit'?",
        body('when recognised { report "x" }'),
    ),
    "an open brace": Case(
        "C0103",
        "chronicle one[] { event(a[], t1) hold(b[]:x, (t1, t1 + 1s)<<)>>",
        "got the end of the declaration",
        "the chronicle that starts in line 1 is not closed",
        "chronicle one[] { event(a[], t1) hold(b[]:x, (t1, t1 + 1s)) }",
    ),
    "an unknown unit": Case(
        "C0104",
        body("hold(on[?a, ?]:true, (t1, t1 + <<5sec>>))"),
        "expected a unit of time, got 'sec'",
        "known: 'h'",
        body("hold(on[?a, ?]:true, (t1, t1 + 5s))"),
    ),
    "less than a microsecond": Case(
        "C0105",
        body("hold(on[?a, ?]:true, (t1, t1 + <<0.0005ms>>))"),
        "expected a whole number of microseconds, got '0.0005ms'",
        "",
        body("hold(on[?a, ?]:true, (t1, t1 + 0.005ms))"),
    ),
    "more than 35 years": Case(
        "C0105", body("hold(on[?a, ?]:true, (t1, t1 + <<400000h>>))"), "expected at most 35 years", "", body("")
    ),
    "occurs": Case(
        "C0106", body("<<occurs((1, oo), enter[?], (t1, t1 + 1s))>>"), "got 'occurs'", "not recognised yet", body("")
    ),
    "assert": Case(
        "C0106", body("<<assert(on[?a, north]:true, (t1, t1 + 1s))>>"), "got 'assert'", "not recognised yet", body("")
    ),
    "an unknown event": Case(
        "C0201",
        body("event(<<entr>>[?b], t1)"),
        "expected an attribute or a message, got the unknown name 'entr'",
        "did you mean 'enter'?",
        body("event(enter[?b], t1)"),
    ),
    "an unknown attribute": Case(
        "C0201",
        body("hold(<<behnd>>[?a, ?]:true, (t1, t1 + 1s))"),
        "expected an attribute, got the unknown name 'behnd'",
        "did you mean 'behind'?",
        body("hold(behind[?a, ?]:true, (t1, t1 + 1s))"),
    ),
    "an unknown domain": Case(
        "C0202", body("?a in <<Cars>>"), "expected a domain, got the unknown name 'Cars'", "'Car'?", body("?a in Car")
    ),
    "an unknown domain in a declaration": Case(
        "C0202",
        HEAD + "message x[?a] { ?a in <<Cra>> }",
        "got the unknown name 'Cra'",
        "'Car'?",
        HEAD + "message x[?a]",
    ),
    "two declarations of one name": Case(
        "C0203",
        HEAD + "message <<behind>>[?a]",
        "expected one declaration of 'behind', got another one than at <text>:5",
        "choose another name",
        HEAD + "message behind_it[?a]",
    ),
    "two timeunits": Case(
        "C0203", "timeunit 1s <<timeunit 1ms>>", "expected one timeunit in a text", "", "timeunit 1s"
    ),
    "a parameter twice": Case("C0203", "message enter[?car, <<?car>>]", "got ?car twice", "", "message enter[?car]"),
    "an unknown constant": Case(
        "C0204",
        "constant patience = 5s " + body(TWO + "t2 - t1 in [0s, <<pateince>>]"),
        "expected a duration or a constant, got the unknown name 'pateince'",
        "did you mean 'patience'?",
        "constant patience = 5s " + body(TWO + "t2 - t1 in [0s, patience]"),
    ),
    "a domain of a parameter that is none": Case(
        "C0205",
        "message enter[?car] { <<?cra>> in symbol }",
        "expected a parameter of 'enter', got ?cra",
        "'?car'?",
        "message enter[?car] { ?car in symbol }",
    ),
    "a domain made of itself": Case(
        "C0205",
        "domain <<A>> = B domain B = A | {x} message m[]",
        "got one made of itself: A -> B -> A",
        "",
        "domain A = B domain B = {x} message m[]",
    ),
    "two chronicles of one name": Case(
        "C0206",
        "chronicle one { event(a[], t1) } chronicle <<one>> { event(a[], t1) }",
        "expected one chronicle 'one', got another one than at <text>:1",
        "choose another name",
        "chronicle one { event(a[], t1) } chronicle two { event(a[], t1) }",
    ),
    "the wrong number of arguments": Case(
        "C0301",
        body("event(<<enter[?b, north]>>, t1)"),
        "expected 1 argument for 'enter', got 2",
        "",
        body("event(enter[?b], t1)"),
    ),
    "an attribute without values": Case(
        "C0302",
        body("event(<<behind[?a, ?b]>>, t1)"),
        "expected the old and the new value of the attribute 'behind', got none",
        "write behind[...]:(old, new)",
        body("event(behind[?a, ?b]:(?, true), t1)"),
    ),
    "a message with values": Case(
        "C0302",
        body("event(<<enter[?b]:(true, false)>>, t1)"),
        "expected an attribute, got the message 'enter', which has no value",
        "write enter[...] without ':'",
        body("event(enter[?b], t1)"),
    ),
    "a value outside its domain": Case(
        "C0303",
        body("event(on[?a, north]:(?, <<ture>>), t1)"),
        "expected a value of Truth, got ture",
        "did you mean 'true'?",
        body("event(on[?a, north]:(?, true), t1)"),
    ),
    "a default outside its domain": Case(
        "C0303",
        "attribute p[] { value in {x, y} default <<z>> }",
        "expected a value of {x, y}, got z",
        "known: 'x', 'y'",
        "attribute p[] { value in {x, y} default y }",
    ),
    "a variable of two sorts": Case(
        "C0304",
        body("event(on[?b, <<?a>>]:(?, true), t1)"),
        "expected ?a to be a Car as in line 7, got a Road",
        "use two variables",
        body("event(on[?b, ?r]:(?, true), t1)"),
    ),
    "a duration as a value": Case(
        "C0305",
        "constant patience = 5s " + body("?a != <<patience>>"),
        "expected a value, got the constant 'patience', which is a duration",
        "",
        "constant patience = 5s " + body('?a != "patience"'),
    ),
    "a value as a duration": Case(
        "C0305",
        "constant fast = quick " + body(TWO + "t2 - t1 in [0s, <<fast>>]"),
        "expected a duration, got the constant 'fast', which is 'quick'",
        "",
        "constant fast = 5s " + body(TWO + "t2 - t1 in [0s, fast]"),
    ),
    "a change that is none": Case(
        "C0306",
        body("event(on[?a, ?]:(true, <<true>>), t1)"),
        "expected a change between two values, got 'true' twice",
        "",
        body("event(on[?a, ?]:(false, true), t1)"),
    ),
    "two values for one variable": Case(
        "C0307",
        body("?a == car1 <<?a == car2>>"),
        "expected one value for ?a, got 'car1' and 'car2'",
        "",
        body("?a == car1"),
    ),
    "equal and different": Case(
        "C0307",
        body("event(enter[?b], t1) ?a == ?b <<?a != ?b>>"),
        "expected ?a and ?b to differ, got them equal by '=='",
        "",
        body("event(enter[?b], t1) ?a == ?b"),
    ),
    "constraints no value meets": Case(
        "C0307",
        body("?a in {x, y} <<?a in {z}>>"),
        "expected a value that ?a can take",
        "",
        body("?a in {x, y} ?a in {y}"),
    ),
    "one value for two variables of a sort": Case(
        "C0307",
        body("event(enter[?b], t1) ?a == x ?b == x").replace("chronicle one", "chronicle <<one>>"),
        "expected ?a and ?b to differ, got 'x' for both",
        "write `allow ?a == ?b`",
        body("event(enter[?b], t1) ?a == x ?b == x allow ?a == ?b"),
    ),
    "bounds the wrong way round": Case(
        "C0401",
        body(TWO + "t2 - t1 in [<<5s, 1s>>]"),
        "expected bounds with a time between them, got 5s to 1s",
        "the smaller bound comes first",
        body(TWO + "t2 - t1 in [1s, 5s]"),
    ),
    "nothing between open bounds": Case(
        "C0401",
        body(TWO + "t2 - t1 in ]<<1s, 1s>>["),
        "expected bounds with a time between them",
        "",
        body(TWO + "t2 - t1 in [1s, 1s]"),
    ),
    "infinity on the wrong side": Case(
        "C0401",
        body(TWO + "t2 - t1 in [<<oo>>, 1s]"),
        "expected -oo or a duration as the lower bound, got oo",
        "",
        body(TWO + "t2 - t1 in [-5s, 1s]"),
    ),
    "an empty range": Case(
        "C0401",
        "domain Level = <<[5..1]>> message m[]",
        "expected a range of 1 to 100000 numbers, got [5..1]",
        "",
        "domain Level = [1..5] message m[]",
    ),
    "a time point of nothing": Case(
        "C0403",
        body("", "[?a](<<t0>>, t1)"),
        "expected t0 to be the time of an event or at a fixed distance from one, got neither",
        "add an event at t0, or a constraint such as t1 - t0 in [1s, 1s]",
        body("t1 - t0 in [1s, 1s]", "[?a](t0, t1)"),
    ),
    "a misspelled time point": Case(
        "C0403",
        body("hold(on[?a, ?]:true, (t1, <<t11>> + 1s))"),
        "expected t11 to be the time of an event",
        "'t1'?",
        body("hold(on[?a, ?]:true, (t1, t1 + 1s))"),
    ),
    "a point against itself": Case(
        "C0404", body("<<t1 - t1 in [0s, 1s]>>"), "expected two time points, got t1 twice", "", body("")
    ),
    "an interval that is always empty": Case(
        "C0405",
        body("noevent(enter[?], <<(t1 + 2s, t1 + 1s)>>)"),
        "expected an interval whose start is before its end",
        "",
        body("noevent(enter[?], (t1 + 1s, t1 + 2s))"),
    ),
    "an emitted event without a time": Case(
        "C0407",
        body("when recognised { <<emit enter[?a]>> }", "[?a]"),
        "expected a time for the emitted event, got none",
        "write emit event(..., t1)",
        HEAD + "message e[?x] chronicle one[?a] { event(enter[?a], t1) when recognised { emit event(e[?a], t1) } }",
    ),
    "a contradiction": Case(
        "C0501",
        body(TWO + "event(enter[?c], t3)\n<<t2 - t1 in [5s, 9s]>>\nt3 - t2 in [5s, 9s]\nt3 - t1 in [0s, 8s]"),
        "the time constraints of 'one' contradict each other: ",
        "together they miss by 2s",
        body(
            "event(enter[?b], t2) event(enter[?c], t3)\nt2 - t1 in [5s, 9s]\nt3 - t2 in [5s, 9s]\nt3 - t1 in [0s, 10s]"
        ),
    ),
    "a noevent that forbids its own chronicle": Case(
        "C0502",
        body("<<noevent(enter[?], (t1, t1 + 5s))>>"),
        "got one that forbids the event at t1 itself",
        "(t1 + 1us, ...)",
        body("noevent(enter[?], (t1 + 1us, t1 + 5s))"),
    ),
    "a wait without end": Case(
        "C0701",
        body("event(enter[?b], <<t2>>) t1 < t2"),
        "expected a bound on how long after t1 the event at t2 may come, got none",
        "add a constraint such as t2 - t1 in [0s, 1min]",
        body("event(enter[?b], t2) t1 < t2 t2 <= t1 + 1min"),
    ),
    "a role without a value": Case(
        "C0801",
        body("", "[?a, <<?b>>](t1)"),
        "expected ?b to get its value from an event or a hold, got no such statement",
        "",
        body("", "[?a](t1)"),
    ),
    "a role only a noevent names": Case(
        "C0801",
        body("noevent(enter[?other], (t1 + 1us, t1 + 1s))", "[?a, <<?other>>](t1)"),
        "expected ?other",
        "",
        body("noevent(enter[?other], (t1 + 1us, t1 + 1s))"),
    ),
    "no event at all": Case(
        "C0802",
        "chronicle <<one>> { }",
        "expected at least one event in chronicle 'one', got none",
        "",
        "chronicle one { event(a[], t1) }",
    ),
    "a constraint on an unknown variable": Case(
        "C0803",
        body("<<?c>> != x"),
        "expected a variable that stands in an event, a noevent or a hold, got ?c",
        "",
        body("?a != x"),
    ),
    "variables never known together": Case(
        "C0803",
        body("noevent(enter[?b], (t1 - 1s, t1)) noevent(enter[?c], (t1 + 1s, t1 + 2s)) <<?b != ?c>>"),
        "expected variables known together, got ?b and ?c",
        "each stands in a noevent of its own",
        body("noevent(enter[?b], (t1 - 1s, t1)) noevent(enter[?c], (t1 + 1s, t1 + 2s))"),
    ),
    "an emitted variable without a value": Case(
        "C0804",
        HEAD + "message e[?x] chronicle one[?a](t1) { event(enter[?a], t1) when recognised { emit e[<<?c>>] } }",
        "expected ?c to get its value",
        "known: '?a'",
        HEAD + "message e[?x] chronicle one[?a](t1) { event(enter[?a], t1) when recognised { emit e[?a] } }",
    ),
    "anything in an emitted event": Case(
        "C0804",
        HEAD + "message e[?x] chronicle one[?a](t1) { event(enter[?a], t1) when recognised { emit e[<<?>>] } }",
        "expected a variable or a value in an emitted event, got '?'",
        "",
        HEAD + "message e[?x] chronicle one[?a](t1) { event(enter[?a], t1) when recognised { emit e[?a] } }",
    ),
    "chronicles in a circle": Case(
        "C1101",
        "chronicle <<one>>(t1) { event(a[], t1) when recognised { emit b[] } } "
        "chronicle two(t1) { event(b[], t1) when recognised { emit a[] } }",
        "got one -> two -> one",
        "an emitted event may only be used by other chronicles",
        "chronicle one(t1) { event(a[], t1) when recognised { emit b[] } } "
        "chronicle two(t1) { event(b[], t1) when recognised { emit c[] } }",
    ),
}


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
