"""Texts with a fault in their words or names (C01, C02), what is said about it, and how it is mended."""

from dataclasses import dataclass

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
WORDS = {
    "a text in single quotes": Case(
        "C0101",
        body("?a != <<'abc'>>"),
        'expected a word of the language, got the character "\'"',
        'texts stand in double quotes: "abc"',
        body('?a != "abc"'),
    ),
    "and between statements": Case(
        "C0102",
        body("<<and>> " + TWO + "t2 - t1 in [0s, 3s] ?a != ?b", "[?a](t1, t2)"),
        "expected a statement after ')', got 'and'",
        "all statements must hold anyway: leave out 'and'",
        body(TWO + "t2 - t1 in [0s, 3s] ?a != ?b", "[?a](t1, t2)"),
    ),
    "or between statements": Case(
        "C0102",
        body("<<or>> " + TWO + "t2 - t1 in [0s, 3s] ?a != ?b", "[?a](t1, t2)"),
        "expected a statement after ')', got 'or'",
        "write a chronicle for each way it can happen; all may emit the same event",
        body(TWO + "t2 - t1 in [0s, 3s] ?a != ?b", "[?a](t1, t2)"),
    ),
    "not before a statement": Case(
        "C0102",
        body("<<not>> noevent(enter[?], (t1 + 1us, t1 + 1s))"),
        "expected a statement after ')', got 'not'",
        "write noevent(...) for what must not happen, with its window",
        body("noevent(enter[?], (t1 + 1us, t1 + 1s))"),
    ),
    "a value that is compared": Case(
        "C0102",
        body("<<speed>>[?a] > 90"),
        "expected a statement after ')', got 'speed'",
        "a value is compared by a monitor, and its verdict is an event here",
        body(""),
    ),
    "a unit that is written out": Case(
        "C0102",
        body(TWO + "t2 - t1 in [0 <<seconds>>, 3s] ?a != ?b", "[?a](t1, t2)"),
        "expected ',' after '0', got 'seconds'",
        "the unit stands close by: 0s",
        body(TWO + "t2 - t1 in [0s, 3s] ?a != ?b", "[?a](t1, t2)"),
    ),
    "a comment of another language": Case(
        "C0101",
        body("<</*>> two\nlines */ ?a != x"),
        "expected a word of the language, got '/*'",
        "comments start with # and end with their line",
        body("# two\n# lines\n?a != x"),
    ),
    "a star for no upper limit": Case(
        "C0101",
        body("occurs((2, <<*>>), enter[?], (t1, t1 + 1s))"),
        "got the character '*'",
        "no bound is written oo",
        body("occurs((2, oo), enter[?], (t1, t1 + 1s))"),
    ),
    "inf for no upper limit": Case(
        "C0102",
        body("occurs((2, <<inf>>), enter[?], (t1, t1 + 1s))"),
        "expected 'oo' or a number after ',', got 'inf'",
        "no bound is written oo",
        body("occurs((2, oo), enter[?], (t1, t1 + 1s))"),
    ),
    "a difference that is compared": Case(
        "C0102",
        body(TWO + "t2 - t1 <<<>> 5s"),
        "expected 'in' after 't1', got '<'",
        "write t2 < t1 + 5s, or a range such as t2 - t1 in [0s, 5s]",
        body(TWO + "t2 < t1 + 5s t2 >= t1"),
    ),
    "a difference that is set": Case(
        "C0102",
        body(TWO + "t2 - t1 <<=>> 5s"),
        "expected 'in' after 't1', got '='",
        "write t2 = t1 + 5s, or a range such as t2 - t1 in [5s, 5s]",
        body(TWO + "t2 - t1 in [5s, 5s]"),
    ),
    "an offset on the left": Case(
        "C0102",
        body(TWO + "t2 <= t1 + 9s t1 <<+>> 5s < t2"),
        "after 't1', got '+'",
        "the offset stands on the right: write t2 > t1 + 5s",
        body(TWO + "t2 <= t1 + 9s t2 > t1 + 5s"),
    ),
    "a negative offset on the left": Case(
        "C0102",
        body(TWO + "t2 - t1 in [-9s, 9s] t1 - <<5s>> <= t2"),
        "expected a time point such as t1 after '-', got '5s'",
        "the offset stands on the right: write t2 >= t1 - 5s",
        body(TWO + "t2 - t1 in [-9s, 9s] t2 >= t1 - 5s"),
    ),
    "a chain of time points": Case(
        "C0102",
        body(TWO + "t1 <= t2 <<<=>> t1 + 5s"),
        "expected a statement after 't2', got '<='",
        "write two constraints: t1 <= t2; t2 <= t1 + 5s",
        body(TWO + "t1 <= t2; t2 <= t1 + 5s"),
    ),
    "a misspelled recognised": Case(
        "C0102",
        body('when <<recognsed>> { report "x" }'),
        "expected 'recognised' after 'when', got 'recognsed'",
        "did you mean 'recognised'?",
        body('when recognised { report "x" }'),
    ),
    "a misspelled emit": Case(
        "C0102",
        body('when recognised { report "x" <<emti>> enter[?a] at t1 }'),
        "expected 'emit', 'report' or 'assert' after '\"x\"', got 'emti'",
        "did you mean 'emit'?",
        body('when recognised { report "x" }'),
    ),
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
    "an infinite offset": Case(
        "C0102",
        body(TWO + "t2 <= t1 + <<oo>>"),
        "expected a duration such as 5s, a name or a number after '+', got 'oo'",
        "'oo' is the end of a range without a bound",
        body(TWO + "t2 = t1"),
    ),
    "an unknown action": Case(
        "C0102",
        body("when recognised { <<emt>> enter[?a] }"),
        "expected 'emit', 'report' or 'assert' after '{', got 'emt'",
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
        "did you mean '5s'?",
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
    "a number with an exponent": Case(
        "C0105",
        body(TWO + "t2 - t1 in [<<1e-05>>, 5s]"),
        "expected a number without an exponent, got '1e-05'",
        "write it out, such as 0.00001s or 10us",
        body(TWO + "t2 - t1 in [0.00001s, 5s]"),
    ),
    "a duration too long to read": Case(
        "C0105",
        body("hold(on[?a, ?]:true, (t1, t1 + <<" + "9" * 5000 + "s>>))"),
        "expected a number of at most 30 characters, got one of 500",
        "",
        body("hold(on[?a, ?]:true, (t1, t1 + 9s))"),
    ),
    "a count too long to read": Case(
        "C0105",
        body("occurs((0, <<" + "9" * 5000 + ">>), enter[?], (t1, t1 + 1s))"),
        "expected a number of at most 30 characters, got one of 500",
        "",
        body("occurs((0, 9), enter[?], (t1, t1 + 1s))"),
    ),
    "a name where a statement starts": Case(
        "C0102",
        body("event(enter[?b], t1)\n<<gap>> >= t2 - t1"),
        "expected a statement after ')', got 'gap'",
        "",
        body("event(enter[?b], t1)"),
    ),
    "a misspelled statement at the end": Case(
        "C0102", body("<<evnt>>"), "expected a statement after ')', got 'evnt'", "did you mean 'event'?", body("")
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
    "numbers without a unit": Case(
        "C0106",
        body(TWO + "t2 - t1 in [<<1>>, 9]"),
        "expected a duration with a unit of time, got '1'",
        "write 1s, or say what all numbers of the text count: timeunit 1s",
        "timeunit 1s " + body(TWO + "t2 - t1 in [0, 9]"),
    ),
    "a timeunit without a unit": Case(
        "C0106",
        "timeunit <<5>> " + body(TWO + "t2 - t1 in [1, 9]"),
        "expected a duration with a unit of time, got '5'",
        "write 5s",
        "timeunit 5s " + body(TWO + "t2 - t1 in [1, 9]"),
    ),
    "a constant that counts nothing": Case(
        "C0106",
        "constant gap = 5 " + body(TWO + "t2 - t1 in [0, <<gap>>]"),
        "expected a duration with a unit of time, got 'gap', which is '5'",
        "write constant gap = 5s",
        "constant gap = 5s " + body(TWO + "t2 - t1 in [0, gap]"),
    ),
}
