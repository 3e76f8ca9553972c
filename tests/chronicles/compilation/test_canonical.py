"""Canonical texts say all that the loaded ones mean."""

import pytest

from chronicles import library
from chronicles.chronicle_set import ChronicleSet, load, load_texts
from chronicles.errors import ChronicleError
from tests.cases import seeds
from tests.chronicles.execution.random_cases import CaseMaker

UNITS = "timeunit 1s  constant gap = 5  "
COUNTED = "chronicle pair(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [2, gap] }"


def assert_says_all(chronicles: ChronicleSet) -> None:
    for plan in chronicles.plans:
        text = dict(chronicles.texts)[plan.name]
        again = load(text)
        assert again.plan(plan.name) == plan
        assert dict(again.texts)[plan.name] == text


def test_library_says_the_same_in_canonical_texts() -> None:
    assert_says_all(library.load_library())


@seeds(range(300), kept=120)
def test_random_chronicles_say_the_same_in_canonical_texts(seeds: range) -> None:
    accepted = 0
    for seed in seeds:
        try:
            chronicles = load(CaseMaker(seed).text())
        except ChronicleError:
            continue
        assert_says_all(chronicles)
        accepted += 1
    assert accepted > len(seeds) // 3


@pytest.mark.parametrize(
    "text",
    [
        UNITS + COUNTED,
        "domain car = {x, y}  message car[?a] { ?a in car }  chronicle seen[?a](t1) { event(car[?a], t1) }",
        "constant gap = 5s  domain gap = {x}  message a[?x] { ?x in gap }  message b[]  "
        + COUNTED.replace("a[]", "a[x]").replace("[2,", "[2us,"),
        'constant place = "Main Street"  chronicle there(t1) { event(seen[place, "place", "?x", "event"], t1) }',
    ],
    ids=["bare constant", "message named as its domain", "constant named as a domain", "quoted values"],
)
def test_canonical_text_has_all_that_the_chronicle_rests_on(text: str) -> None:
    assert_says_all(load(text))


def test_bare_constant_counts_the_unit_of_the_text_that_uses_it() -> None:
    chronicles = load_texts([("constants", "timeunit 1ms constant gap = 5"), ("pair", "timeunit 1s " + COUNTED)])
    assert chronicles.plan("pair").distance_us[0][1] == 5_000_000
    assert_says_all(chronicles)


def test_version_does_not_depend_on_the_order_of_declarations_with_one_name() -> None:
    declared = ("domain car = {x, y} ", "message car[?a] { ?a in car } ")
    both = [load("".join(order) + "chronicle seen(t1) { event(car[?], t1) }") for order in (declared, declared[::-1])]
    assert both[0].plan("seen").version == both[1].plan("seen").version
