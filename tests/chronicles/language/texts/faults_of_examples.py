"""Faulty selections and examples (C01, C02, C03, C04), what is said about them, and how they are mended."""

from tests.chronicles.language.texts.faults_of_words import Case, body

ONE = body("")


def example(items: str) -> str:
    return f'{ONE}\nexample "e" {{ {items} }}'


EXAMPLES = {
    "an unknown selection": Case(
        "C0107",
        body("select <<fist>>(t1)"),
        "expected all, first(t1) or non_overlapping, got 'fist'",
        "did you mean 'first'?",
        body("select first(t1)"),
    ),
    "a first without its time point": Case(
        "C0107",
        body("<<select first>>"),
        "got 'first'",
        "'first' needs the time point of an event",
        body("select first(t1)"),
    ),
    "a selection with a needless time point": Case(
        "C0107", body("<<select all(t1)>>"), "got 'all(t1)'", "the others take none", body("select all")
    ),
    "a confidence in percent": Case(
        "C0110", body("confidence >= <<80>>"), "0 to 1, got 80", "write 0.8 for 80 %", body("confidence >= 0.8")
    ),
    "two confidences": Case(
        "C0203",
        body("confidence >= 0.5 <<confidence >= 0.8>>"),
        "expected one confidence in chronicle 'one'",
        "keep one of them",
        body("confidence >= 0.8"),
    ),
    "a selection by no event": Case(
        "C0408",
        body("t2 = t1 + 1s select first(<<t2>>)"),
        "expected the time point of an event, got t2",
        "'t1'",
        body("t2 = t1 + 1s select first(t1)"),
    ),
    "an example that ends too early": Case(
        "C0410",
        example("1s enter[a] <<5s enter[b]>> until 2s expect one[a=a] 1s..1s"),
        "expected the events of an example up to its 'until' at 2s, got one at 5s",
        "write until 5s, or later",
        example("1s enter[a] 5s enter[b] until 5s expect one[a=a] 1s..1s"),
    ),
    "a variable in an example": Case(
        "C0108",
        example("1s enter[<<?car>>]"),
        "expected a value in an event of an example, got '?car'",
        "write a value such as car",
        example("1s enter[car] until 1s expect one[a=car] 1s..1s"),
    ),
    "anything in an example": Case(
        "C0108",
        example("1s on[a, b]:(<<?>>, true)"),
        "got '?'",
        "write a value such as car1",
        example("1s on[a, b]:(false, true)"),
    ),
    "a misspelled item of an example": Case(
        "C0102",
        example("1s enter[a]\n<<expct>> one[a=a] 1s..1s"),
        "expected a time and an event, 'expect' or 'until' after ']', got 'expct'",
        "did you mean 'expect'?",
        example("1s enter[a]\nexpect one[a=a] 1s..1s"),
    ),
    "an example without a title": Case(
        "C0102",
        f"{ONE} example <<one>> {{ 1s enter[a] }}",
        "expected a text in \"quotes\" after 'example', got 'one'",
        "",
        example("1s enter[a]"),
    ),
    "an example that is not closed": Case(
        "C0103",
        example("1s enter[a<<]>>")[:-2],
        "got the end of the declaration",
        "is not closed",
        example("1s enter[a]"),
    ),
    "an unknown event in an example": Case(
        "C0201", example("1s <<entre>>[a]"), "got the unknown name 'entre'", "'enter'?", example("1s enter[a]")
    ),
    "too few arguments in an example": Case(
        "C0301",
        example("1s <<enter[]>>"),
        "expected 1 argument for 'enter', got 0",
        "write enter with 1 argument",
        example("1s enter[a]"),
    ),
    "a value outside its domain in an example": Case(
        "C0303",
        example("1s on[a, b]:(false, <<ture>>)"),
        "expected a value of Truth, got ture",
        "'true'?",
        example("1s on[a, b]:(false, true)"),
    ),
    "a duration as a value in an example": Case(
        "C0305",
        "constant gap = 5s " + example("1s enter[<<gap>>]"),
        "expected a value, got the constant 'gap'",
        "",
        "constant gap = 5s " + example('1s enter["gap"]'),
    ),
    "two ends of an example": Case(
        "C0203",
        example("until 1s <<until 2s>>"),
        "expected one 'until' in a declaration, got a second",
        "",
        example("until 2s"),
    ),
    "an unknown chronicle in an example": Case(
        "C0207",
        example("1s enter[a] expect <<oen>>[a=a] 1s..1s"),
        "expected a chronicle, got the unknown name 'oen'",
        "did you mean 'one'?",
        example("1s enter[a] expect one[a=a] 1s..1s"),
    ),
    "an unknown role": Case(
        "C0208",
        example("expect one[<<aa=a>>] 1s..1s"),
        "expected a role of 'one', got 'aa'",
        "did you mean 'a'?",
        example("expect one[a=a] 1s..1s"),
    ),
    "a role twice": Case(
        "C0208",
        example("expect one[a=a, <<a=b>>] 1s..1s"),
        "expected each role once, got 'a' twice",
        "",
        example("expect one[a=a] 1s..1s"),
    ),
    "a missing role": Case(
        "C0208",
        example("expect <<one>> 1s..1s"),
        "expected all roles of 'one', got none for 'a'",
        "write one[a=...]",
        example("expect one[a=a] 1s..1s"),
    ),
    "an occurrence that ends before it starts": Case(
        "C0401",
        example("expect one[a=a] <<2s..1s>>"),
        "expected an end that is not before the start",
        "the earlier time comes first",
        example("expect one[a=a] 1s..2s"),
    ),
}
