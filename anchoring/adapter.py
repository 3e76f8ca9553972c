"""How does anchoring sit in a stream graph? A DyKnow process: vision objects in, car symbols and link changes out.

A link may turn out to be wrong, and whatever was concluded from it with it. So every link is a *hypothesis* with a
label while it is on trial. The engine breaks a link when it is refuted, but never calls one right; here one counts as
validated when it has held for the time of trial, or has ended without having been refuted. A refutation after the trial
speaks of what the two did lately, not of the time when they were linked: it takes nothing back.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Protocol

from anchoring.absences import Absences
from anchoring.anchorer import Anchorer
from anchoring.former import FormerRows
from anchoring.observations import BoolArray, Cars, FloatArray, Level, LinkChange, Observations
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
    @property
    def classes(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def is_lost(self) -> bool:
        """Whether the camera does not know where it looks: then nothing is known of any car, not even a prediction."""
        ...


@dataclass(frozen=True, slots=True)
class Anchored:
    """Hold the cars of one time and the links that changed.

    Attributes
    ----------
    hypotheses : labels of the links on trial below each car, lowest first; cars without such are left out.
    validated, refuted : labels that were carried before and are decided now.
    former : the cars of earlier times, oldest first, that have got their names only now. They are for the record:
        relations and monitors look at ``cars`` alone, since what they said of those times is said.
    filled : the cars of earlier times that nobody saw then and that are seen again now, oldest first.
    absences : of each car that is hidden, the label of the hypothesis that it does not come back.
    opened : labels of hypotheses by which something may still turn out to have happened, and from when on.
    undecided : labels that were carried before and that nobody will ever decide.
    """

    cars: Cars
    link_changes: tuple[LinkChange, ...]
    hypotheses: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    validated: tuple[str, ...] = ()
    refuted: tuple[str, ...] = ()
    former: tuple[Cars, ...] = ()
    filled: tuple[Cars, ...] = ()
    absences: Mapping[str, str] = field(default_factory=dict)
    opened: tuple[tuple[str, int], ...] = ()
    undecided: tuple[str, ...] = ()


class LinkTrials:
    """Keep the links on trial, each under a label that is used once.

    Parameters
    ----------
    trial_us : how long a link must hold to count as validated.

    Examples
    --------
    >>> trials = LinkTrials(2_000_000)
    >>> trials.judge(0, [LinkChange(0, "established", "world", "v1", "w1", ""),
    ...                  LinkChange(0, "established", "car", "w1", "car1", "")])
    ((), ())
    >>> dict(trials.hypotheses())
    {'car1': ('v1->w1#1', 'w1->car1#2')}
    >>> trials.judge(500_000, [LinkChange(500_000, "refuted", "world", "v1", "w1", "")])
    ((), ('v1->w1#1',))
    >>> trials.judge(2_000_000, [])
    (('w1->car1#2',), ())
    >>> dict(trials.hypotheses())
    {}
    """

    __slots__ = ("_count", "_open", "_trial_us", "_uppers")

    def __init__(self, trial_us: int) -> None:
        self._trial_us = trial_us
        self._count = 0
        self._open: dict[tuple[Level, str], tuple[int, str]] = {}  # upper object: since when, label; oldest first
        self._uppers: dict[str, tuple[Level, str]] = {}  # lower object, above the vision objects: what it is linked to

    def judge(self, t_us: int, changes: Iterable[LinkChange]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Take a frame's link changes in their order; return the labels validated and those refuted by now."""
        validated: list[str] = []
        refuted: list[str] = []
        for change in changes:
            key = change.level, change.upper
            if key in self._open:
                (refuted if change.kind == "refuted" else validated).append(self._open.pop(key)[1])
            if change.kind in ("established", "reestablished"):
                self._count += 1
                self._open[key] = t_us, f"{change.lower}->{change.upper}#{self._count}"
                if change.level != "world":
                    self._uppers[change.lower] = key
            elif change.level != "world":
                self._uppers.pop(change.lower, None)
        for key, (since_us, label) in list(self._open.items()):
            if since_us > t_us - self._trial_us:
                break
            del self._open[key]
            validated.append(label)
        return tuple(validated), tuple(refuted)

    def hypotheses(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Give the cars with links on trial, and their labels, lowest link first."""
        found: dict[str, list[str]] = {}
        for key, (_, label) in sorted(self._open.items(), key=lambda one: _RANK[one[0][0]]):
            car = self._car(key)
            if car:
                found.setdefault(car, []).append(label)
        return ((car, tuple(labels)) for car, labels in found.items())

    def _car(self, key: tuple[Level, str]) -> str:
        """Follow the links upwards; "" if they do not lead to a car."""
        while key[0] != "car":
            above = self._uppers.get(key[1])
            if above is None:
                return ""
            key = above
        return key[1]


_RANK: Mapping[Level, int] = {"world": 0, "on_road": 1, "car": 2}


class AnchoringUnit:
    """Run an anchorer as a computational unit."""

    __slots__ = ("_absences", "_anchorer", "_former", "_last_us", "_silent_until_us", "_trials")

    def __init__(self, anchorer: Anchorer) -> None:
        self._anchorer = anchorer
        self._last_us: int | None = None
        self._silent_until_us: int | None = 0  # None while the view is lost
        self._trials = LinkTrials(anchorer.settings.trial_us)
        self._absences = Absences()
        self._former = FormerRows(anchorer.settings, anchorer.locate)

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
        validated, refuted = self._trials.judge(cars.t_us, link_changes)
        opened, gone, returned = self._absences.judge(cars.hidden, cars.ids)
        anchored = Anchored(
            cars,
            link_changes,
            dict(self._trials.hypotheses()),
            validated + gone,
            refuted + returned,
            former,
            filled,
            self._absences.labels,
            opened,
        )
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
    return Observations(**{one.name: getattr(objects, one.name) for one in fields(Observations)})
