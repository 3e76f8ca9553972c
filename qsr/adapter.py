"""How do the relations sit in a stream graph? A DyKnow process: cars in, relation changes out."""

from collections.abc import Iterable
from typing import Protocol

from dyknow.sample import Sample
from qsr.changes import RelationChange
from qsr.footprints import FloatArray, Footprints, IntArray
from qsr.observer import RelationObserver


class RoadPositions(Protocol):
    """Describe where each car is on the roads; -1 or nan where it is on none."""

    @property
    def road(self) -> IntArray: ...  # noqa: D102
    @property
    def along_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def across_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def tangent_rad(self) -> FloatArray: ...  # noqa: D102
    @property
    def junction(self) -> IntArray: ...  # noqa: D102


class Cars(Protocol):
    """Describe what the relations need of the cars of one time; see `Footprints` for the meaning."""

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
    def positions(self) -> RoadPositions: ...  # noqa: D102


class HasCars(Protocol):
    """Describe a sample value that carries cars."""

    @property
    def cars(self) -> Cars: ...  # noqa: D102


class RelationUnit:
    """Run a relation observer as a computational unit.

    Each answer is the tuple of changes that one frame decided, empty most of the time: an empty answer still tells the
    subscribers how far time has come.
    """

    __slots__ = ("_observer",)

    def __init__(self, observer: RelationObserver) -> None:
        self._observer = observer

    def update(self, sample: Sample[HasCars]) -> Iterable[Sample[tuple[RelationChange, ...]]]:
        """Compute the relations among one frame's cars and say which changed."""
        changes = tuple(self._observer.observe(_footprints(sample.value.cars)))
        return (Sample(sample.available_us, sample.valid_us, changes),)

    def finish(self) -> Iterable[Sample[tuple[RelationChange, ...]]]:
        """Hold nothing back: every frame was answered when it came."""
        return ()


def _footprints(cars: Cars) -> Footprints:
    positions = cars.positions
    return Footprints(
        t_us=cars.t_us,
        ids=cars.ids,
        centre_m=cars.centre_m,
        heading_rad=cars.heading_rad,
        speed_mps=cars.speed_mps,
        length_m=cars.length_m,
        width_m=cars.width_m,
        road=positions.road,
        along_m=positions.along_m,
        across_m=positions.across_m,
        tangent_rad=positions.tangent_rad,
        junction=positions.junction,
    )
