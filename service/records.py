"""What do events, car states, links, relation changes, streams and runs look like at the edge of the service?

The event log, the HTTP routes and the exports all speak in these structs. What the pipeline writes has no
sequence number yet (`EventDraft`); what comes out of the log has one (`EventRecord`) and never changes afterwards.
Times are integer microseconds of media time, counted from the start of the source; `start` and `end` repeat them on
the UTC calendar. Positions are metres, x east, y north.
"""

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Literal

from msgspec import Struct
from msgspec.structs import asdict

from service.times import format_utc

if TYPE_CHECKING:
    from gis.lens import Lens

EventStatus = Literal["recognised", "tentative", "confirmed", "retracted", "doubtful"]
RunStatus = Literal["running", "finished", "broken", "interrupted", "failed"]
InputKind = Literal["video", "trajectory", "detections"]
StartFrom = Literal["option", "site", "video", "unknown"]
LinkKind = Literal[
    "established", "reestablished", "validated", "undecided", "joined", "parted", "lost", "refuted", "ended"
]
LinkLevel = Literal["world", "on_road", "car"]
Verdict = Literal["validated", "refuted", "undecided"]
OverlayForm = Literal["none", "boxes", "symbols"]


class ChronicleRef(Struct, frozen=True):
    """The chronicle behind an event: its name and the digest of its text."""

    name: str
    version: str


class SubEvent(Struct, frozen=True):
    """One labelled part of an occurrence, and when it happened."""

    label: str
    t_us: int


class Place(Struct, frozen=True):
    """Where an event began: road (empty when off every road) and ground position."""

    road: str
    x_m: float
    y_m: float


class EventDraft(Struct, frozen=True, kw_only=True):
    """An event as the pipeline hands it to the log, before it has a number.

    Attributes
    ----------
    type : name of the emitted event, such as `overtake`.
    start_us, end_us : the interval `[start_us, end_us)`; equal for an event without duration.
    roles : role name to object symbol, `{"overtaker": "car7", "overtaken": "car3"}`.
    hypotheses : identity hypotheses it rests on; `tentative` until all of them are validated.
    recognised_us : media time at which it was recognised; of a newer state, at which that was decided.
    revises : identifier of the event of which this is the newer state; None for an event told the first time.
    confidence : how often what is as sure as this is right, 0 to 1; 1 where nothing says how sure it is.
    """

    type: str
    chronicle: ChronicleRef
    start_us: int
    end_us: int
    roles: dict[str, str]
    recognised_us: int
    status: EventStatus = "recognised"
    confidence: float = 1.0
    hypotheses: tuple[str, ...] = ()
    sub_events: tuple[SubEvent, ...] = ()
    place: Place | None = None
    revises: str | None = None


class EventRecord(Struct, frozen=True, kw_only=True):
    """An event of the log: the JSON object of HTTP and of each line of JSONL.

    Attributes
    ----------
    id : opaque, unique in the log and the same when the run is repeated; empty of what is in none.
    seq : grows with every row ever written to this log; never used twice; 0 of what is in none.
    start, end : the interval on the UTC calendar, RFC 3339 with six decimals.
    status : `recognised` if it rests on nothing open, else `tentative`; its newer state is `confirmed` or `retracted`.
        `doubtful` if it is less sure than its chronicle, or who processed it, asks for.
    confidence : how often what is as sure as this is right, 0 to 1, in thousandths; 1 where nothing says how sure it
        is.
    revises : identifier of the event of which this is the newer state; null for an event told the first time.
    """

    id: str
    seq: int
    type: str
    chronicle: ChronicleRef
    source: str
    run: str
    start: str
    end: str
    start_us: int
    end_us: int
    roles: dict[str, str]
    status: EventStatus
    confidence: float = 1.0
    hypotheses: tuple[str, ...]
    sub_events: tuple[SubEvent, ...]
    place: Place | None
    recognised_us: int
    revises: str | None = None

    @classmethod
    def of(cls, draft: EventDraft, run: "RunRecord", event_id: str = "", seq: int = 0) -> "EventRecord":
        """Put an event of a run on the calendar, and give it its names."""
        zero_us = run.start_utc_us
        return cls(
            id=event_id,
            seq=seq,
            source=run.source,
            run=run.id,
            start=format_utc(zero_us + draft.start_us),
            end=format_utc(zero_us + draft.end_us),
            **asdict(draft),
        )


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


class StreamInput(Struct, frozen=True):
    """A stream that a process reads, and the policy in the words of KPL."""

    label: str
    policy: str


class ProcessRecord(Struct, frozen=True, kw_only=True):
    """A process as it was declared.

    Attributes
    ----------
    kind : `source`, `refinement`, `selection`, `collection` or `configuration`.
    made_of : name of the source or computational unit.
    type : what its samples carry, in the words of KPL.
    """

    label: str
    kind: str
    made_of: str
    type: str
    inputs: tuple[StreamInput, ...]


class StreamRecord(ProcessRecord, frozen=True, kw_only=True):
    """What one process and its stream did in a run: a `StreamReport` of `dyknow.streams` without the measured cost.

    What a clock measures differs each time, and a repeated run must give the same rows: it has a table of its own.
    """

    waiting_for: tuple[str, ...] = ()
    published: int = 0
    delivered: int = 0
    dropped: dict[str, int] = {}
    subscribers: int = 0
    queued: tuple[int, ...] = ()
    rate_hz: float = 0.0
    lag_us: int | None = None
    last_valid_us: int | None = None
    last_value: str | None = None
    updates: int = 0


class SourceText(Struct, frozen=True):
    """A text that chronicles or streams were read from, and what messages call it."""

    name: str
    text: str


class ChronicleRecord(Struct, frozen=True, kw_only=True):
    """A chronicle a run used, with its canonical text and the declarations it rests on.

    Attributes
    ----------
    parameters : the header variables without `?`, which become the roles of its events.
    file : where the text came from, for people.
    """

    name: str
    version: str
    parameters: tuple[str, ...]
    text: str
    file: str = ""


class MonitorRecord(Struct, frozen=True):
    """A monitor a run used, with its canonical text."""

    name: str
    version: str
    text: str


class MonitorVerdict(Struct, frozen=True):
    """What a monitor told of some objects: since when they had been looked at, and when the outcome was certain."""

    monitor: ChronicleRef
    outcome: str
    roles: dict[str, str]
    since_us: int
    t_us: int


class CameraRecord(Struct, frozen=True, omit_defaults=True):
    """How the ground maps to the image: nine numbers row by row, the frame size in pixels, the lens after that."""

    pixel_from_ground: tuple[float, ...]
    width_px: int
    height_px: int
    radial: float = 0.0

    @property
    def lens(self) -> "Lens | None":
        """The lens that bends the picture; None for a straight one."""
        from gis.lens import Lens

        return Lens((self.width_px, self.height_px), self.radial) if self.radial else None


class InputFile(Struct, frozen=True, kw_only=True):
    """The file that a run read.

    Attributes
    ----------
    path : absolute, when it was processed.
    digest : of its bytes; the same file elsewhere has the same.
    first_pts_us : the time stamp in the video that is media time 0; a player shows a frame at its media time plus this.
    codec, width_px, height_px : of the video; None for other files, as `first_pts_us`.
    """

    path: str
    size_bytes: int
    digest: str
    first_pts_us: int | None = None
    codec: str | None = None
    width_px: int | None = None
    height_px: int | None = None


class SiteRecord(Struct, frozen=True, omit_defaults=True):
    """The site file that a run read: its absolute path then, and a digest of all files that it depends on.

    `origin_deg` is the latitude and longitude of the point (0, 0), WGS84; None where the file, or an older log, does
    not say.
    """

    path: str
    digest: str
    origin_deg: tuple[float, float] | None = None


class RunRecord(Struct, frozen=True, kw_only=True):
    """One pass of one input through the pipeline.

    Attributes
    ----------
    id : given by the caller, a digest of all inputs, so that a repeated run replaces itself.
    source : short name of the input, the value of `source` on its events.
    start_utc_us : UTC time of media time zero, microseconds since 1970-01-01.
    start_from : who said so; `unknown` is 1970, or a log from before this was kept.
    file : the input; None in a log from before this was kept.
    site, site_file : its name, and where it came from; None without one, or in a log from before this was kept.
    camera : None for an input without pixels.
    warnings : what the user was told, such as a missing camera.
    monitors : the monitors that ran beside the chronicles.
    texts : all texts that the chronicles were read from, in the order of reading: together they give the same set.
    relations : names of the relations that were watched; no other is in the log.
    detector : which detector looked at the input, and what computed it; empty for trajectories.
    kpl : the text that declared the streams; empty for the shipped one.
    linkage : the text of classes and links of anchoring; empty for the shipped one.
    settings : the settings that differ from the defaults, as text.
    reason : why the run stopped early; empty when it finished.
    """

    id: str
    source: str
    start_utc_us: int
    start_from: StartFrom = "unknown"
    file: InputFile | None = None
    input_kind: InputKind = "video"
    input: str = ""
    site: str = ""
    site_file: SiteRecord | None = None
    detector: str = ""
    camera: CameraRecord | None = None
    chronicles: tuple[ChronicleRecord, ...] = ()
    monitors: tuple[MonitorRecord, ...] = ()
    texts: tuple[SourceText, ...] = ()
    relations: tuple[str, ...] = ()
    kpl: str = ""
    linkage: str = ""
    settings: dict[str, str] = {}
    warnings: tuple[str, ...] = ()
    software: str = ""
    status: RunStatus = "running"
    reason: str = ""


def software_version() -> str:
    """Return the version of the installed package, or `0` when run from a bare checkout."""
    try:
        return version("dyknow")
    except PackageNotFoundError:
        return "0"
