"""What did the world look like at one time, for formulas? Car states and relations, synchronised by valid time.

::

    cars ────────────────────────┐
                                 ├── synchroniser ──> states
    relations ──> hindsight ─────┘

Relations are decided late and dated back. *Hindsight* puts them in order: it tells how they stood at each frame as soon
as no change can be dated back to it any more. By then it is also known which links on trial were wrong: what rests on a
refuted one is left out. The synchroniser makes a state of each frame's cars and of the relations at its time.
"""

import heapq
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from chronicles.events import Event
from dyknow.mtl.formula import ANY
from dyknow.policies.policy import Approximation, Order, Policy
from dyknow.policies.synchroniser import State, Synchroniser
from dyknow.sample import NO_VALUE, Sample
from qsr.changes.crossings import RelationChange, Value
from service.records.seen import CarState
from service.texts.monitored_features import CAR_FEATURES, PLACE_RELATIONS, CarValue

# How much longer than its lag a stream may stay silent until states go on without it.
IDLE_US = 1_000_000

Arguments = tuple[str, ...]
Table = Mapping[Arguments, CarValue]

_HELD = Policy(approximation=Approximation.MOST_RECENT, order=Order.STRICT)


class TrafficState:
    """A state for formulas; see `dyknow.mtl.progression.states.State`.

    Parameters
    ----------
    cars : the members of the sort Car.
    tables : values by feature and arguments; they must not change afterwards.
    events : those that are true here; no table has their names.

    Examples
    --------
    >>> state = TrafficState(("car7",), {"speed": {("car7",): 12.5}, "on": {("car7", "main"): True}})
    >>> state.value("speed", ("car7",)), state.value("speed", ("car8",)), state.members("Car")
    (12.5, None, ('car7',))
    >>> state.value("on", ("car7", "main")), state.value("on", ("car7", "side")), state.value("on", ("car8", "side"))
    (True, False, None)
    >>> state
    TrafficState(1 car, on: 1, speed: 1)
    >>> later = state.with_events([Event("overtake", ("car7", "car8", "main"), 0)])
    >>> [later.value("overtake", asked) for asked in [("car7", "?", "main"), ("car8", "?", "?")]]
    [True, False]
    """

    __slots__ = ("_cars", "_events", "_tables")

    def __init__(self, cars: tuple[str, ...], tables: Mapping[str, Table], events: Sequence[Event] = ()) -> None:
        self._cars = cars
        self._tables = tables
        self._events = events

    def with_events(self, events: Sequence[Event]) -> "TrafficState":
        """Give this state with the events that are true in it."""
        return TrafficState(self._cars, self._tables, events)

    def __repr__(self) -> str:
        """Say how much is known: the cars, and how many values each feature has."""
        cars = f"{len(self._cars)} car{'' if len(self._cars) == 1 else 's'}"
        known = [f"{name}: {len(table)}" for name, table in sorted(self._tables.items())]
        return f"TrafficState({', '.join([cars, *known])})"

    def value(self, feature: str, arguments: Arguments) -> CarValue:
        """Give the value of a feature, None where it is not known, or tell whether an event happened."""
        if feature not in self._tables:
            return any(one.name == feature and _is_of(one, arguments) for one in self._events)
        value = self._tables[feature].get(arguments)
        if value is None and feature in PLACE_RELATIONS and arguments[0] in self._cars:
            return False
        return value

    def members(self, sort: str) -> Collection[str]:
        """Give the cars of this time; there is no other sort."""
        return self._cars if sort == "Car" else ()


def _is_of(event: Event, asked: Arguments) -> bool:
    pairs = zip(asked, event.args, strict=False)
    return len(asked) == len(event.args) and all(one in (ANY, other) for one, other in pairs)


@dataclass(frozen=True, slots=True)
class Past:
    """Tell how the relations stood at a frame.

    Attributes
    ----------
    relations : values by name and arguments, as far as they are known.
    refuted : labels of the links that were refuted since then.
    """

    relations: Mapping[str, Table]
    refuted: Collection[str] = ()


class Hindsight:
    """Orders relation changes by when they happened, and tells how the relations stood at each frame.

    Parameters
    ----------
    names : the relations to keep.
    lag_us : how far back changes are dated, at most.

    Attributes
    ----------
    refuted_count : changes left out because they rest on a refuted link.

    Examples
    --------
    >>> hindsight = Hindsight({"moving"}, lag_us=2_000_000)
    >>> change = RelationChange("moving", ("car7",), t_us=0, decided_us=1_000_000, old=None, new=True)
    >>> list(hindsight.take(0, ())), list(hindsight.take(1_000_000, [(change, ())]))
    ([], [])
    >>> list(hindsight.take(2_000_000, ()))
    [(0, Past(relations={'moving': {('car7',): True}}, refuted=()))]
    """

    def __init__(self, names: Collection[str], *, lag_us: int) -> None:
        self.refuted_count = 0
        self._lag_us = lag_us
        self._relations: dict[str, dict[Arguments, Value]] = {name: {} for name in names}
        self._frames_us: deque[int] = deque()
        # (time, number of arrival, change, hypotheses): the number keeps changes of one time apart and in order.
        self._changes: list[tuple[int, int, RelationChange, tuple[str, ...]]] = []
        self._arrived = 0
        self._refuted: dict[str, int] = {}  # label: when
        # What was made unknown by hypotheses that are open, by label: it is known again if one turns out wrong.
        self._doubted: dict[str, list[RelationChange]] = {}

    def take(
        self,
        t_us: int,
        changes: Iterable[tuple[RelationChange, tuple[str, ...]]],
        refuted: Collection[str] = (),
        validated: Collection[str] = (),
    ) -> Iterator[tuple[int, Past]]:
        """Take what a frame decided, and give the frames that are past, with their times.

        Parameters
        ----------
        t_us : time of the frame, later than the one before.
        changes : with the hypotheses that each rests on.
        refuted : labels of hypotheses that have turned out wrong; each is used for one hypothesis only.
        validated : labels of those that have turned out right.
        """
        for label in validated:
            self._doubted.pop(label, None)
        if refuted:
            self._leave_out(t_us, frozenset(refuted))
        for change, hypotheses in changes:
            if change.name in self._relations:
                self._arrived += 1
                heapq.heappush(self._changes, (change.t_us, self._arrived, change, hypotheses))
        self._frames_us.append(t_us)
        return self._past(t_us - self._lag_us)

    def advance(self, t_us: int) -> Iterator[tuple[int, Past]]:
        """Let time pass: no earlier frame comes any more. Gives the frames that are past by that."""
        return self._past(t_us - self._lag_us - 1)  # the frame of this very time may still refute a link

    def finish(self) -> Iterator[tuple[int, Past]]:
        """Give the frames that still wait: no later change can come."""
        return self._past(self._frames_us[-1]) if self._frames_us else iter(())

    def _leave_out(self, t_us: int, refuted: frozenset[str]) -> None:
        kept = [one for one in self._changes if refuted.isdisjoint(one[3])]
        self.refuted_count += len(self._changes) - len(kept)
        heapq.heapify(kept)
        self._changes = kept
        self._refuted |= dict.fromkeys(refuted, t_us)
        for change in (one for label in refuted for one in self._doubted.pop(label, ())):
            self._relations[change.name] = {change.args: change.old, **self._relations[change.name]}

    def _past(self, until_us: int) -> Iterator[tuple[int, Past]]:
        frames_us = self._frames_us
        while frames_us and frames_us[0] <= until_us:
            t_us = frames_us.popleft()
            self._apply_changes(t_us)
            self._refuted = {label: at_us for label, at_us in self._refuted.items() if at_us > t_us}
            yield t_us, Past(dict(self._relations), tuple(self._refuted))

    def _apply_changes(self, until_us: int) -> None:
        """Bring the relations up to a time; tables that were given out stay as they are."""
        fresh: set[str] = set()
        while self._changes and self._changes[0][0] <= until_us:
            _, _, change, hypotheses = heapq.heappop(self._changes)
            if change.name not in fresh:
                fresh.add(change.name)
                self._relations[change.name] = dict(self._relations[change.name])
            table = self._relations[change.name]
            if change.new is None:
                table.pop(change.args, None)  # unknown again, and forgotten: cars come and go for hours
                for label in hypotheses:
                    self._doubted.setdefault(label, []).append(change)
            else:
                table[change.args] = change.new


class TrafficStates:
    """Makes a state of each frame, live or out of a log.

    Parameters
    ----------
    features : the names that the formulas look at; nothing else is kept.
    lag_us : how far back relation changes are dated, at most; a state is complete that long after its time, and
        leaves without newer relations where these have not come for `IDLE_US` more.

    Examples
    --------
    >>> states = TrafficStates({"moving"}, lag_us=2_000_000)
    >>> states.take_cars(0, [CarState(0, "car7", 0.0, 0.0, 0.0, 9.0, 4.5, 1.8)])
    []
    >>> change = RelationChange("moving", ("car7",), t_us=0, decided_us=1_000_000, old=None, new=True)
    >>> states.take_relations(0, ()), states.take_relations(1_000_000, [(change, ())])
    ([], [])
    >>> [(t_us, state.value("moving", ("car7",))) for t_us, state in states.take_relations(2_000_000, ())]
    [(0, True)]
    """

    def __init__(self, features: Collection[str], *, lag_us: int) -> None:
        self._lag_us = lag_us
        self._readers = [(name, CAR_FEATURES[name].read) for name in sorted(features) if name in CAR_FEATURES]
        self._nothing_known = Past({name: {} for name in features if name not in CAR_FEATURES})
        self._hindsight = Hindsight(self._nothing_known.relations, lag_us=lag_us)
        fluents = {"cars": _HELD, "relations": _HELD}
        self._synchroniser = Synchroniser(fluents, at="cars", max_delay_us=lag_us + IDLE_US)

    @property
    def left_out(self) -> dict[str, int]:
        """Count by cause what no state needed: samples that came late or twice, changes by refuted links."""
        refuted = self._hindsight.refuted_count
        return self._synchroniser.left_out | ({"changes refuted": refuted} if refuted else {})

    def take_cars(
        self, t_us: int, cars: Sequence[CarState], hypotheses: Mapping[str, tuple[str, ...]] | None = None
    ) -> list[tuple[int, TrafficState]]:
        """Take the cars of a frame, later than the one before; give the states that leave, with their times.

        Parameters
        ----------
        hypotheses : labels of the links on trial below each car; cars without such are left out.
        """
        return self._states(self._synchroniser.observe("cars", Sample(t_us, t_us, (cars, hypotheses or {}))))

    def take_relations(
        self,
        t_us: int,
        changes: Iterable[tuple[RelationChange, tuple[str, ...]]],
        refuted: Collection[str] = (),
        validated: Collection[str] = (),
    ) -> list[tuple[int, TrafficState]]:
        """Take what a frame decided about relations and links; see `Hindsight.take`."""
        return self._join(self._hindsight.take(t_us, changes, refuted, validated))

    def advance(self, t_us: int) -> list[tuple[int, TrafficState]]:
        """Let time pass: no earlier frame comes any more. Gives the states that need not, or may not, wait longer."""
        return self._join(self._hindsight.advance(t_us)) + self._states(self._synchroniser.advance(t_us))

    def finish(self) -> list[tuple[int, TrafficState]]:
        """Give the states that still wait: nothing comes any more."""
        return self._join(self._hindsight.finish()) + self._states(self._synchroniser.finish())

    def _join(self, past: Iterable[tuple[int, Past]]) -> list[tuple[int, TrafficState]]:
        found: list[tuple[int, TrafficState]] = []
        for t_us, one in past:
            # Known since its lag is over, also if no frame came that could tell: after a gap, nothing has waited.
            found += self._states(self._synchroniser.observe("relations", Sample(t_us + self._lag_us, t_us, one)))
        return found

    def _states(self, joined: Iterable[Sample[State]]) -> list[tuple[int, TrafficState]]:
        return [(one.valid_us, self._state(one.value)) for one in joined]

    def _state(self, joined: State) -> TrafficState:
        cars, hypotheses = joined["cars"]
        known = joined["relations"]
        past: Past = self._nothing_known if known is NO_VALUE else known
        refuted = frozenset(past.refuted)
        doubted = {car for car, labels in hypotheses.items() if not refuted.isdisjoint(labels)}
        seen = [car for car in cars if car.linked and car.car not in doubted]
        tables: dict[str, Table] = {name: {(car.car,): read(car) for car in seen} for name, read in self._readers}
        if "seen" in tables:
            tables["seen"] = {(car.car,): False for car in cars} | dict(tables["seen"])
        return TrafficState(tuple(car.car for car in cars), tables | dict(past.relations))
