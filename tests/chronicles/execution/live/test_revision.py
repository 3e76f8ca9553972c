"""What is recognised after hypotheses were confirmed and refuted, against a recogniser that never saw the refuted."""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from random import Random

from chronicles.chronicle_set import load
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from tests.cases import seeds
from tests.chronicles.execution.case_runner import make_case

LABELS = ("h1", "h2", "h3")
RACE = "chronicle race[?x](t1, t2) { event(start[?x], t1) event(goal[?x], t2) t2 - t1 in [0s, 9s] }"
ALONE = "chronicle alone[?x](t1) { event(a[?x], t1) noevent(b[?x], (t1, t1 + 5us)) }"


def statuses(occurrences: Iterable[Occurrence]) -> list[str]:
    return [one.status for one in occurrences]


def test_occurrence_is_tentative_until_its_last_hypothesis_is_confirmed() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    assert statuses(recogniser.observe(Event("goal", ("u",), 5, hypotheses=("h2",)))) == ["tentative"]
    assert recogniser.confirm("h1") == []
    assert statuses(recogniser.confirm("h2")) == ["confirmed"]


def test_occurrence_of_confirmed_events_is_recognised_at_once() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    recogniser.confirm("h1")
    assert statuses(recogniser.observe(Event("goal", ("u",), 5, hypotheses=("h1",)))) == ["recognised"]


def test_refuted_hypothesis_takes_its_occurrences_back() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    recogniser.observe(Event("start", ("u",), 1))
    recogniser.observe(Event("goal", ("u",), 5))
    [fallen] = recogniser.retract("h1")
    assert (fallen.status, fallen.start_us) == ("retracted", 0)


def test_refuted_hypothesis_lets_appear_what_its_events_had_prevented() -> None:
    recogniser = Recogniser(load(ALONE))
    recogniser.observe(Event("a", ("u",), 0))
    recogniser.observe(Event("b", ("u",), 2, hypotheses=("h1",)))
    assert recogniser.advance(9) == []
    [found] = recogniser.retract("h1")
    assert (found.status, found.recognised_us) == ("recognised", 9)


def test_hold_makes_an_occurrence_rest_on_the_change_that_set_the_value() -> None:
    text = "chronicle c[?x](t1) { event(a[?x], t1) hold(p[?x]:on, (t1 - 2us, t1)) }"
    recogniser = Recogniser(load(text))
    recogniser.observe(Event("p", ("u",), 0, "off", "on", hypotheses=("h1",)))
    [found] = recogniser.observe(Event("a", ("u",), 9))
    assert (found.status, found.hypotheses) == ("tentative", ("h1",))


def test_event_of_a_refuted_hypothesis_is_left_out_when_it_comes_later() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0))
    recogniser.retract("h1")
    assert recogniser.observe(Event("goal", ("u",), 5, hypotheses=("h1",))) == []


def test_hypotheses_of_no_event_change_nothing() -> None:
    recogniser = Recogniser(load(RACE))
    assert recogniser.confirm("h1") == []
    assert recogniser.retract("h2") == []
    assert recogniser.open_hypotheses == frozenset()


def test_same_event_told_twice_may_be_taken_back_once() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0))
    recogniser.observe(Event("start", ("u",), 0))
    found = recogniser.observe(Event("goal", ("u",), 5, hypotheses=("h1",)))
    assert statuses(found) == ["tentative", "tentative"]
    assert statuses(recogniser.retract("h1")) == ["retracted", "retracted"]


def test_nothing_is_kept_of_what_can_no_longer_be_taken_back() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    recogniser.observe(Event("goal", ("u",), 5))
    recogniser.confirm("h1")
    revision = recogniser._revision
    assert revision is not None
    assert not revision._journal
    assert list(revision._standing) == []


class Standing:
    """What a reader of the results believes."""

    def __init__(self) -> None:
        self.found: Counter[object] = Counter()
        self.tentative: Counter[object] = Counter()

    def read(self, occurrences: Iterable[Occurrence]) -> None:
        for one in occurrences:
            key = bare(one)
            match one.status:
                case "recognised":
                    self.found[key] += 1
                case "tentative":
                    self.tentative[key] += 1
                case "confirmed":
                    assert self.tentative[key] > 0
                    self.tentative[key] -= 1
                    self.found[key] += 1
                case "retracted":
                    assert self.found[key] + self.tentative[key] > 0
                    source = self.tentative if self.tentative[key] else self.found
                    source[key] -= 1

    @property
    def all(self) -> Counter[object]:
        return +(self.found + self.tentative)


def bare(occurrence: Occurrence) -> object:
    chronicle, roles, sub_events, events = occurrence.key
    return chronicle, roles, sub_events, tuple(replace(event, hypotheses=()) for event in events)


def with_hypotheses(steps: list[Event | int], random: Random) -> list[Event | int]:
    """Let a third of the events rest on one or two hypotheses."""
    return [
        replace(step, hypotheses=tuple(random.sample(LABELS, random.choice((1, 1, 2)))))
        if isinstance(step, Event) and random.random() < 0.6
        else step
        for step in steps
    ]


def without(steps: list[Event | int], refuted: set[str]) -> list[Event | int]:
    """Leave only the time of refuted events."""
    return [
        step.t_us
        if isinstance(step, Event) and refuted.intersection(step.hypotheses)
        else replace(step, hypotheses=())
        if isinstance(step, Event)
        else step
        for step in steps
    ]


def resolve(recogniser: Recogniser, label: str, refuted: set[str]) -> list[Occurrence]:
    return recogniser.retract(label) if label in refuted else recogniser.confirm(label)


def check_case(seed: int) -> int:
    """Refute and confirm hypotheses at random times; give the number of occurrences taken back or let appear."""
    case, random = make_case(seed), Random(seed)
    chronicles, lateness_us = case.chronicles, case.lateness_us
    steps = with_hypotheses(case.steps, random)
    refuted = {label for label in LABELS if random.random() < 0.5}
    # Mostly in the second half, when there is something to take back.
    moments = {label: random.choice((random.randrange(len(steps)), len(steps) - 1)) for label in LABELS}
    recogniser = Recogniser(chronicles, lateness_us)
    standing, revised = Standing(), 0
    for index, step in enumerate(steps):
        standing.read(recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step))
        for label in (label for label, moment in moments.items() if moment == index):
            found = resolve(recogniser, label, refuted)
            revised += sum(one.status != "confirmed" for one in found)
            standing.read(found)
        if random.random() < 0.05:
            checkpoint = json.loads(json.dumps(recogniser.checkpoint()))
            recogniser = Recogniser(chronicles, lateness_us)
            recogniser.restore(checkpoint)
    plain, expected = Recogniser(chronicles, lateness_us), Standing()
    for step in without(steps, refuted):
        expected.read(plain.advance(step) if isinstance(step, int) else plain.observe(step))
    assert not +standing.tentative
    assert standing.all == expected.all, (case.text, steps, refuted, moments)
    assert [replace(one, hypotheses=()) for one in recogniser.partial_instances()] == list(plain.partial_instances())
    return revised


@seeds(range(400), kept=100)
def test_recogniser_after_retraction_equals_one_that_never_saw_the_events(seeds: range) -> None:
    revised = [check_case(seed) for seed in seeds]
    # Cases in which no retraction changes anything would prove nothing.
    assert sum(map(bool, revised)) >= len(seeds) // 20
