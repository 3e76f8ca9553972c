"""How do the relations sit in a stream graph? A DyKnow process: cars in, relation changes out."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Protocol

from dyknow.sample import Sample
from dyknow.streams.hypotheses import Hypotheses
from gis.roads.road_network import RoadPositions
from qsr.changes.crossings import RelationChange
from qsr.changes.line_up import Seen
from qsr.measuring.footprints import BoolArray, FloatArray, Footprints, on_roads
from qsr.observer import RelationObserver
from qsr.replay import ReplayingObserver


class Cars(Protocol):
    """Describe what the relations need of the cars of one time; see `Footprints` for the meaning.

    `linked` tells which cars were seen in this frame, and not only predicted.
    """

    @property
    def t_us(self) -> int: ...  # noqa: D102
    @property
    def ids(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def centre_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def heading_rad(self) -> FloatArray: ...  # noqa: D102
    @property
    def speed_mps(self) -> FloatArray: ...  # noqa: D102
    @property
    def length_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def width_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def linked(self) -> BoolArray: ...  # noqa: D102
    @property
    def positions(self) -> RoadPositions: ...  # noqa: D102
    @property
    def has_moved(self) -> BoolArray: ...  # noqa: D102
    @property
    def sigma_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def confidence(self) -> FloatArray: ...  # noqa: D102
    @property
    def hidden(self) -> Mapping[str, int]: ...  # noqa: D102


class HasCars(Protocol):
    """Describe a sample value that carries cars, and the hypotheses by which they are the cars they are.

    ``filled`` and ``former`` are cars of earlier times that were not known then; see `RelationObserver.observe`.
    """

    @property
    def cars(self) -> Cars: ...  # noqa: D102
    @property
    def filled(self) -> tuple[Cars, ...]: ...  # noqa: D102
    @property
    def former(self) -> tuple[Cars, ...]: ...  # noqa: D102
    @property
    def hypotheses(self) -> Hypotheses: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class FrameRelations:
    """Hold the relation changes that one frame decided, with what is known of the hypotheses they rest on.

    Attributes
    ----------
    changes : empty most of the time: an empty answer still tells the subscribers how far time has come.
    hypotheses : when they were decided.
    """

    changes: tuple[RelationChange, ...]
    hypotheses: Hypotheses = field(default_factory=Hypotheses)

    def hypotheses_of(self, change: RelationChange) -> tuple[str, ...]:
        """Give those that a change rests on: about its arguments, and about the return of those that are absent."""
        labels = self.hypotheses.of(change.args, change.absent)
        return tuple(label for label in labels if label not in change.younger) if change.younger else labels


class RelationUnit:
    """Run a relation observer as a computational unit."""

    def __init__(self, observer: RelationObserver) -> None:
        self._observer = ReplayingObserver(observer)
        self._doubted: Mapping[str, tuple[str, ...]] = {}  # the hypotheses about each object in the last frame
        self._last_us: int | None = None

    def update(self, sample: Sample[HasCars]) -> Iterable[Sample[FrameRelations]]:
        """Compute the relations among one frame's cars and say which changed; a repeated frame says nothing new."""
        value = sample.value
        if self._last_us is not None and value.cars.t_us <= self._last_us:
            return ()
        self._last_us = value.cars.t_us
        seen = Seen(_footprints(value.cars), value.cars.hidden, _earlier(value))
        known, before = value.hypotheses, self._doubted
        begun = {
            label: one for one, labels in known.about.items() for label in labels if label not in before.get(one, ())
        }
        self._doubted = known.about
        changes = self._observer.observe(seen, begun, (*known.validated, *known.undecided), known.refuted)
        return (Sample(sample.available_us, sample.valid_us, FrameRelations(tuple(changes), known)),)

    def finish(self) -> Iterable[Sample[FrameRelations]]:
        """Hold nothing back: every frame was answered when it came."""
        return ()


def _earlier(value: HasCars) -> list[Footprints]:
    """Give the rows of earlier times, in their order; what was seen goes before what is concluded of the same time."""
    former = [_footprints(cars) for cars in value.former]
    seen = {(one.t_us, car) for one in former for car in one.ids}
    filled = (_footprints(cars) for cars in value.filled)
    unseen = [one.select([k for k, car in enumerate(one.ids) if (one.t_us, car) not in seen]) for one in filled]
    return sorted((*former, *unseen), key=attrgetter("t_us"))


def _footprints(cars: Cars) -> Footprints:
    return Footprints.of(
        t_us=cars.t_us,
        ids=cars.ids,
        centre_m=cars.centre_m,
        heading_rad=cars.heading_rad,
        speed_mps=cars.speed_mps,
        length_m=cars.length_m,
        width_m=cars.width_m,
        **on_roads(cars.positions),
        observed=cars.linked,
        has_moved=cars.has_moved,
        sigma_m=cars.sigma_m,
        confidence=cars.confidence,
    )
