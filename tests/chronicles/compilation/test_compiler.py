"""Plans: the same for every order of the text, minimal, and bounded."""

import random
from dataclasses import replace

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError

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
    "?z != car7",
]


@pytest.mark.parametrize("seed", range(20))
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
    assert [(one.bound, one.binds) for one in plan.persistences] == [(((0, 0),), ((1, 2),)), (((0, 1), (1, 2)), ())]


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
