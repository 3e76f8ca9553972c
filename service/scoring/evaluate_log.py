"""How good is this log? Read a run's events and cars, and score them against a scene's truth."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from dyknow.language.diagnostics import near
from service.errors import TruthError
from service.questions.queries import EventFilter, decode_event, iterate_events
from service.records import RunRecord
from service.scoring.evaluate import (
    Evaluation,
    Positions,
    RecognisedEvent,
    TrueEvent,
    evaluate_events,
    load_truth,
    positions_from_rows,
)
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import chronicles_of


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
        cars = _car_positions(log, record.id)
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


def load_events(log: EventLog, run_id: str, event_type: str) -> list[RecognisedEvent]:
    """Read the recognised events of one type in one run, ordered by start."""
    wanted = EventFilter(types=(event_type,), runs=(run_id,))
    events = (decode_event(text) for text in iterate_events(log, wanted))
    return [RecognisedEvent(one.id, one.type, one.roles, one.start_us, one.end_us) for one in events]


def _car_positions(log: EventLog, run_id: str) -> Positions:
    states = list(log.states(run_id))
    return positions_from_rows(
        [state.t_us for state in states],
        [state.car for state in states],
        [(state.x_m, state.y_m) for state in states],
    )
