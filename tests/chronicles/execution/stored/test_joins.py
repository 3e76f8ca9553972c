"""Range joins against trying every choice of rows, and their parts: tests of rows, indexes of rows, counts."""

from itertools import product

import numpy as np
import pytest

from chronicles import recognise
from chronicles.chronicle_set import load
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.execution.stored.columns import EventColumns, Fitting, fitting
from chronicles.execution.stored.joins import complete_rows
from chronicles.execution.stored.matches import find_matches
from chronicles.execution.stored.row_index import Numbering, RowIndex
from tests.chronicles.execution.random_cases import CaseMaker

CASES_A_BLOCK = 60
MOST_ROWS = (1, 2, 5, 1 << 17)


def random_case(seed: int) -> tuple[Plan, EventColumns]:
    maker = CaseMaker(seed)
    while True:
        try:
            plan = load(maker.text()).plans[0]
        except ChronicleError:
            continue
        return plan, EventColumns.from_events(maker.trace())


def brute_force(plan: Plan, found: list[Fitting]) -> list[tuple[int, ...]]:
    """Try every choice of fitting rows."""
    places = range(len(found))
    kinds = [(one.test.name, one.test.arity, one.test.is_change) for one in plan.positions]
    chosen = []
    for rows in product(*(range(len(one.rows)) for one in found)):
        times = [one.times_us[row] for one, row in zip(found, rows, strict=True)]
        values: dict[int, set[int]] = {}
        for one, row in zip(found, rows, strict=True):
            for slot, codes in one.slots.items():
                values.setdefault(slot, set()).add(int(codes[row]))
        events = {(kind, int(one.rows[row])) for kind, one, row in zip(kinds, found, rows, strict=True)}
        if (
            len(events) == len(rows)
            and all(times[b] - times[a] <= plan.distance_us[a][b] for a in places for b in places)
            and all(len(texts) == 1 for texts in values.values())
            and all(values[first] != values[second] for first, second in plan.different)
        ):
            chosen.append(rows)
    return sorted(chosen)


@pytest.mark.parametrize("most_rows", MOST_ROWS)
def test_finds_every_choice_of_rows_once_in_blocks_of_any_size(most_rows: int) -> None:
    found_any = 0
    for seed in range(CASES_A_BLOCK):
        plan, columns = random_case(seed)
        found = [fitting(columns, position.test) for position in plan.positions]
        joined = [np.stack(one).T.tolist() for one in complete_rows(plan, found, most_rows=most_rows)]
        expected = brute_force(plan, found)
        assert sorted(tuple(rows) for part in joined for rows in part) == expected, seed
        found_any += bool(expected)
    assert found_any >= CASES_A_BLOCK // 5


def test_tables_in_between_stay_as_small_as_asked_for() -> None:
    [plan] = load(
        "chronicle all[] { event(a[], t1) event(b[], t2) event(c[], t3) t2 - t1 in [0us, 99us] t3 - t2 in [0us, 99us] }"
    ).plans
    columns = EventColumns.from_events([Event(name, (), t_us) for t_us in range(20) for name in "abc"])
    found = [fitting(columns, position.test) for position in plan.positions]
    parts = [len(one[0]) for one in complete_rows(plan, found, most_rows=30)]
    assert sum(parts) == sum(1 for a, b, c in product(range(20), repeat=3) if a <= b <= c)
    assert max(parts) <= 30


@pytest.mark.parametrize(
    ("pattern", "fitting_rows"),
    [
        ("p[?x]:(?, on)", [0, 2, 3]),
        ("p[c1]:(?, ?)", [0, 2, 3]),
        ("p[?x]:(unknown, ?)", [2, 3]),
        ("p[?x]:(?v, ?)", [0, 2, 3]),
        ("p[c9]:(?, ?)", []),
        ("r[?x]", []),
    ],
)
def test_rows_that_fit_a_pattern(pattern: str, fitting_rows: list[int]) -> None:
    [plan] = load(f"chronicle one[] {{ event({pattern}, t1) }}").plans
    changes = [("off", "on"), ("on", "on"), (None, "on"), ("", "on")]
    columns = EventColumns.from_events([Event("p", ("c1",), t_us, *change) for t_us, change in enumerate(changes)])
    assert fitting(columns, plan.positions[0].test).rows.tolist() == fitting_rows


def test_values_of_a_filter_are_compared_as_texts() -> None:
    [plan] = load("chronicle one[?x] { event(b[?x], t1) ?x in {c1, c3} }").plans
    columns = EventColumns.from_events([Event("b", (name,), 0) for name in ("c2", "c1", "c3", "c1")])
    assert fitting(columns, plan.positions[0].test).rows.tolist() == [1, 2, 3]


def test_windows_of_an_index_are_closed_and_within_the_values() -> None:
    codes = np.array([4, 9, 4, 4], np.int32)
    index = RowIndex(np.array([0, 5, 10, 20]), [codes])
    wanted = np.array([4, 4, 4, 9, 7, 99], np.int32)
    low_us, high_us = np.array([0, 1, -50, 0, 0, 0]), np.array([10, 9, 99, 4, 99, 99])
    assert index.partners([wanted], low_us, high_us).counts.tolist() == [2, 0, 3, 0, 0, 0]


@pytest.mark.parametrize("most", [1 << 40, 1], ids=["all combinations", "those that occur"])
def test_equal_combinations_of_values_get_equal_numbers(most: int) -> None:
    random = np.random.default_rng(1)
    own = [random.integers(6, size=40).astype(np.int32) for _ in range(3)]
    asked = [random.integers(8, size=300).astype(np.int32) for _ in range(3)]
    numbering = Numbering(own, most)
    rows = list(zip(*own, strict=True))
    number_of = dict(zip(rows, numbering.own.tolist(), strict=True))
    assert len(set(number_of.values())) == len(set(rows))
    assert max(number_of.values()) < numbering.count
    occurring = set(number_of.values())
    for row, number in zip(zip(*asked, strict=True), numbering.numbers(asked).tolist(), strict=True):
        assert number == number_of[row] if row in number_of else number not in occurring


def test_times_too_far_apart_for_exact_numbers_are_refused() -> None:
    with pytest.raises(ChronicleError, match="row index: expected less than"):
        RowIndex(np.array([0, 1 << 62]), [np.array([0, 0], np.int32)])


def test_far_apart_times_are_joined_in_blocks() -> None:
    [plan] = load("chronicle two[?x] { event(b[?x], t1) event(b[?x], t2) t2 - t1 in [1us, 5us] }").plans
    far_us = (1 << 60) - 9
    columns = EventColumns.from_events(
        [Event("b", ("c1",), t_us) for t_us in (-far_us, 2 - far_us, far_us, far_us + 9)]
    )
    assert find_matches(plan, columns, most_rows=1 << 17, most_matches=9).rows.tolist() == [[0], [1]]


def test_a_count_leaves_out_events_equal_to_either_of_two_other_things() -> None:
    text = """
    message b[?x] message go[?x, ?y]
    chronicle clear[?x, ?y] { event(go[?x, ?y], t1) noevent(b[?z], (t1, t1 + 5us)) }
    """
    events = [Event("go", ("u", "v"), t_us) for t_us in (0, 10, 20)]
    events += [Event("b", (name,), t_us) for name, t_us in (("u", 1), ("v", 1), ("w", 11), ("u", 12), ("w", 25))]
    found = recognise(load(text), sorted(events, key=lambda event: event.t_us))
    assert [occurrence.start_us for occurrence in found] == [0, 20]
