"""What do the answers of the HTTP interface look like? The structs that are sent, and that OpenAPI describes."""

from typing import Any  # JSON values

from msgspec import Struct

from dyknow.language.diagnostics import Severity
from dyknow.mtl.monitors import MonitorReport
from service.questions.events.summaries import By, Counted
from service.questions.observations.car_tracks import CarColumns
from service.questions.observations.coverage import LookedAt, Spans
from service.questions.observations.identity import CarIdentity, IdentityLink
from service.questions.recognition.awaited import AwaitedList
from service.records.events import ChronicleRef, EventRecord, MonitorVerdict
from service.records.runs import (
    CameraRecord,
    ChronicleRecord,
    InputFile,
    InputKind,
    MonitorRecord,
    RunStatus,
    StartFrom,
)
from service.store.entries import ChronicleText, JobKind, JobState, Source, Undelivered, WebhookState
from service.store.upkeep import Holding


class EventList(Struct, frozen=True):
    """One page of events; `next_cursor` is null on the last page, `as_of_seq` the newest number in the log.

    `looked_at` tells for each run that was asked about which media time it looked at: at others nobody watched. It is
    null where there are more than a hundred, whose list tells it of all, and of an older state of the log. `count` is
    there if it was asked for, and `notes` where nothing was found: names that the log does not hold, and runs that did
    not come to their end.
    """

    items: list[EventRecord]
    next_cursor: str | None
    as_of_seq: int
    looked_at: list[LookedAt] | None
    count: int | None = None
    notes: list[str] = []


class EventSummary(Struct, frozen=True):
    """How many events there are by type, road, object or hour of the day; `looked_at` as in lists of events."""

    by: By
    bin_us: int | None
    as_of_seq: int
    items: list[Counted]
    looked_at: list[LookedAt] | None


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


class SourceList(Struct, frozen=True):
    """The sources of the log, by name, and the names of live ones."""

    items: list[Source]
    cameras: list[str]


class JobStatus(Struct, frozen=True):
    """A job; `run` is what it became once it has finished, `message` how far it is or what went wrong."""

    id: str
    kind: JobKind
    state: JobState
    input: str
    run: str | None
    attempts: int
    cancel_requested: bool
    message: str


class JobList(Struct, frozen=True):
    """The jobs of the log, in their order; `next_cursor` is null on the last page."""

    items: list[JobStatus]
    next_cursor: str | None


class EventExplanation(Struct, frozen=True):
    """Why an event was recognised; `explanation` is an `Explanation` of kind `why`, `identities` goes by role.

    `weakest` names the event that makes it no surer; empty where all are sure.
    """

    event: str
    confidence: float
    weakest: str
    explanation: dict[str, Any]
    identities: dict[str, list[IdentityLink]]


class AwaitedAnswer(AwaitedList, frozen=True, kw_only=True):
    """The same; `looked_at` says in which time anything could come."""

    looked_at: list[LookedAt]


class CarList(Struct, frozen=True):
    """The cars of a run, in the order of first sight; `looked_at` says in which time there could be any."""

    run: str
    items: list[CarIdentity]
    looked_at: list[LookedAt]


class LinkList(Struct, frozen=True):
    """The links by which a car was the car it was, oldest first; `looked_at` says when it could be seen."""

    run: str
    car: str
    items: list[IdentityLink]
    looked_at: list[LookedAt]


class Tracks(Struct, frozen=True):
    """Where cars were; `looked_at` says in which time there could be any."""

    run: str
    columns: CarColumns
    looked_at: list[LookedAt]


class RunSummary(Struct, frozen=True, kw_only=True):
    """A run; `looked_at_us` is the media time that it looked at, without that in which its view was lost."""

    id: str
    source: str
    status: RunStatus
    reason: str
    input_kind: InputKind
    start_utc_us: int
    start_from: StartFrom
    site: str
    detector: str
    software: str
    looked_at_us: Spans = ()


class RunDetail(RunSummary, frozen=True, kw_only=True):
    """What a run was made of, and what has come of it.

    `covered_us` are the times of its first and last frame: how far it has come; `lost_us` says when its view was lost;
    `holds` says of each kind how many rows there are. `path` of the file is its name alone.
    """

    file: InputFile | None
    camera: CameraRecord | None
    warnings: tuple[str, ...]
    settings: dict[str, str]
    relations: tuple[str, ...]
    chronicles: tuple[ChronicleRef, ...]
    monitors: tuple[MonitorRecord, ...]
    covered_us: tuple[int, int] | None = None
    lost_us: Spans = ()
    cars: int = 0
    holds: list[Holding] = []


class MonitorTrial(Struct, frozen=True):
    """What monitors would have told of a run: the first of `count` verdicts, and what became of each monitor."""

    run: str
    count: int
    items: list[MonitorVerdict]
    monitors: tuple[MonitorReport, ...]
    looked_at: list[LookedAt]


class RunList(Struct, frozen=True):
    """All runs that were asked for, in the order in which they first came to the log."""

    items: list[RunSummary]


class WebhookList(Struct, frozen=True):
    """The webhooks by name, and what they gave up, in the order of writing."""

    items: list[WebhookState]
    undelivered: list[Undelivered]


class RetriedWebhook(Struct, frozen=True):
    """How many events of a webhook will be tried once more."""

    webhook: str
    due: int


class Index(Struct, frozen=True):
    """Where to go from here."""

    name: str
    version: str
    as_of_seq: int
    default_limit: int
    max_limit: int
    links: dict[str, str]


class Position(Struct, frozen=True):
    """A place in a text, both counted from 0, `character` in UTF-16 units."""

    line: int
    character: int


class Range(Struct, frozen=True):
    """A piece of a text, without its end."""

    start: Position
    end: Position


class Edit(Struct, frozen=True, rename="camel"):
    """What to write in place of a piece of a text."""

    range: Range
    new_text: str


class Related(Struct, frozen=True):
    """Another place that a finding is about."""

    file: str
    range: Range
    message: str


class Finding(Struct, frozen=True):
    """What is wrong or doubtful in a text, with its place as the Language Server Protocol has it."""

    code: str
    severity: Severity
    message: str
    file: str
    range: Range
    hint: str
    edit: Edit | None
    related: list[Related]


class Findings(Struct, frozen=True):
    """Errors and warnings of a chronicle text."""

    findings: list[Finding]


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
    findings: list[Finding] = []
