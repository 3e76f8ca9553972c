"""How do the relations sit in a stream graph? A DyKnow process: cars in, relation changes out."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from dyknow.sample import Sample
from gis.road_network import RoadPositions
from qsr.changes.crossings import RelationChange
from qsr.measuring.footprints import BoolArray, FloatArray, Footprints
from qsr.observer import RelationObserver
from qsr.retelling import RetellingObserver, Seen


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
    def hidden(self) -> Mapping[str, int]: ...  # noqa: D102


class HasCars(Protocol):
    """Describe a sample value that carries cars, and the hypotheses by which they are the cars they are.

    See `RelationObserver.observe` for ``filled``, and `FrameRelations` for the others.
    """

    @property
    def cars(self) -> Cars: ...  # noqa: D102
    @property
    def filled(self) -> tuple[Cars, ...]: ...  # noqa: D102
    @property
    def absences(self) -> Mapping[str, str]: ...  # noqa: D102
    @property
    def opened(self) -> tuple[tuple[str, int], ...]: ...  # noqa: D102
    @property
    def hypotheses(self) -> Mapping[str, tuple[str, ...]]: ...  # noqa: D102
    @property
    def validated(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def refuted(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def undecided(self) -> tuple[str, ...]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class FrameRelations:
    """Hold the relation changes that one frame decided, with what is known of the hypotheses they rest on.

    Attributes
    ----------
    changes : empty most of the time: an empty answer still tells the subscribers how far time has come.
    hypotheses : labels of the open hypotheses about each object; objects without such are left out.
    validated, refuted : labels of hypotheses that are decided now.
    absences : labels of the hypotheses that an object that is hidden does not come back.
    opened : labels of hypotheses, each with the time from which on changes may still come or be taken back by it.
    undecided : labels of hypotheses that nobody will ever decide.
    """

    changes: tuple[RelationChange, ...]
    hypotheses: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    validated: tuple[str, ...] = ()
    refuted: tuple[str, ...] = ()
    absences: Mapping[str, str] = field(default_factory=dict)
    opened: tuple[tuple[str, int], ...] = ()
    undecided: tuple[str, ...] = ()

    def hypotheses_of(self, change: RelationChange) -> tuple[str, ...]:
        """Give the open hypotheses that a change rests on, when it was decided.

        They are those about its arguments, and that those do not come back because of whom it is unknown.

        Examples
        --------
        >>> change = RelationChange("behind", ("a", "b"), 0, 40_000, True, None, absent=("a",))
        >>> frame = FrameRelations((change,), {"b": ("v2->b#7",), "c": ("v3->c#8",)}, absences={"a": "a lost#9"})
        >>> frame.hypotheses_of(change)
        ('v2->b#7', 'a lost#9')
        """
        labels: tuple[str, ...] = ()
        for one in change.args if self.hypotheses else ():
            labels += self.hypotheses.get(one, ())
        for one in change.absent:
            labels += (self.absences[one],)
        return labels


class RelationUnit:
    """Run a relation observer as a computational unit."""

    __slots__ = ("_hypotheses", "_last_us", "_observer")

    def __init__(self, observer: RelationObserver) -> None:
        self._observer = RetellingObserver(observer)
        self._hypotheses: Mapping[str, tuple[str, ...]] = {}  # of the last frame
        self._last_us: int | None = None

    def update(self, sample: Sample[HasCars]) -> Iterable[Sample[FrameRelations]]:
        """Compute the relations among one frame's cars and say which changed; a repeated frame says nothing new."""
        value = sample.value
        if self._last_us is not None and value.cars.t_us <= self._last_us:
            return ()
        self._last_us = value.cars.t_us
        seen = Seen(_footprints(value.cars), value.cars.hidden, [_footprints(cars) for cars in value.filled])
        before = self._hypotheses
        begun = {
            label: car for car, links in value.hypotheses.items() for label in links if label not in before.get(car, ())
        }
        self._hypotheses = value.hypotheses
        changes = tuple(self._observer.observe(seen, begun, (*value.validated, *value.undecided), value.refuted))
        relations = FrameRelations(
            changes,
            value.hypotheses,
            value.validated,
            value.refuted,
            value.absences,
            value.opened,
            value.undecided,
        )
        return (Sample(sample.available_us, sample.valid_us, relations),)

    def finish(self) -> Iterable[Sample[FrameRelations]]:
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
        lane=positions.lane,
        observed=cars.linked,
    )
