"""How sure an occurrence is: as its weakest event, by both executors, through checkpoints and revisions."""

import json

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event, Occurrence
from chronicles.execution.told import confidence
from chronicles.execution.told.confidence import calibrated, confidence_of
from chronicles.recogniser import Recogniser, recognise

S = 1_000_000
STAY = load("chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [1s, 9s] }")
TOLD = load(
    "chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [1s, 9s] "
    "confidence >= 0.8 when recognised { emit stayed[?car] } } "
    "chronicle seen[?car](t1) { event(stayed[?car], t1) }"
)


def events(*confidences: float, hypotheses: tuple[str, ...] = ()) -> list[Event]:
    times_us = (1 * S, 5 * S)
    return [
        Event(name, ("a",), t_us, hypotheses=hypotheses, confidence=confidence)
        for name, t_us, confidence in zip(("enter", "leave"), times_us, confidences, strict=True)
    ]


def by_both(confidences: tuple[float, float]) -> list[Occurrence]:
    live = recognise(STAY, events(*confidences), executor="eager")
    stored = recognise(STAY, events(*confidences), executor="backfill")
    assert list(live) == list(stored)
    return list(live)


@pytest.mark.parametrize("confidences", [(0.9, 0.6), (0.6, 0.9), (0.6, 1.0)])
def test_occurrence_is_as_sure_as_its_weakest_event(confidences: tuple[float, float]) -> None:
    [found] = by_both(confidences)
    assert found.confidence == pytest.approx(calibrated(0.6))


def test_what_says_nothing_of_itself_is_sure() -> None:
    [found] = by_both((1.0, 1.0))
    assert found.confidence == 1.0


def test_occurrence_near_a_bound_is_less_sure() -> None:
    bounds_us = [[0, 9 * S], [-1 * S, 0]]
    far, near, at = (confidence_of(events(0.9, 0.9), [0, t_us], bounds_us) for t_us in (5 * S, S + 50_000, S))
    assert (far, at) == (pytest.approx(0.9), pytest.approx(0.45))
    assert at < near < far


@pytest.mark.parametrize(("name", "value"), [("TIME_SIGMA_US", 120_000), ("OFFSET_NATS", 1.2), ("SLOPE", 1.72)])
def test_every_number_is_noticed(name: str, value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    def told() -> float:
        return calibrated(confidence_of(events(0.9, 0.9), [0, S + 50_000], [[0, 9 * S], [-1 * S, 0]]))

    before = told()
    monkeypatch.setattr(confidence, name, value)
    assert told() != before


def test_calibration_keeps_the_order() -> None:
    said = [calibrated(share / 50) for share in range(51)]
    assert said == sorted(said)


def test_emitted_event_is_as_sure_as_what_emits_it_whatever_the_floor() -> None:
    found = {one.chronicle: one for one in recognise(TOLD, events(0.5, 0.9), until_us=9 * S)}
    assert found["stay"].floor == 0.8 > found["stay"].confidence
    assert found["seen"].floor == 0.0
    assert found["seen"].confidence == found["stay"].confidence


def test_checkpoint_keeps_how_sure_held_events_are() -> None:
    enter, leave = events(0.6, 0.9)
    first, second = Recogniser(STAY), Recogniser(STAY)
    first.observe(enter)
    second.restore(json.loads(json.dumps(first.checkpoint())))
    [found] = second.observe(leave)
    assert found.confidence == pytest.approx(calibrated(0.6))


def test_confirmed_and_retracted_states_are_as_sure_as_the_tentative_one() -> None:
    for verdict in ("confirmed", "refuted"):
        recogniser = Recogniser(STAY)
        told = [found for event in events(0.6, 0.9, hypotheses=("h",)) for found in recogniser.observe(event)]
        told += recogniser.revise(**{verdict: ["h"]})
        assert [one.status for one in told] == ["tentative", "retracted" if verdict == "refuted" else "confirmed"]
        assert {one.confidence for one in told} == {told[0].confidence}
