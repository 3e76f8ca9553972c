"""How good is a log? Recognised events against the truth of the same scene.

A recognised event is *right* when its vehicles are the truth's, role by role, and both ends of the intervals agree
within two seconds. (Of a near miss neither role says anything: there the pair is enough.) The vehicles of a log are
symbols of its own, so each role is first matched to the true vehicle that was nearest while the event went on. Truth
that is not countable (cut by the view, say) is *border*: recognising it is neither right nor wrong, and at any time
that overlaps it within as much.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from data_gen.truth.event import INTERCHANGEABLE, ROLES
from service.errors import TruthError
from service.questions.scoring.pairs import FloatArray
from service.questions.scoring.proportions import share, wilson_interval
from service.questions.scoring.truth_rows import read_truth
from service.records.events import EventRecord
from service.texts.chronicle_files import read_text

TOLERANCE_US = 2_000_000
NEAREST_M = 4.0
TOLD_TYPES = frozenset(ROLES)
"""Types that the truth of a generated scene tells of: if it has none, there was none."""


@dataclass(frozen=True, slots=True)
class TrueEvent:
    """Hold one event of the truth; ``roles`` maps role names to true vehicle identifiers."""

    type: str
    roles: Mapping[str, str]
    start_us: int
    end_us: int
    countable: bool


@dataclass(frozen=True, slots=True)
class Positions:
    """Hold where things were: one row an object and time, sorted by time.

    Attributes
    ----------
    t_us : (n,) int64. ids : n identifiers. centre_m : (n, 2).
    """

    t_us: NDArray[np.int64]
    ids: tuple[str, ...]
    centre_m: FloatArray


@dataclass(frozen=True, slots=True)
class Match:
    """Tie a recognised event to the true event it stands for."""

    recognised: EventRecord
    true: TrueEvent


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Hold the score of one event type.

    Attributes
    ----------
    right : matches with countable truth. border : matches with truth that does not count.
    wrong : recognised events without truth. missed : countable truth that was not recognised.
    unjudged : recognised events of a type that the truth does not tell of; they are all there is then.
    has_truth : whether the truth tells of the type at all.
    """

    type: str
    right: tuple[Match, ...]
    border: tuple[Match, ...]
    wrong: tuple[EventRecord, ...]
    missed: tuple[TrueEvent, ...]
    unjudged: tuple[EventRecord, ...] = ()
    has_truth: bool = True

    @property
    def in_truth(self) -> int:
        """Return how many events of the truth count."""
        return len(self.right) + len(self.missed)

    @property
    def precision(self) -> float | None:
        """Return right / (right + wrong); None when nothing was claimed."""
        return share(len(self.right), len(self.right) + len(self.wrong))

    @property
    def recall(self) -> float | None:
        """Return right / (right + missed); None when there was nothing to find."""
        return share(len(self.right), len(self.right) + len(self.missed))

    @property
    def f1(self) -> float | None:
        """Return the harmonic mean, 2 right / (2 right + wrong + missed); None when there was nothing at all."""
        right = 2 * len(self.right)
        return share(right, right + len(self.wrong) + len(self.missed))

    @property
    def mean_start_error_s(self) -> float:
        """Return the mean absolute error of the starts of right events, in seconds; nan without any."""
        return _mean_seconds([abs(match.recognised.start_us - match.true.start_us) for match in self.right])

    @property
    def mean_end_error_s(self) -> float:
        """Return the mean absolute error of the ends of right events, in seconds; nan without any."""
        return _mean_seconds([abs(match.recognised.end_us - match.true.end_us) for match in self.right])

    def as_record(self) -> dict[str, object]:
        """Return the figures as plain data, for JSON."""
        right, wrong, missed = len(self.right), len(self.wrong), len(self.missed)
        return {
            "type": self.type,
            "right": right,
            "wrong": wrong,
            "missed": missed,
            "border": len(self.border),
            "has_truth": self.has_truth,
            "unjudged": len(self.unjudged),
            "in_truth": self.in_truth,
            "precision": self.precision,
            "precision_interval": wilson_interval(right, right + wrong) if right + wrong else None,
            "recall": self.recall,
            "recall_interval": wilson_interval(right, right + missed) if right + missed else None,
            "f1": self.f1,
            "mean_start_error_s": None if not right else self.mean_start_error_s,
            "mean_end_error_s": None if not right else self.mean_end_error_s,
        }


def evaluate_events(
    recognised: Sequence[EventRecord],
    cars: Positions,
    truth: Sequence[TrueEvent],
    vehicles: Positions,
    *,
    event_type: str,
) -> Evaluation:
    """Score the events of one type.

    Parameters
    ----------
    recognised, cars : events and car symbols of the log.
    truth, vehicles : true events and true vehicles of the scene.
    event_type : the type to score, in the log and in the truth alike.

    Returns
    -------
    The score. Of a type that no event of the truth has and that is none of `TOLD_TYPES`, nobody can say whether the
    recognised events are right: they are *unjudged*.
    """
    claims = [event for event in recognised if event.type == event_type]
    facts = [event for event in truth if event.type == event_type]
    if not facts and event_type not in TOLD_TYPES:
        return Evaluation(event_type, (), (), (), (), unjudged=tuple(claims), has_truth=False)
    # Each role's car symbol stands for the true vehicle nearest to it during the event.
    roles = [
        {role: _nearest_vehicle(car, event, cars, vehicles) for role, car in event.roles.items()} for event in claims
    ]
    pairs = _assign(claims, roles, facts)
    matches = [Match(claims[i], facts[j]) for i, j in pairs]
    claimed, found = {i for i, _ in pairs}, {j for _, j in pairs}
    return Evaluation(
        type=event_type,
        right=tuple(match for match in matches if match.true.countable),
        border=tuple(match for match in matches if not match.true.countable),
        wrong=tuple(event for i, event in enumerate(claims) if i not in claimed),
        missed=tuple(event for j, event in enumerate(facts) if j not in found and event.countable),
    )


def load_truth(folder: Path) -> tuple[list[TrueEvent], Positions]:
    """Read ``truth_events.jsonl`` and ``truth.csv`` of a generated scene.

    Raises
    ------
    TruthError
        If a file is missing or a line of it cannot be read.
    """
    path = folder / "truth_events.jsonl"
    if not path.is_file():
        raise TruthError(f"{folder}: expected a truth folder with {path.name}, got none there")
    events = _load_true_events(path)
    t_us, names, centre_m = read_truth(folder, ("id",), ("x_m", "y_m"))
    return events, Positions(t_us, tuple(names[:, 0].tolist()), centre_m)


def _load_true_events(path: Path) -> list[TrueEvent]:
    events: list[TrueEvent] = []
    for number, line in enumerate(read_text(path, "truth file", TruthError).splitlines(), start=1):
        try:
            events.append(msgspec.json.decode(line, type=TrueEvent))
        except (msgspec.MsgspecError, RecursionError) as error:
            raise TruthError(
                f"{path}:{number}: expected a truth event as one JSON object, got {line[:80]!r}"
            ) from error
    return events


def positions_from_rows(t_us: Iterable[int], ids: Iterable[str], centre_m: Sequence[tuple[float, float]]) -> Positions:
    """Sort rows of positions by time."""
    times = np.fromiter(t_us, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    names = np.array(list(ids), dtype=object)[order]
    return Positions(times[order], tuple(names.tolist()), np.array(centre_m, dtype=np.float64).reshape(-1, 2)[order])


def _nearest_vehicle(car: str, event: EventRecord, cars: Positions, vehicles: Positions) -> str | None:
    """Find the vehicle that a car was during an event, or right before and after it if nobody saw the car meanwhile."""
    rows = _rows_between(cars, event.start_us, event.end_us)
    seen = [row for row in rows if cars.ids[row] == car]
    if not seen:
        before = (row for row in reversed(range(rows.start)) if cars.ids[row] == car)
        after = (row for row in range(rows.stop, len(cars.ids)) if cars.ids[row] == car)
        vehicle_of = {_vehicle_at(next(one, None), cars, vehicles) for one in (before, after)}
        return vehicle_of.pop() if len(vehicle_of) == 1 else None
    votes = Counter(vehicle for row in seen if (vehicle := _vehicle_at(row, cars, vehicles)))
    return votes.most_common(1)[0][0] if votes else None


def _vehicle_at(row: int | None, cars: Positions, vehicles: Positions) -> str | None:
    """Find the vehicle that is where a row says that a car is."""
    if row is None:
        return None
    t_us = int(cars.t_us[row])
    there = _rows_between(vehicles, t_us, t_us)
    if not there:
        return None
    distance_m, nearest = cKDTree(vehicles.centre_m[there.start : there.stop]).query(cars.centre_m[row])
    return vehicles.ids[there.start + int(nearest)] if distance_m <= NEAREST_M else None


def _rows_between(positions: Positions, start_us: int, end_us: int) -> range:
    """Return the rows with start_us <= t_us <= end_us."""
    first = int(np.searchsorted(positions.t_us, start_us, side="left"))
    return range(first, int(np.searchsorted(positions.t_us, end_us, side="right")))


def _assign(
    claims: Sequence[EventRecord], roles: Sequence[Mapping[str, str | None]], facts: Sequence[TrueEvent]
) -> list[tuple[int, int]]:
    """Match claims to facts one to one, as many as possible, then as near in time as possible."""
    impossible = 1e12
    cost = np.full((len(claims), len(facts)), impossible)
    for i, (claim, of_claim) in enumerate(zip(claims, roles, strict=True)):
        for j, fact in enumerate(facts):
            if _is_right(claim, of_claim, fact):
                cost[i, j] = abs(claim.start_us - fact.start_us) + abs(claim.end_us - fact.end_us)
    rows, columns = linear_sum_assignment(cost)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if cost[i, j] < impossible]


def _are_same_vehicles(roles: Mapping[str, str | None], fact: TrueEvent) -> bool:
    """Compare vehicles role by role; where roles say nothing, as sets."""
    if fact.type in INTERCHANGEABLE:
        return {roles.get(role) for role in fact.roles} == set(fact.roles.values())
    return all(roles.get(role) == vehicle for role, vehicle in fact.roles.items())


def _is_right(claim: EventRecord, roles: Mapping[str, str | None], fact: TrueEvent) -> bool:
    if not _are_same_vehicles(roles, fact):
        return False
    if not fact.countable:  # When it is may be what nobody can tell.
        return claim.start_us <= fact.end_us + TOLERANCE_US and fact.start_us <= claim.end_us + TOLERANCE_US
    return abs(claim.start_us - fact.start_us) <= TOLERANCE_US and abs(claim.end_us - fact.end_us) <= TOLERANCE_US


def _mean_seconds(errors_us: Sequence[int]) -> float:
    return sum(errors_us) / len(errors_us) / 1e6 if errors_us else float("nan")
