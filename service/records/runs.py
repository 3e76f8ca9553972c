"""What is known of a run? Its input and site, its chronicles and monitors, and what its streams carried."""

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Literal

from msgspec import Struct

if TYPE_CHECKING:
    from gis.cameras.lens import Lens

RunStatus = Literal["running", "finished", "broken", "interrupted", "failed"]
InputKind = Literal["video", "trajectory", "detections"]
StartFrom = Literal["option", "site", "video", "unknown"]


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


class CameraRecord(Struct, frozen=True, omit_defaults=True):
    """How the ground maps to the image: nine numbers row by row, the frame size in pixels, the lens after that."""

    pixel_from_ground: tuple[float, ...]
    width_px: int
    height_px: int
    radial: float = 0.0

    @property
    def lens(self) -> "Lens | None":
        """The lens that bends the picture; None for a straight one."""
        from gis.cameras.lens import Lens

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


class SiteLane(Struct, frozen=True):
    """A lane: of `edge`, whose lanes run side by side, the one of this index, from the outer side of the road."""

    id: str
    road: str
    edge: str
    index: int
    direction: int
    width_m: float
    speed_limit_mps: float
    centre_line_m: list[tuple[float, float]]


class SiteJunction(Struct, frozen=True):
    """An area where roads meet."""

    id: str
    outline_m: list[tuple[float, float]]


class RunSite(Struct, frozen=True):
    """Roads in local metres, x east and y north; `origin_deg` is the latitude and longitude of (0, 0), if known."""

    run: str
    site: str
    origin_deg: tuple[float, float] | None
    lanes: list[SiteLane]
    junctions: list[SiteJunction]


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
