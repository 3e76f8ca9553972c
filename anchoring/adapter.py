"""How does anchoring sit in a stream graph? A DyKnow process: vision objects in, car symbols and link changes out."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Protocol

from anchoring.absences import Absences
from anchoring.anchorer import Anchorer
from anchoring.former import FormerRows
from anchoring.observations import Cars, LinkChange, Observations
from dyknow.sample import Sample
from dyknow.streams.hypotheses import Hypotheses

_NAMES = [one.name for one in fields(Observations)]


class TrackedObjects(Protocol):
    """Describe a tracker's objects in one frame: besides these, they have what `Observations` has or needs."""

    @property
    def t_us(self) -> int:
        """Time of the frame, microseconds."""
        ...

    @property
    def is_lost(self) -> bool:
        """Whether the camera does not know where it looks: then nothing is known of any car, not even a prediction."""
        ...


@dataclass(frozen=True, slots=True)
class Anchored:
    """Hold the cars of one time and the links that changed.

    Attributes
    ----------
    hypotheses : the links below each car that are on trial or undecided, lowest first, and what became of those that
        were carried before.
    former : the cars of earlier times, oldest first, that have got their names only now. Relations begin with them;
        monitors look at ``cars`` alone, since what they said of those times is said.
    filled : the cars of earlier times that nobody saw then and that are seen again now, oldest first.
    """

    cars: Cars
    link_changes: tuple[LinkChange, ...]
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    former: tuple[Cars, ...] = ()
    filled: tuple[Cars, ...] = ()


class AnchoringUnit:
    """Run an anchorer as a computational unit."""

    def __init__(self, anchorer: Anchorer) -> None:
        self._anchorer = anchorer
        self._last_us: int | None = None
        self._silent_until_us: int | None = 0  # None while the view is lost
        self._absences = Absences()
        self._former = FormerRows(anchorer.settings, anchorer.roads.locate)

    @property
    def left_out(self) -> Mapping[str, int]:
        """Count by cause where the input's word for what is the same was not taken."""
        return self._anchorer.refused

    def update(self, sample: Sample[TrackedObjects]) -> Iterable[Sample[Anchored]]:
        """Link one frame's objects to car symbols; a frame that is sampled again says nothing new."""
        if self._last_us is not None and sample.value.t_us <= self._last_us:
            return ()
        self._last_us = sample.value.t_us
        seen = _observations(sample.value)
        cars, link_changes = self._anchorer.observe(seen)
        former, filled = tuple[Cars, ...](), tuple[Cars, ...]()
        if self._is_silent(cars.t_us, is_lost=sample.value.is_lost):
            cars = cars.without_any()
            self._former.forget()
        else:
            filled = self._anchorer.filled
            former = self._former.take(seen, cars, link_changes)
        trials = self._anchorer.trials
        opened, gone, returned = self._absences.judge(cars.hidden, cars.ids)
        found = tuple((one.label, one.hidden_us) for one in link_changes if one.hidden_us is not None)
        hypotheses = Hypotheses(
            about=trials.doubtful.by_car(),
            absences=self._absences.labels,
            opened=opened + found,
            validated=trials.validated + gone,
            refuted=trials.refuted + returned,
            undecided=trials.undecided,
        )
        anchored = Anchored(cars, link_changes, hypotheses, former, filled)
        return (Sample(sample.available_us, sample.valid_us, anchored),)

    def _is_silent(self, t_us: int, *, is_lost: bool) -> bool:
        """Tell whether the view is lost, or has been found too lately to say anything of any car."""
        if is_lost:
            self._silent_until_us = None
        elif self._silent_until_us is None:
            self._silent_until_us = t_us + self._anchorer.settings.settle_us
        return self._silent_until_us is None or t_us < self._silent_until_us

    def finish(self) -> Iterable[Sample[Anchored]]:
        """Hold nothing back: every frame was answered when it came."""
        return ()


def _observations(objects: TrackedObjects) -> Observations:
    """Take over what has the same name here and there."""
    return Observations(**{name: getattr(objects, name) for name in _NAMES if hasattr(objects, name)})
