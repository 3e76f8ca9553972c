"""The backfill against a recogniser fed event by event, and how its results are looked at."""

from collections import Counter
from collections.abc import Sequence

import pytest

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.execution.limits import Limits
from chronicles.execution.stored.backfill import FoundOccurrences, recognise_columns
from chronicles.execution.stored.columns import EventColumns
from chronicles.execution.stored.matches import TooManyMatches
from chronicles.recogniser import Recogniser, recognise
from tests.cases import seeds
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.support import shown, steps, us

MOST_ROWS = (1, 2, 5, 1 << 17)
VISIT = """
message enter[?car] message leave[?car]
chronicle visit[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [1s, 1min] }
"""


def event_by_event(chronicles: ChronicleSet, events: Sequence[Event], until_us: int | None) -> list[Occurrence]:
    recogniser = Recogniser(chronicles)
    found: list[Occurrence] = []
    for event in sorted(events, key=lambda event: event.t_us):
        found += recogniser.observe(event)
    return found if until_us is None else [*found, *recogniser.advance(until_us)]


def backfill(text: str, stream: str, until: str = "0s") -> Sequence[Occurrence]:
    events = [step for step in steps(stream) if isinstance(step, Event)]
    return recognise_columns(load(text), EventColumns.from_events(events), until_us=us(until))


def random_set(seed: int) -> tuple[CaseMaker, ChronicleSet]:
    maker = CaseMaker(seed)
    while True:
        try:
            return maker, load(maker.text())
        except ChronicleError:
            continue


def check_case(seed: int) -> int:
    maker, chronicles = random_set(seed)
    trace = maker.trace()
    until_us = maker.random.choice((None, 3, 30, 1000))
    columns = EventColumns.from_events(trace)
    found = recognise_columns(chronicles, columns, until_us=until_us, most_rows=maker.random.choice(MOST_ROWS))
    expected = event_by_event(chronicles, trace, until_us)
    assert list(found) == expected, seed
    assert len(found) == len(expected)
    return len(expected)


def test_beyond_the_limits_the_recogniser_says_what_is_left_out() -> None:
    text = "chronicle four[?c](t1, t2, t3, t4) { " + " ".join(f"event(ping[?c], t{k})" for k in (1, 2, 3, 4))
    text += " ".join(f" t{k + 1} - t{k} in [1us, 1min]" for k in (1, 2, 3)) + " }"
    events = [Event("ping", ("car1",), us(f"{k}s")) for k in range(9)]
    bounded, unbounded = Limits(most_matches=20), Limits(most_matches=56)  # the last one completes C(8, 3)
    counts: Counter[str] = Counter()
    found = recognise(load(text), events, limits=bounded, left_out=counts)
    assert list(found) == recognise(load(text), events, limits=bounded, executor="eager")
    assert len(found) + counts["four"] == len(recognise(load(text), events, limits=unbounded)) == 126
    assert counts["four"] == (35 - 20) + (56 - 20)
    with pytest.raises(TooManyMatches):
        recognise_columns(load(text), EventColumns.from_events(events), limits=bounded, most_rows=7)


@seeds(range(800), kept=80)
def test_gives_what_a_recogniser_gives_in_the_same_order(seeds: range) -> None:
    found = [check_case(seed) for seed in seeds]
    # Cases without occurrences would prove nothing.
    assert sum(map(bool, found)) >= len(seeds) // 10


def test_several_chronicles_are_told_in_the_order_of_time_and_of_their_places() -> None:
    text = """
    chronicle second[](t1) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 9s] }
    chronicle first[](t1) { event(b[], t1) }
    chronicle waiting[](t1) { event(a[], t1) noevent(c[], (t1, t1 + 4s)) }
    """
    events = "1s a[]\n3s b[]\n3s b[]\n6s d[]"
    told = ["second[] 1s..1s", "first[] 3s..3s", "second[] 1s..1s", "first[] 3s..3s", "waiting[] 1s..1s"]
    assert shown(list(backfill(text, events))) == told


def test_absence_is_told_with_the_first_event_behind_it_or_when_time_goes_on() -> None:
    text = "chronicle alone[](t1) { event(a[], t1) noevent(b[], (t1, t1 + 4s)) }"
    assert [one.recognised_us for one in backfill(text, "1s a[]\n8s d[]\n9s d[]")] == [us("8s")]
    assert [one.recognised_us for one in backfill(text, "1s a[]\n4s d[]", "7s")] == [us("7s")]
    assert len(backfill(text, "1s a[]\n4s d[]", "4.9s")) == 0


def test_events_emitted_behind_the_end_of_time_are_not_seen() -> None:
    text = """
    chronicle early[](t1) { event(a[], t1) when recognised { emit event(soon[], t1 + 5s) } }
    chronicle later[](t1) { event(soon[], t1) }
    """
    assert shown(list(backfill(text, "1s a[]\n3s b[]"))) == ["early[] 1s..1s"]
    assert shown(list(backfill(text, "1s a[]\n3s b[]", "6s"))) == ["early[] 1s..1s", "later[] 6s..6s"]


def test_an_empty_set_and_empty_columns_give_nothing() -> None:
    assert backfill("message a[]", "1s a[]") == []
    assert backfill(VISIT, "") == []


def test_number_is_known_before_any_occurrence_is_built(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise AssertionError("nothing was asked for yet")

    monkeypatch.setattr(FoundOccurrences, "built", fail)
    assert len(backfill(VISIT, "1s enter[a]\n2s enter[b]\n3s leave[b]\n4s leave[a]")) == 2


def test_what_one_event_completes_is_told_in_the_order_of_values_wherever_it_is_cut(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("chronicles.execution.stored.backfill._MATCHES_AT_A_TIME", 2)
    text = "chronicle both[?x](t1, t2) { event(enter[?x], t1) event(end[], t2) t2 - t1 in [1s, 9s] }"
    found = backfill(text, "1s enter[c]\n2s enter[a]\n3s enter[b]\n4s end[]\n5s end[]")
    assert [(one.roles["x"], one.end_us // 1_000_000) for one in found] == [(x, t) for t in (4, 5) for x in "abc"]
    assert [found[place].roles["x"] for place in range(6)] == list("abcabc")
    assert [one.roles["x"] for one in found[4:1:-1]] == ["b", "a", "c"]


HELD = """
attribute light[?post] { value in {red, green}; default red }
message pass[?post]
chronicle ran[?post](t1) { event(pass[?post], t1) hold(light[?post]:red, (t1 - 2s, t1 + 1s)) }
"""


@pytest.mark.parametrize(
    ("changes", "passed"),
    [
        ("", True),
        ("3s light[p] red -> green", False),
        ("4s light[p] red -> green", False),
        ("6s light[p] red -> green", True),
        ("1s light[p] red -> green\n3s light[p] green -> red", True),
        ("1s light[p] red -> green\n3.5s light[p] green -> red", False),
        ("1s light[p] red -> green\n1s light[p] green -> red", True),
        ("4s light[p] unknown -> red", True),
        ("4s light[q] red -> green", True),
        ("2s light[p] red -> unknown", False),
    ],
)
def test_hold_is_tested(changes: str, passed: bool) -> None:
    stream = f"{changes}\n5s pass[p]\n9s pass[other]".strip()
    found = backfill(HELD, stream, "9s")
    assert [one.roles["post"] for one in found] == (["p"] if passed else [])
    ordered = sorted((one for one in steps(stream) if isinstance(one, Event)), key=lambda event: event.t_us)
    assert list(found) == event_by_event(load(HELD), ordered, us("9s"))


def test_hold_names_the_hypotheses_of_its_changes() -> None:
    events = [
        Event("light", ("p",), 1, "green", "red", hypotheses=("h1",)),
        Event("pass", ("p",), us("5s")),
        Event("pass", ("q",), us("7s")),
    ]
    found = recognise_columns(load(HELD), EventColumns.from_events(events))
    assert [one.hypotheses for one in found] == [("h1",)]
    assert list(found) == event_by_event(load(HELD), events, None)


def test_places_and_slices_of_the_results() -> None:
    found = backfill(VISIT, "\n".join(f"{i}s enter[c{i}]\n{i + 20}s leave[c{i}]" for i in range(9)))
    everything = list(found)
    assert found[0] == everything[0]
    assert found[-2] == everything[-2]
    assert list(found[2:7:2]) == everything[2:7:2]
    assert found == everything
    assert found != everything[:-1]
    with pytest.raises(IndexError):
        found[9]
