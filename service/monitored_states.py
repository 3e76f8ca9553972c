"""What did the world look like at one time, for formulas? Car states and relations, brought together by valid time.

Relations are decided late and dated back, so a frame waits until every change up to its time must have come. By then it
is also known which links on trial were wrong: what rests on a refuted one is left out.
"""

import heapq
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from qsr.changes import RelationChange, Value
from service.monitored_features import CAR_FEATURES, PLACE_RELATIONS, CarValue
from service.records import CarState

Arguments = tuple[str, ...]
Table = Mapping[Arguments, CarValue]


class TrafficState:
    """A state for formulas; see `dyknow.mtl.states.State`.

    Parameters
    ----------
    cars : the members of the sort Car.
    tables : values by feature and arguments; they must not change afterwards.

    Examples
    --------
    >>> state = TrafficState(("car7",), {"speed": {("car7",): 12.5}, "on": {("car7", "main"): True}})
    >>> state.value("speed", ("car7",)), state.value("speed", ("car8",)), state.members("Car")
    (12.5, None, ('car7',))
    >>> state.value("on", ("car7", "main")), state.value("on", ("car7", "side")), state.value("on", ("car8", "side"))
    (True, False, None)
    """

    __slots__ = ("_cars", "_tables")

    def __init__(self, cars: tuple[str, ...], tables: Mapping[str, Table]) -> None:
        self._cars = cars
        self._tables = tables

    def value(self, feature: str, arguments: Arguments) -> CarValue:
        """Give the value of a feature; None where it is not known."""
        value = self._tables[feature].get(arguments)
        if value is None and feature in PLACE_RELATIONS and arguments[0] in self._cars:
            return False
        return value

    def members(self, sort: str) -> Collection[str]:
        """Give the cars of this time; there is no other sort."""
        return self._cars if sort == "Car" else ()


@dataclass(slots=True)
class _Frame:
    """Cars that wait; `doubted` are those that a refuted link made."""

    t_us: int
    cars: Sequence[CarState]
    hypotheses: Mapping[str, tuple[str, ...]]
    doubted: set[str] = field(default_factory=set)


class WaitingStates:
    """Brings the cars of frames and the changes of relations together.

    Parameters
    ----------
    features : the names that the formulas look at; nothing else is kept.
    lag_us : how long after its time a state is complete: how far back changes are dated, at most.

    Examples
    --------
    >>> waiting = WaitingStates({"moving"}, lag_us=2_000_000)
    >>> waiting.take_cars(0, [CarState(0, "car7", 0.0, 0.0, 0.0, 9.0, 4.5, 1.8)])
    >>> change = RelationChange("moving", ("car7",), t_us=0, decided_us=1_000_000, old=None, new=True)
    >>> list(waiting.take_relations(1_000_000, [(change, ())]))
    []
    >>> [(t_us, state.value("moving", ("car7",))) for t_us, state in waiting.take_relations(2_000_000, ())]
    [(0, True)]
    """

    def __init__(self, features: Collection[str], *, lag_us: int) -> None:
        self._lag_us = lag_us
        self._readers = [(name, CAR_FEATURES[name].read) for name in sorted(features) if name in CAR_FEATURES]
        self._relations: dict[str, dict[Arguments, Value]] = {name: {} for name in features if name not in CAR_FEATURES}
        self._frames: deque[_Frame] = deque()
        # (time, number of arrival, change, hypotheses): the number keeps changes of one time apart and in order.
        self._changes: list[tuple[int, int, RelationChange, tuple[str, ...]]] = []
        self._arrived = 0

    def take_cars(
        self, t_us: int, cars: Sequence[CarState], hypotheses: Mapping[str, tuple[str, ...]] | None = None
    ) -> None:
        """Take the cars of a frame, later than the one before.

        Parameters
        ----------
        hypotheses : labels of the links on trial below each car; cars without such are left out.
        """
        self._frames.append(_Frame(t_us, cars, hypotheses or {}))

    def take_relations(
        self,
        t_us: int,
        changes: Iterable[tuple[RelationChange, tuple[str, ...]]],
        refuted: Collection[str] = (),
    ) -> Iterator[tuple[int, TrafficState]]:
        """Take what a frame decided, and give the states that are complete now, with their times.

        Parameters
        ----------
        t_us : time of the frame.
        changes : with the hypotheses that each rests on.
        refuted : labels of hypotheses that have turned out wrong.
        """
        if refuted:
            self._doubt(frozenset(refuted))
        for change, hypotheses in changes:
            if change.name in self._relations:
                self._arrived += 1
                heapq.heappush(self._changes, (change.t_us, self._arrived, change, hypotheses))
        return self._complete(t_us - self._lag_us)

    def finish(self) -> Iterator[tuple[int, TrafficState]]:
        """Give the states that still wait: no later change can come."""
        return self._complete(self._frames[-1].t_us) if self._frames else iter(())

    def _doubt(self, refuted: frozenset[str]) -> None:
        for frame in self._frames:
            frame.doubted.update(car for car, labels in frame.hypotheses.items() if not refuted.isdisjoint(labels))
        self._changes = [one for one in self._changes if refuted.isdisjoint(one[3])]
        heapq.heapify(self._changes)

    def _complete(self, until_us: int) -> Iterator[tuple[int, TrafficState]]:
        frames = self._frames
        while frames and frames[0].t_us <= until_us:
            frame = frames.popleft()
            self._apply_changes(frame.t_us)
            yield frame.t_us, self._state(frame)

    def _apply_changes(self, until_us: int) -> None:
        """Bring the relations up to a time; tables that were given out stay as they are."""
        fresh: set[str] = set()
        while self._changes and self._changes[0][0] <= until_us:
            change = heapq.heappop(self._changes)[2]
            if change.name not in fresh:
                fresh.add(change.name)
                self._relations[change.name] = dict(self._relations[change.name])
            table = self._relations[change.name]
            if change.new is None:
                table.pop(change.args, None)  # unknown again, and forgotten: cars come and go for hours
            else:
                table[change.args] = change.new

    def _state(self, frame: _Frame) -> TrafficState:
        seen = [car for car in frame.cars if car.linked and car.car not in frame.doubted]
        tables: dict[str, Table] = {name: {(car.car,): read(car) for car in seen} for name, read in self._readers}
        if "seen" in tables:
            tables["seen"] = {(car.car,): False for car in frame.cars} | dict(tables["seen"])
        return TrafficState(tuple(car.car for car in frame.cars), tables | self._relations)
