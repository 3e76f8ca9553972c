"""How good is this log? A run's events against a scene's truth, and doubts, before anybody believes a score.

A log knows the name of its site and where its cars were. Against the truth of another scene every score is a row of
digits without meaning: the cars of one are not where the vehicles of the other are. And of times in which a moving
camera did not know where it looked, a run should tell no event.
"""

import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dyknow.language.diagnostics import near
from service.errors import TruthError
from service.questions.events.notes import run_notes
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.coverage import lost_views
from service.questions.observations.stored_events import chronicles_of
from service.questions.scoring.evaluate import (
    Evaluation,
    Positions,
    TrueEvent,
    evaluate_events,
    load_truth,
    positions_from_rows,
)
from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray, ground_pairs
from service.questions.scoring.truth_rows import nearest_times
from service.records.events import EventRecord
from service.records.runs import RunRecord
from service.records.seen import CarState
from service.store.log import EventLog, open_log

NEAR_M, LEAST_SHARE = 2.0, 0.7
"""Where a car was seen the truth has a vehicle so near; in so many cases at least, even if vision is poor."""
_LEAST_ROWS, _MOST_ROWS = 50, 2000


@dataclass(frozen=True, slots=True)
class LostViews:
    """Hold when the view was lost, and what was told of these times nevertheless.

    Attributes
    ----------
    losses_us : from when to when, half-open.
    told : identifiers of the events of which a part lies in one of them.
    events : how many events the run told in all.
    """

    losses_us: tuple[tuple[int, int], ...]
    told: tuple[str, ...]
    events: int

    @property
    def lost_s(self) -> float:
        """Return for how long the view was lost in all."""
        return sum(end_us - start_us for start_us, end_us in self.losses_us) / 1e6

    def as_record(self) -> dict[str, object]:
        """Return the figures as plain data, for JSON."""
        return {
            "losses": len(self.losses_us),
            "lost_s": self.lost_s,
            "events": self.events,
            "events_told": len(self.told),
            "told": list(self.told),
        }


def evaluate_log(url: str, truth_folder: Path, *, event_type: str, run: str | None = None) -> Evaluation:
    """Score the events of one type in one run.

    Parameters
    ----------
    url : the event log.
    truth_folder : where `truth.csv` and `truth_events.jsonl` of the same scene are.
    run : which run of the log; may be left out when there is only one.

    Raises
    ------
    LogError, TruthError
        If the log, the run or the truth cannot be read, or nobody knows the type.
    """
    return evaluate_log_types(url, truth_folder, event_types=(event_type,), run=run)[event_type]


def evaluate_log_types(
    url: str, truth_folder: Path, *, event_types: Sequence[str], run: str | None = None
) -> dict[str, Evaluation]:
    """Score the events of several types in one run; the log's cars and the truth are read once.

    Parameters
    ----------
    url, truth_folder, run : as in `evaluate_log`.
    event_types : the types to score.

    Returns
    -------
    The scores by type.

    Raises
    ------
    LogError, TruthError
        As `evaluate_log`.
    """
    truth, vehicles = load_truth(truth_folder)
    with open_log(url) as log:
        record = log.run(run)
        cars = _positions(list(log.states(record.id)))
        scores = {}
        for event_type in event_types:
            recognised = load_events(log, record.id, event_type)
            if not recognised:
                _check_type(event_type, record, truth)
            scores[event_type] = evaluate_events(recognised, cars, truth, vehicles, event_type=event_type)
        return scores


def _check_type(event_type: str, run: RunRecord, truth: Iterable[TrueEvent]) -> None:
    """Refuse a type that nobody knows: all its scores would be those of a scene without such events."""
    looked_for = {name for plan in chronicles_of(run).plans for name in (plan.name, *plan.produces)}
    known = sorted(looked_for | {event.type for event in truth})
    if event_type not in known:
        hint = near(event_type, known)
        raise TruthError(
            f"event type: expected one that the run's chronicles or the truth have ({', '.join(known)}), "
            f"got {event_type!r}{f'; {hint.text}' if hint else ''}"
        )


def load_events(log: EventLog, run_id: str, event_type: str) -> list[EventRecord]:
    """Read the recognised events of one type in one run, ordered by start."""
    wanted = EventFilter(types=(event_type,), runs=(run_id,))
    return [decode_event(text) for text in iterate_events(log, wanted)]


def _positions(states: Sequence[CarState]) -> Positions:
    return positions_from_rows(
        [state.t_us for state in states],
        [state.car for state in states],
        [(state.x_m, state.y_m) for state in states],
    )


def scene_doubts(url: str, truth_folder: Path, *, run: str | None = None) -> tuple[str, ...]:
    """Say what speaks against scoring what a run saw by the truth in a folder.

    Parameters
    ----------
    url : the event log.
    truth_folder : where `truth.csv` is.
    run : which run of the log; may be left out when there is only one.

    Returns
    -------
    A message for each doubt; none if the two belong together as far as they tell, and the run came to its end.

    Raises
    ------
    LogError, TruthError
        If the log, the run or the truth cannot be read.
    """
    _, vehicles = load_truth(truth_folder)
    with open_log(url) as log:
        record = log.run(run)
        seen = [state for state in log.states(record.id) if state.linked]
        cut = tuple(run_notes([log], EventFilter(runs=(record.id,))))
    cars = _positions(seen)
    return (*cut, *_doubts_by_name(record, truth_folder), *_doubts_by_place(record, cars, vehicles, truth_folder))


def _doubts_by_name(record: RunRecord, folder: Path) -> Iterator[str]:
    try:
        name = tomllib.loads((folder / "site.toml").read_text(encoding="utf-8-sig")).get("name", "")
    except (OSError, ValueError):
        return  # The truth may come without its scene.
    if record.site and name and name != record.site:
        yield f"{folder}: expected the truth of the site that the run was given, {record.site!r}, got that of {name!r}"


def _doubts_by_place(record: RunRecord, cars: Positions, vehicles: Positions, folder: Path) -> Iterator[str]:
    if len(cars.ids) < _LEAST_ROWS:
        return
    rows = np.unique(np.linspace(0, len(cars.ids) - 1, _MOST_ROWS).astype(np.int64))
    known, near = _nearness(cars.t_us[rows], cars.centre_m[rows], vehicles)
    if known.mean() < LEAST_SHARE:
        span = f"{vehicles.t_us[0] / 1e6:.2f} s to {vehicles.t_us[-1] / 1e6:.2f} s"
        came = f"{cars.t_us[0] / 1e6:.2f} s to {cars.t_us[-1] / 1e6:.2f} s"
        yield f"{folder}: expected a truth for the times at which run {record.id} saw cars, {came}, got one for {span}"
    elif near[known].mean() < LEAST_SHARE:
        yield (
            f"{folder}: expected a vehicle of the truth within {NEAR_M:g} m of most cars that run {record.id} saw, "
            f"got one at {near[known].mean():.0%} of them: is it the truth of this scene?"
        )


def _nearness(t_us: IntArray, centre_m: FloatArray, vehicles: Positions) -> tuple[BoolArray, BoolArray]:
    """Tell of each row whether the truth knows its time, and whether it has a vehicle near it then."""
    times_us, vehicle_time = np.unique(vehicles.t_us, return_inverse=True)
    time = nearest_times(t_us, times_us, within_steps=1.0)
    pairs = ground_pairs(time, centre_m, vehicle_time.astype(np.int64), vehicles.centre_m, reach_m=NEAR_M)
    return time >= 0, np.isin(np.arange(len(t_us)), pairs.true_row)


def find_lost_views(url: str, *, run: str | None = None) -> LostViews | None:
    """Count the events that a run tells of times in which its view was lost.

    Parameters
    ----------
    url : the event log.
    run : which run of the log; may be left out when there is only one.

    Returns
    -------
    The counts; None for a run whose camera did not move.

    Raises
    ------
    LogError
        If the log or the run cannot be read.
    """
    with open_log(url) as log:
        run_id = log.run(run).id
        losses_us = lost_views(log, run_id)
        if losses_us is None:
            return None
        events = [decode_event(text) for text in iterate_events(log, EventFilter(runs=(run_id,)))]
    told = tuple(
        event.id  # what ends with the first moment of a loss lies not in it
        for event in events
        if any(event.start_us < to_us and event.end_us > from_us for from_us, to_us in losses_us)
    )
    return LostViews(losses_us, told, len(events))
