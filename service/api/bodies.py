"""What do the answers of the HTTP interface look like? The structs that are sent, and that OpenAPI describes."""

from typing import Annotated, Any, Literal  # Any: JSON values

from msgspec import Meta, Struct

from service.questions.explaining import MAX_NEAR_MISSES
from service.questions.identity import CarIdentity, IdentityLink
from service.records import ChronicleRecord, EventRecord
from service.store.chronicle_texts import ChronicleText
from service.store.jobs import JobState
from service.store.sources import Source

SOURCE_NAME = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
_ONLY = r"(?!\n)"  # behind `$`, which in Python stands before a last newline too


class EventList(Struct, frozen=True):
    """One page of events; `next_cursor` is null on the last page, `as_of_seq` the newest number in the log.

    `notes` stand where nothing was found, and only if there are any: names that the log does not hold, and runs that
    did not come to their end.
    """

    items: list[EventRecord]
    next_cursor: str | None
    as_of_seq: int
    notes: list[str] = []


class ChronicleUse(ChronicleRecord, frozen=True, kw_only=True):
    """A chronicle with where it comes from: shipped with DyKnow, used by runs of this log, or both."""

    is_shipped: bool
    runs: list[str]


class ChronicleList(Struct, frozen=True):
    """All chronicles; one name may come in several versions. `texts` are the newest ones that the log holds."""

    items: list[ChronicleUse]
    texts: list[ChronicleText]


class TextVersions(Struct, frozen=True):
    """The versions of a chronicle text, oldest first; one without a text says that it ended then."""

    items: list[ChronicleText]


class LaidOut(Struct, frozen=True):
    """A chronicle text in the one layout."""

    text: str


class Window(Struct, kw_only=True, forbid_unknown_fields=True, rename={"from_": "from"}):
    """Where chronicles are looked for: a run, which may be left out if the log holds one, and media times."""

    run: str | None = None
    from_: str | int | None = None
    to: str | int | None = None


class TrialRequest(Window, kw_only=True, forbid_unknown_fields=True):
    """A text to try, and how many near misses of each of its chronicles are wanted."""

    text: str
    limit: Annotated[int, Meta(ge=1, le=MAX_NEAR_MISSES)] = 5


class DifferenceRequest(Window, kw_only=True, forbid_unknown_fields=True):
    """Two texts to compare."""

    before: str
    after: str


class EventExplanation(Struct, frozen=True):
    """Why an event was recognised; `explanation` is an `Explanation` of kind `why`, `identities` goes by role.

    `weakest` names the event that makes it no surer; empty where all are sure.
    """

    event: str
    confidence: float
    weakest: str
    explanation: dict[str, Any]
    identities: dict[str, list[IdentityLink]]


class CarList(Struct, frozen=True):
    """The cars of a run, in the order of first sight."""

    run: str
    items: list[CarIdentity]


class LinkList(Struct, frozen=True):
    """The links by which a car was the car it was, oldest first."""

    run: str
    car: str
    items: list[IdentityLink]


class Index(Struct, frozen=True):
    """Where to go from here."""

    name: str
    version: str
    as_of_seq: int
    default_limit: int
    max_limit: int
    links: dict[str, str]


class SourceList(Struct, frozen=True):
    """The sources of the log, by name."""

    items: list[Source]


class SourceRequest(Struct, forbid_unknown_fields=True):
    """A file in its place, by its whole path, and the name of the source that it is to be."""

    name: Annotated[str, Meta(pattern=SOURCE_NAME + _ONLY)]
    file: str


class RunOrder(Struct, kw_only=True, forbid_unknown_fields=True):
    """What is to be processed, and how; the rest is as for `dyknow process`.

    Attributes
    ----------
    source : its name.
    chronicles : names of chronicle texts of the log; none means the library.
    detector : `auto`, `motion`, `motion:thermal`, `motion:both` or `onnx:NAME`.
    rate_hz : frames looked at in a second; `full` for all.
    site : the whole path of a site file.
    start_utc : RFC 3339.
    """

    source: str
    chronicles: list[str] = []
    detector: (
        Annotated[str, Meta(pattern=r"^(auto|motion|motion:thermal|motion:both|onnx:[A-Za-z0-9_-]+)$" + _ONLY)] | None
    ) = None
    rate_hz: Annotated[float, Meta(gt=0)] | Literal["full"] | None = None
    site: str | None = None
    start_utc: str | None = None
    min_confidence: Annotated[float, Meta(ge=0, le=1)] | None = None
    final: bool = False


class JobStatus(Struct, frozen=True):
    """A job; `run` is what it became once it has finished, `message` how far it is or what went wrong."""

    id: str
    state: JobState
    input: str
    run: str | None
    attempts: int
    cancel_requested: bool
    message: str


class JobList(Struct, frozen=True):
    """The jobs of the log, in their order."""

    items: list[JobStatus]


class ProblemDetail(Struct, frozen=True, omit_defaults=True):
    """What is wrong with one parameter."""

    detail: str
    parameter: str | None = None


class Problem(Struct, frozen=True, omit_defaults=True):
    """An error by RFC 9457; `type` is `about:blank` where the status says it all, `findings` are those of a text."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    request_id: str
    errors: list[ProblemDetail] = []
    findings: list[dict[str, Any]] = []
