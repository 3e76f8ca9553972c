"""How does anchoring sit in a stream graph? A DyKnow process: vision objects in, car symbols and link changes out."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from anchoring.anchorer import Anchorer
from anchoring.observations import BoolArray, Cars, FloatArray, LinkChange, Observations
from dyknow.sample import Sample


class TrackedObjects(Protocol):
    """Describe what anchoring needs of a tracker's objects in one frame; see `Observations` for the meaning."""

    @property
    def t_us(self) -> int: ...  # noqa: D102
    @property
    def ids(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def centre_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def velocity_mps(self) -> FloatArray: ...  # noqa: D102
    @property
    def heading_rad(self) -> FloatArray: ...  # noqa: D102
    @property
    def length_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def width_m(self) -> FloatArray: ...  # noqa: D102
    @property
    def observed(self) -> BoolArray: ...  # noqa: D102
    @property
    def clipped(self) -> BoolArray: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Anchored:
    """Hold the cars of one time and the links that changed."""

    cars: Cars
    link_changes: tuple[LinkChange, ...]


class AnchoringUnit:
    """Run an anchorer as a computational unit."""

    __slots__ = ("_anchorer",)

    def __init__(self, anchorer: Anchorer) -> None:
        self._anchorer = anchorer

    def update(self, sample: Sample[TrackedObjects]) -> Iterable[Sample[Anchored]]:
        """Link one frame's objects to car symbols."""
        cars, link_changes = self._anchorer.observe(_observations(sample.value))
        return (Sample(sample.available_us, sample.valid_us, Anchored(cars, link_changes)),)

    def finish(self) -> Iterable[Sample[Anchored]]:
        """Hold nothing back: every frame was answered when it came."""
        return ()


def _observations(objects: TrackedObjects) -> Observations:
    return Observations(
        t_us=objects.t_us,
        ids=objects.ids,
        centre_m=objects.centre_m,
        velocity_mps=objects.velocity_mps,
        heading_rad=objects.heading_rad,
        length_m=objects.length_m,
        width_m=objects.width_m,
        observed=objects.observed,
        clipped=objects.clipped,
    )
