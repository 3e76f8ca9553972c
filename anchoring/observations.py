"""What goes into anchoring, and what comes out? One frame's vision objects, one frame's cars, and the links between."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from anchoring.errors import AnchoringError
from gis.roads.road_network import RoadPositions

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int32]
LongArray = NDArray[np.int64]

LinkKind = Literal[
    "established", "reestablished", "validated", "undecided", "joined", "parted", "lost", "refuted", "ended"
]
Level = Literal["world", "on_road", "car"]

DECIMALS = 2
"""Of metres, and of metres a second, that are told of a car."""
_ROUNDED = {
    **dict.fromkeys(("centre_m", "speed_mps", "length_m", "width_m"), DECIMALS),
    **dict.fromkeys(("heading_rad", "sigma_m", "confidence"), 3),
}


@dataclass(frozen=True, slots=True)
class Observations:
    """Hold the vision objects of one frame; entry k of every array belongs to ``ids[k]``.

    Attributes
    ----------
    t_us : time of the frame, microseconds.
    ids : n names, all different; a name that is gone comes back for the same object or not at all.
    centre_m, velocity_mps : (n, 2), local east/north frame; these and the next are finite.
    heading_rad, length_m, width_m : (n,).
    observed : (n,) False where the tracker saw nothing in this frame and only guesses.
    clipped : (n,) True where the object touches the edge of the view, so that its size and centre are wrong.
    classes : n words of `CLASS_NAMES` that the tracker gives, "unknown" where it gives none; or nothing at all.
    sensors : n names of the sensors whose tracks these are; nothing if there is but one.
    sigma_m : (n,) standard deviation of each coordinate of the centre; nan, or nothing at all, where the tracker does
        not say. Of a tracker that says it a car must have moved before anything is said of it and another one.

    Raises
    ------
    AnchoringError
        If an array, or ``sensors``, has another length than ``ids``, a name comes twice, or a number is not finite.
    """

    t_us: int
    ids: tuple[str, ...]
    centre_m: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    observed: BoolArray
    clipped: BoolArray
    classes: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    sigma_m: FloatArray = field(default_factory=lambda: np.zeros(0))

    def take(self, rows: list[int]) -> "Observations":
        """Lay out some of the vision objects."""
        taken = dict[str, Any]()  # Any: of fields
        for one in fields(Observations)[1:]:
            value = getattr(self, one.name)
            taken[one.name] = tuple([value[row] for row in rows if value]) if isinstance(value, tuple) else value[rows]
        return Observations(self.t_us, **taken)

    def __post_init__(self) -> None:
        """Check the sizes once, at the border."""
        count = len(self.ids)
        if not len(self.sigma_m):
            object.__setattr__(self, "sigma_m", np.full(count, np.nan))
        where = f"observations at {self.t_us} us"
        if len(set(self.ids)) != count:
            raise AnchoringError(f"{where}: expected different ids, got {self.ids!r}")
        if self.sensors and len(self.sensors) != count:
            raise AnchoringError(f"{where}: expected a sensor for each of {count} ids, got {self.sensors!r}")
        for array in (self.centre_m, self.velocity_mps):
            if array.shape != (count, 2):
                raise AnchoringError(f"{where}: points must have shape {(count, 2)!r}, got {array.shape!r}")
        rows = (self.heading_rad, self.length_m, self.width_m, self.observed, self.clipped, self.sigma_m)
        for row in rows:
            if row.shape != (count,):
                raise AnchoringError(f"{where}: every array must have {count} entries, got {row.shape!r}")
        for name in ("centre_m", "velocity_mps", "heading_rad", "length_m", "width_m"):
            values = getattr(self, name)
            if not np.isfinite(values).all():
                first = int((~np.isfinite(values)).nonzero()[0][0])
                came = values[first].tolist()
                raise AnchoringError(f"{where}: {name} of {self.ids[first]!r}: expected finite numbers, got {came!r}")


@dataclass(frozen=True, slots=True)
class Cars:
    """Hold the cars of one frame; entry k of every array belongs to ``ids[k]``.

    What is told of a car is rounded to centimetres, centimetres a second and milliradians, how sure that is to
    thousandths, as event logs keep it, so that whoever reads it there knows as much as those who saw it live.

    Attributes
    ----------
    t_us : time of the frame.
    ids : symbols, "car1", "car2", ... in order of establishment.
    centre_m, velocity_mps : (n, 2), local east/north frame; predicted where not ``linked``.
    speed_mps, heading_rad : (n,).
    length_m, width_m : (n,) medians of what was seen of the car in full.
    classes : words of `CLASS_NAMES`: what the tracker said last, else the likeliest by size.
    linked : (n,) True where a vision object was seen in this frame; else the car is predicted.
    vision_ids : the vision object behind each car, "" where there is none.
    positions : where the centres are on the road network; all -1 and nan without a network.
    sigma_m : (n,) standard deviation of each coordinate of the centre; nan where the tracker does not say.
    confidence : (n,) 0 to 1, how sure it is that each is one vehicle: by how long it is known, how much of the last
        moments it was seen, and its size in units of its noise; 1 if the tracker does not say how sure its positions
        are. Which vehicle it is, is another question: see `LinkChange.confidence`.
    has_moved : (n,) False of a car that is where it was seen first, as a ghost is; True if the tracker does not
        say how sure its positions are.
    hidden : cars that are not among them, since nobody has seen them for too long to say where they are, but that are
        still expected in the view; and the first frame in which each was not seen.
    """

    t_us: int
    ids: tuple[str, ...]
    centre_m: FloatArray
    speed_mps: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    classes: tuple[str, ...]
    linked: BoolArray
    vision_ids: tuple[str, ...]
    positions: RoadPositions
    sigma_m: FloatArray
    has_moved: BoolArray
    confidence: FloatArray
    hidden: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Round."""
        for name, decimals in _ROUNDED.items():
            object.__setattr__(self, name, getattr(self, name).round(decimals) + 0.0)  # no -0.0, which logs do not keep

    def earlier(
        self,
        rows: list[int],
        t_us: int,
        centre_m: FloatArray,
        velocity_mps: FloatArray,
        heading_rad: FloatArray,
        *,
        locate: Callable[[FloatArray], RoadPositions],
        linked: bool,
    ) -> "Cars":
        """Lay out some of the cars, by row, where they were at another time; sizes and classes are those of now.

        Parameters
        ----------
        locate : finds where centres are on the roads.
        """
        return Cars(
            t_us=t_us,
            ids=tuple([self.ids[k] for k in rows]),
            centre_m=centre_m,
            speed_mps=np.hypot(*velocity_mps.T),
            velocity_mps=velocity_mps,
            heading_rad=heading_rad,
            length_m=self.length_m[rows],
            width_m=self.width_m[rows],
            classes=tuple([self.classes[k] for k in rows]),
            linked=np.full(len(rows), linked),
            vision_ids=tuple([self.vision_ids[k] if linked else "" for k in rows]),
            positions=locate(centre_m.round(DECIMALS)),
            sigma_m=self.sigma_m[rows],
            has_moved=self.has_moved[rows],
            confidence=self.confidence[rows],
        )

    def without_any(self) -> "Cars":
        """Make what is said of the same time when nothing is known of any car."""
        pairs, ones, falses = np.zeros((0, 2)), np.zeros(0), np.zeros(0, np.bool_)
        return Cars(self.t_us, (), pairs, ones, pairs, ones, ones, ones, (), falses, (), nowhere(0), ones, falses, ones)


class LinkChange(NamedTuple):
    """Say that a link between two objects came or went; a tuple, as hundreds come in one frame of a crowd.

    Attributes
    ----------
    t_us : the frame that decided it.
    kind : ``established`` made a new upper object; ``reestablished`` linked one that had lost its lower object;
        ``lost`` means the lower object is gone; ``refuted`` that the two cannot be the same; ``ended`` that the upper
        object is gone for good; ``joined`` that a vision object of another sensor was added to a world object that
        keeps the one it has, ``parted`` that it was taken away. The link itself stays with ``validated`` and
        ``undecided``: the verdict on one that was weighed against others, with the least margin that it ever had.
    level : of the upper object: a world object, an on-road object or a car.
    lower, upper : names; ``lower`` is "" if the upper object ended while it had none.
    reason : for people.
    label : of the link, used once, where it begins or is judged.
    score_nats : log likelihood ratio: the lower object is this one that was lost, against: it is a new one.
    margin_nats : by how much what the link says is likelier than all else that may be; None if nothing else may.
    runner_up : what is next: another world object that the lower one would be, another vision object that would be the
        upper one, or `NEW`.
    hidden_us : of one that was lost and is linked again, the first time at which it was not seen.
    failed : fluents that refuted it; none if something else took its place, which says nothing of the motion.
    """

    t_us: int
    kind: LinkKind
    level: Level
    lower: str
    upper: str
    reason: str
    label: str = ""
    score_nats: float | None = None
    margin_nats: float | None = None
    runner_up: str = ""
    hidden_us: int | None = None
    failed: tuple[str, ...] = ()

    @property
    def confidence(self) -> float:
        """How probable the link is, 0 to 1, by its margin over all else that may be; 1 if nothing else may.

        Examples
        --------
        >>> LinkChange(0, "reestablished", "world", "v2", "w1", "", margin_nats=3.0).confidence
        0.9525741268224334
        """
        return 1.0 if self.margin_nats is None else 1.0 / (1.0 + math.exp(-self.margin_nats))


# What is next best to a lost object that was found again may be that it is a new one.
NEW = "new"


def nowhere(count: int) -> RoadPositions:
    """Make the positions of points that are on no road.

    Examples
    --------
    >>> nowhere(2).road.tolist()
    [-1, -1]
    """
    off = np.full(count, -1, dtype=np.int32)
    none = np.full(count, np.nan)
    return RoadPositions(off, none, none, off, off, none)
