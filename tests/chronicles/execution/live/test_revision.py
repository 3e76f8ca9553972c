"""What is recognised when hypotheses are decided and events come late, against the stored executor on what stands."""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from random import Random

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event, Occurrence, OccurrenceKey
from chronicles.recogniser import Recogniser, recognise
from tests.cases import seeds
from tests.chronicles.execution.case_runner import FAR_US, Case, make_case

LABELS = ("h1", "h2", "h3")
VERDICTS = ("refuted", "confirmed", "undecided")
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
    assert recogniser.open_hypotheses == {}


def test_same_event_told_twice_may_be_taken_back_once() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0))
    recogniser.observe(Event("start", ("u",), 0))
    found = recogniser.observe(Event("goal", ("u",), 5, hypotheses=("h1",)))
    assert statuses(found) == ["tentative", "tentative"]
    assert statuses(recogniser.retract("h1")) == ["retracted", "retracted"]


def test_occurrence_before_what_falls_is_confirmed_in_the_same_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chronicles.execution.live.revision._STATE_EVERY", 1)
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    assert statuses(recogniser.observe(Event("goal", ("u",), 5))) == ["tentative"]
    recogniser.observe(Event("start", ("v",), 6, hypotheses=("h2",)))
    recogniser.observe(Event("goal", ("v",), 7))
    told = recogniser.revise(refuted=["h2"], confirmed=["h1"])
    assert [(one.status, one.roles["x"]) for one in told] == [("retracted", "v"), ("confirmed", "u")]


def test_nothing_is_kept_of_what_can_no_longer_be_taken_back() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    recogniser.observe(Event("goal", ("u",), 5))
    recogniser.confirm("h1")
    revision = recogniser._revision
    assert revision is not None
    assert (revision._journal, revision._states, revision._found) == ([], [], [])


class Standing:
    """What a reader of the results believes."""

    def __init__(self) -> None:
        self.found: Counter[OccurrenceKey] = Counter()
        self.tentative: Counter[OccurrenceKey] = Counter()

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
    def all(self) -> Counter[OccurrenceKey]:
        return +(self.found + self.tentative)


def bare(occurrence: Occurrence) -> OccurrenceKey:
    chronicle, roles, sub_events, events = occurrence.key
    return chronicle, roles, sub_events, tuple(replace(event, hypotheses=()) for event in events)


def with_hypotheses(steps: list[Event | int], random: Random) -> list[Event | int]:
    """Let most of the events rest on one or two hypotheses."""
    return [
        replace(step, hypotheses=tuple(random.sample(LABELS, random.choice((1, 1, 2)))))
        if isinstance(step, Event) and random.random() < 0.6
        else step
        for step in steps
    ]


def delayed(
    steps: list[Event | int], said: int, since_us: int, random: Random
) -> tuple[list[Event | int], list[Event]]:
    """Tell some of the events from a time on much later; give the new order, and these events."""
    late = {
        number
        for number, step in enumerate(steps)
        if number >= said and isinstance(step, Event) and step.t_us >= since_us and random.random() < 0.5
    }
    # None comes earlier than it would, which would make others late.
    places = [random.randint(number, len(steps)) if number in late else number for number in range(len(steps))]
    order = sorted(range(len(steps)), key=places.__getitem__)
    return [steps[number] for number in order], [one for one in map(steps.__getitem__, late) if isinstance(one, Event)]


def batches(steps: list[Event | int], random: Random) -> list[list[Event | int]]:
    """Cut steps where frames end."""
    cut: list[list[Event | int]] = []
    for step in steps:
        if not cut or random.random() < 0.7:
            cut.append([])
        cut[-1].append(step)
    return cut


def check_case(seed: int, *, early: bool, patience_us: int) -> tuple[bool, bool]:
    """Tell late events, and decide hypotheses, at random times; say whether late and whether refuted events matter."""
    case, random = make_case(seed), Random(seed)
    chronicles, lateness_us = case.chronicles, case.lateness_us
    said = random.randrange(len(case.steps))
    clock_us = max([step if isinstance(step, int) else step.t_us for step in case.steps[:said]], default=lateness_us)
    since_us = clock_us - random.randint(0, lateness_us)
    steps, late = delayed(with_hypotheses(case.steps, random), said, since_us, random)
    verdicts = {label: random.choice(VERDICTS) for label in (*LABELS, "late")}
    # Mostly in the second half, when there is something to take back.
    moments = {label: random.choice((random.randrange(len(steps)), len(steps) - 1)) for label in LABELS}
    moments["late"] = len(steps) - 1
    recogniser = Recogniser(chronicles, lateness_us, early=early, patience_us=patience_us)
    standing, index = Standing(), 0
    for batch in batches(steps, random):
        places = range(index, index + len(batch))
        index += len(batch)
        refuted, confirmed, undecided = (
            [one for one, at in moments.items() if verdicts[one] == verdict and at in places] for verdict in VERDICTS
        )
        found = recogniser.revise(
            opened=[("late", since_us)] if said in places else [],
            refuted=refuted,
            confirmed=confirmed,
            undecided=undecided,
            events=[step for step in batch if isinstance(step, Event)],
        )
        for step in batch:
            found += recogniser.advance(step if isinstance(step, int) else step.t_us)
        assert early or {one.status for one in found} <= {"recognised", "tentative"}
        standing.read(found)
        if random.random() < 0.05:
            checkpoint = json.loads(json.dumps(recogniser.checkpoint()))
            recogniser = Recogniser(chronicles, lateness_us, early=early, patience_us=patience_us)
            recogniser.restore(checkpoint)
    told = [step for step in steps if isinstance(step, Event)]
    stands = [one for one in told if not any(verdicts[label] == "refuted" for label in one.hypotheses)]
    expected = occurring(case, stands)
    undecided = {label for label, verdict in verdicts.items() if verdict == "undecided"}
    tentative = Counter(key[:3] for key in standing.tentative.elements())
    assert tentative <= doubtful(case, stands, undecided), (case.text, lateness_us, steps, verdicts, moments)
    assert recogniser.late_count == 0
    assert standing.all == expected, (case.text, lateness_us, steps, verdicts, moments)
    assert told_at_once(case, told, since_us, verdicts, early=early).all == expected, (case.text, steps, verdicts)
    in_time = [one for one in stands if not any(one is other for other in late)]
    return expected != occurring(case, in_time), expected != occurring(case, told)


def told_at_once(case: Case, events: list[Event], since_us: int, verdicts: dict[str, str], *, early: bool) -> Standing:
    """Tell all events and verdicts in one frame."""
    recogniser, standing = Recogniser(case.chronicles, case.lateness_us, early=early), Standing()
    refuted, confirmed, undecided = ([one for one in verdicts if verdicts[one] == verdict] for verdict in VERDICTS)
    opened = [("late", since_us)]
    standing.read(
        recogniser.revise(opened=opened, refuted=refuted, confirmed=confirmed, undecided=undecided, events=events)
    )
    standing.read(recogniser.advance(FAR_US))
    return standing


def occurring(case: Case, events: Iterable[Event]) -> Counter[OccurrenceKey]:
    """Give what the stored executor finds."""
    found = recognise(case.chronicles, [replace(one, hypotheses=()) for one in events], until_us=FAR_US)
    return Counter(map(bare, found))


def doubtful(case: Case, events: Iterable[Event], undecided: set[str]) -> Counter[object]:
    """Give what the stored executor finds on the word of hypotheses that nobody will ever know."""
    found = recognise(case.chronicles, list(events), until_us=FAR_US)
    return Counter(one.key[:3] for one in found if not undecided.isdisjoint(one.hypotheses))


@pytest.mark.long
@seeds(range(400), kept=40)
@pytest.mark.parametrize(
    ("early", "patience_us"), [(True, 0), (True, 5), (False, 0)], ids=["early", "patient", "final"]
)
def test_recogniser_of_late_and_refuted_events_ends_where_the_stored_executor_does(
    seeds: range, early: bool, patience_us: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # So few that replays start in the middle of these short streams.
    monkeypatch.setattr("chronicles.execution.live.revision._STATE_EVERY", 2)
    monkeypatch.setattr("chronicles.execution.live.revision._STATES_KEPT", 4)
    came, fell = zip(*(check_case(seed, early=early, patience_us=patience_us) for seed in seeds), strict=True)
    # Cases in which nothing that is late or refuted changes anything would prove nothing.
    assert min(sum(came), sum(fell)) >= len(seeds) // 20
