"""What does a log hold that belongs to no run? A struct for each kind, from which `schema` makes its table."""

import json
from typing import Literal, get_args

from msgspec import Struct

JobState = Literal["waiting", "running", "finished", "failed", "cancelled"]
UNDER_WAY: tuple[JobState, ...] = ("waiting", "running")  # in which order jobs are taken
ENDED: tuple[JobState, ...] = ("finished", "failed", "cancelled")
JobKind = Literal["run", "live"]

Scope = Literal["read", "write", "admin"]
"""What a token allows, from the least to the most; each allows what those before it do."""

SCOPES: tuple[Scope, ...] = get_args(Scope)


class Job(Struct, frozen=True):
    """Something to be processed.

    Attributes
    ----------
    number : by which jobs are taken, from 1.
    id : the same for the same request.
    request : as `service.runs.requests` writes it.
    attempts : how often it was begun.
    cancel_requested : somebody asked for its end.
    message : how far it has come, what it found, or what went wrong; warnings are lines of their own.
    kind : a run over a file, or a live source, which has no end.
    """

    number: int
    id: str
    request: str
    state: JobState = "waiting"
    attempts: int = 0
    cancel_requested: bool = False
    message: str = ""
    kind: JobKind = "run"

    @property
    def input(self) -> str:
        """The path of what is to be processed, or the address of what is to be watched."""
        return str(json.loads(self.request)["input"])

    @property
    def recordings(self) -> str | None:
        """The folder that a live source is recorded into; None for a run over a file."""
        folder: str | None = json.loads(self.request).get("recordings")
        return folder

    @property
    def run(self) -> str | None:
        """The run that it became, once it has finished; a live source has many."""
        named = self.message.partition(":")[0].removeprefix("run ")
        return named if (self.kind, self.state) == ("run", "finished") else None

    @property
    def has_ended(self) -> bool:
        """Whether nobody will be at it any more, unless it is asked for again."""
        return self.state in ENDED


class WebhookState(Struct, frozen=True):
    """How far a webhook is.

    Attributes
    ----------
    seq : all up to this sequence number is delivered or given up.
    message : what keeps the next one from being delivered; empty if nothing does.
    """

    name: str
    seq: int
    message: str = ""


class Undelivered(Struct, frozen=True):
    """An event that was given up: what came of the last attempt, and whether it is to be tried once more."""

    webhook: str
    seq: int
    body: str
    message: str
    is_due: bool = False


class Token(Struct, frozen=True):
    """What is known of a token.

    Attributes
    ----------
    name : unique in its log; the audit names it.
    expires_us : when it ends, since 1970-01-01 UTC; None for never.
    """

    name: str
    digest: str
    scope: Scope
    made_us: int
    expires_us: int | None = None

    def allows(self, scope: Scope) -> bool:
        """Tell whether the scope is no more than its own.

        Examples
        --------
        >>> [Token("office", "", "write", 0).allows(one) for one in SCOPES]
        [True, True, False]
        """
        return SCOPES.index(scope) <= SCOPES.index(self.scope)

    def is_valid(self, now_us: int) -> bool:
        """Tell whether it has not ended."""
        return self.expires_us is None or now_us < self.expires_us


class Written(Struct, frozen=True):
    """A request that may have changed something.

    Attributes
    ----------
    at_us : when it was answered, since 1970-01-01 UTC.
    token : the name of the token, or `loopback`.
    status : of the answer; from 400 on nothing was changed.
    """

    at_us: int
    token: str
    method: str
    path: str
    status: int
    request_id: str


class Source(Struct, frozen=True):
    """Something that can be processed.

    Attributes
    ----------
    file : its path; of what was uploaded, within the folder of uploads.
    digest : SHA-256 of what was uploaded, hexadecimal; empty of other files.
    size : bytes, when it became a source.
    made_us : when that was, UTC.
    """

    name: str
    file: str
    digest: str
    size: int
    made_us: int


class ChronicleText(Struct, frozen=True):
    """A version of a text; one without a text says that it ended.

    Attributes
    ----------
    version : counts from 1 for each name, ends too.
    made_us : when it was stored, UTC.
    """

    name: str
    version: int
    text: str | None
    made_us: int
