"""What does a run see? Vision objects and cars, frame by frame, their links, and the relations among cars."""

from typing import Literal

from msgspec import Struct

LinkKind = Literal[
    "established", "reestablished", "validated", "undecided", "joined", "parted", "lost", "refuted", "ended"
]
LinkLevel = Literal["world", "on_road", "car"]
Verdict = Literal["validated", "refuted", "undecided"]
OverlayForm = Literal["none", "boxes", "symbols"]


class Drawing(Struct, frozen=True):
    """What is drawn on pictures, and how wide they are at most; None: as they come."""

    overlay: OverlayForm = "symbols"
    width_px: int | None = None


# In MOT text the upper left corner of the image's first pixel is (1, 1); with us its centre is (0, 0).
MOT_OFFSET_PX = 1.5


class CarState(Struct, frozen=True, gc=False):
    """One car at one frame.

    Attributes
    ----------
    car_class : `car`, `truck`, `bus`, `motorcycle`, `van` or `unknown`.
    road, lane : empty when off every road or lane.
    along_m : metres along the road's reference line; None off-road.
    linked : False when the position is predicted, because the tracker has lost the car.
    vision_id : the vision object it is linked to, empty when predicted.
    sigma_m, has_moved, confidence : how sure the place is, whether it is no ghost, and how sure it is that it is one
        vehicle, as in `anchoring.observations.Cars`; None, True and 1 where nobody says, as in older logs.
    """

    t_us: int
    car: str
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float
    car_class: str = "unknown"
    road: str = ""
    along_m: float | None = None
    lane: str = ""
    linked: bool = True
    vision_id: str = ""
    sigma_m: float | None = None
    has_moved: bool = True
    confidence: float = 1.0


class SeenObject(Struct, frozen=True, gc=False):
    """One vision object at one frame, before it is linked to anything.

    Attributes
    ----------
    vision_id : its name, which dies with the track.
    observed : False where nothing was detected in this frame and the position is predicted.
    clipped : True where it reaches over the edge of the view: centre and length are then guesses.
    """

    t_us: int
    vision_id: str
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float
    observed: bool
    clipped: bool


class FrameRecord(Struct, frozen=True, gc=False):
    """One frame that was looked at.

    Attributes
    ----------
    number : from 1 over the frames of the source, those that were not looked at included.
    """

    number: int
    t_us: int


class LeftOutFrame(FrameRecord, frozen=True, gc=False):
    """One frame of the source that was not looked at."""


class ViewRecord(Struct, frozen=True):
    """Where a moving camera looked in one frame.

    Attributes
    ----------
    pixel_from_ground : the map from the ground to the image, nine numbers row by row; empty where the view was lost.
    """

    t_us: int
    pixel_from_ground: tuple[float, ...]


class CarRecord(Struct, frozen=True):
    """A car symbol over its whole life.

    Attributes
    ----------
    number : 1, 2, ... in the order of first sight within the run.
    first_us, last_us : its first and last state, both included.
    """

    car: str
    number: int
    car_class: str
    first_us: int
    last_us: int


class LinkRecord(Struct, frozen=True):
    """One change in the chain from a vision object to a car symbol, or the verdict on a link that was weighed.

    Attributes
    ----------
    kind : `validated` and `undecided` tell a verdict and end nothing; `joined` and `parted` tell of the vision object
        of another sensor that it was added to a world object that keeps the one it has, and taken away.
    label : of the link, where it begins or is judged; the name of its hypothesis.
    score_nats : how much likelier the lower object is this one that was lost than a new one; None for what was new.
    margin_nats : by how much the link was likelier than all else, at worst by then; None if nothing else might be.
    runner_up : what else: another world object, another vision object, or `new`.
    hidden_us : since when a car that is found again was not seen.
    confidence : how probable the link is, by its margin; 1 if nothing else might be.
    """

    t_us: int
    kind: LinkKind
    level: LinkLevel
    lower: str
    upper: str
    reason: str = ""
    label: str = ""
    score_nats: float | None = None
    margin_nats: float | None = None
    runner_up: str = ""
    hidden_us: int | None = None
    confidence: float = 1.0


class RelationRecord(Struct, frozen=True, gc=False):
    """One relation changing its value.

    Attributes
    ----------
    t_us : when the value crossed, possibly between two frames.
    decided_us : the frame at which hysteresis confirmed it.
    old, new : the values as chronicles write them: `true`, `false`, `unknown`, or a word such as `left`.
    hypotheses : labels of the links that it rests on and that were on trial then.
    confidence : how probable it is that it really changed, 0 to 1, in thousandths; 1 where nothing says how sure it is.
    """

    t_us: int
    decided_us: int
    name: str
    args: tuple[str, ...]
    old: str
    new: str
    hypotheses: tuple[str, ...] = ()
    confidence: float = 1.0


class HypothesisRecord(Struct, frozen=True):
    """What has become of a link on trial, and when; the field order is the column order of the log."""

    t_us: int
    label: str
    verdict: Verdict
