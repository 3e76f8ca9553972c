"""Plans: the same for every order of the text, minimal, and bounded."""

import random
from dataclasses import replace

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from tests.cases import for_each

STATEMENTS = [
    "event(a[?x], t1)",
    "event(b[?x, ?y], t2)",
    "event(p[?y]:(?, on), t3)",
    "t2 - t1 in [1s, 5s]",
    "t3 - t2 in [-2s, 2s]",
    "t0 = t1 - 1s",
    "noevent(a[?z], (t1 + 1us, t2))",
    "hold(q[?x, ?r]:on, (t0, t2))",
    "hold(q[?y, ?r]:on, (t0, t2))",
    "occurs((1, 3), b[?x, ?w], (t1, t3))",
    "assert(p[?x]:on, (t0, t1))",
    "assert(q[?x, ?r]:off, (t2, t3))",
    "select first(t2)",
    "?z != car7",
]


@for_each("seed", range(20))
def test_plan_does_not_depend_on_the_order_of_the_text(seed: int) -> None:
    shuffled = list(STATEMENTS)
    random.Random(seed).shuffle(shuffled)
    plans = [load(f"chronicle c[?x](t1, t3) {{ {' '.join(lines)} }}").plans[0] for lines in (STATEMENTS, shuffled)]
    assert replace(plans[0], version="") == replace(plans[1], version="")


def test_plan_has_the_minimal_network_between_events() -> None:
    text = "event(a[], t1) event(b[], t2) event(d[], t3) t2 - t1 in [1s, 5s] t3 - t2 in [1s, 5s] t3 < t1 + 4s"
    plan = load(f"chronicle c {{ {text} }}").plans[0]
    assert plan.distance_us == ((0, 2_999_999, 3_999_999), (-1_000_000, 0, 2_999_999), (-2_000_000, -1_000_000, 0))


def test_holds_that_only_check_come_before_those_that_search() -> None:
    plan = load(f"chronicle c {{ {' '.join(STATEMENTS)} }}").plans[0]
    holds = [(one.bound, one.binds) for one in plan.persistences if not one.is_assumed]
    assert holds == [(((0, 0),), ((1, 2),)), (((0, 1), (1, 2)), ())]


def test_asserts_come_last_and_give_no_variable_a_value() -> None:
    plan = load(f"chronicle c {{ {' '.join(STATEMENTS)} }}").plans[0]
    assert [one.is_assumed for one in plan.persistences] == [False, False, True, True]
    assert [one.binds for one in plan.persistences if one.is_assumed] == [(), ()]


def test_version_changes_with_the_meaning_and_not_with_the_spelling() -> None:
    def version(text: str) -> str:
        return load(text).plans[0].version

    plain = "constant gap = 5s message b[] chronicle a { event(b[], t1) event(b[], t2) t2 - t1 in [1s, gap] }"
    spelled = plain.replace("1s", "1000ms").replace("{", "{  # a comment\n")
    assert version(plain) == version(spelled)
    assert version(plain) == version(plain.replace("message b[]", "message b[] message unused[]"))
    assert version(plain) != version(plain.replace("5s", "6s"))
    assert version(plain) != version(plain.replace("1s", "2s"))


def test_unknown_chronicle_is_named_in_the_error() -> None:
    with pytest.raises(ChronicleError, match=r"expected one of \['a'\], got 'b'"):
        load("chronicle a { event(b[], t1) }").plan("b")


def test_how_far_a_chronicle_looks_back_is_known_before_it_runs() -> None:
    text = """chronicle c(t1, t2) {
      event(a[], t1) event(b[], t2) t2 - t1 in [0s, 10s]
      hold(p[]:on, (t1 - 3s, t1)) noevent(d[], (t2, t2 + 2s))
    }"""
    plan = load(text).plans[0]
    assert (plan.tail_us, plan.memory_us) == (12_000_000, 15_000_000)


TWO = "event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 9s]"
DECLARED = "message a[?x] message b[?x] attribute p[?x] "


@pytest.mark.parametrize(
    ("code", "statements", "message", "hint", "mended"),
    [
        (
            "C0401",
            "occurs((3, 1), a[?x], (t1, t2))",
            "expected a number of events between two bounds, got 3 to 1",
            "the smaller number comes first",
            "occurs((1, 3), a[?x], (t1, t2))",
        ),
        (
            "C0405",
            "occurs((0, 1), a[?x], (t1, t1))",
            "expected an interval whose start is before its end",
            "",
            "occurs((0, 1), a[?x], (t1, t1 + 1s))",
        ),
        (
            "C0501",
            "t1 = t2 occurs((1, 2), a[?x], (t1, t2))",
            "contradict each other",
            "they miss by 1us",
            "t1 = t2 occurs((0, 2), a[?x], (t1, t2))",
        ),
        (
            "C0502",
            "occurs((0, 1), a[?], (t1, t2 + 1s)) event(a[?y], t3) t3 = t1",
            "got one that forbids the events at t1 and t3 itself",
            "let its interval start after",
            "occurs((0, 2), a[?], (t1, t2 + 1s)) event(a[?y], t3) t3 = t1",
        ),
        (
            "C0805",
            "assert(p[?z]:on, (t1, t2))",
            "expected ?z to get its value from an event or a hold, got only an assert",
            "known: '?x'",
            "assert(p[?x]:on, (t1, t2))",
        ),
        (
            "C0805",
            "assert(p[?]:on, (t1, t2))",
            "expected a variable or a value in an assert, got '?'",
            "nothing contradicts an assert about anything",
            "assert(p[car1]:on, (t1, t2))",
        ),
        (
            "C0804",
            "when recognised { assert(p[?z]:on, t1) }",
            "expected ?z to get its value from an event or a hold",
            "known: '?x'",
            "when recognised { assert(p[?x]:on, t1) }",
        ),
        (
            "C0302",
            "when recognised { assert(a[?x]:on, t1) }",
            "expected an attribute, got the message 'a'",
            "",
            "when recognised { assert(p[?x]:on, t1) }",
        ),
        (
            "C0408",
            "select first(t3)",
            "expected the time point of an event, got t3",
            "known: 't1', 't2'",
            "select first(t2)",
        ),
        (
            "C0408",
            "event(b[?y], t1) select first(t1)",
            "expected the time point of one event, got t1, which 2 share",
            "such as t1b, and add t1b = t1",
            "event(b[?y], t1b) t1b = t1 select first(t1)",
        ),
        (
            "C0203",
            "select all select non_overlapping",
            "expected one select in chronicle 'c'",
            "keep one of them",
            "select non_overlapping",
        ),
    ],
)
def test_fault_is_named_and_its_mended_text_accepted(
    code: str, statements: str, message: str, hint: str, mended: str
) -> None:
    with pytest.raises(ChronicleError) as caught:
        load(f"{DECLARED} chronicle c {{ {TWO} {statements} }}")
    [found] = [one for one in caught.value.diagnostics if one.severity == "error"]
    assert found.code == code
    assert message in found.message
    assert hint in found.hint
    load(f"{DECLARED} chronicle c {{ {TWO} {mended} }}")
