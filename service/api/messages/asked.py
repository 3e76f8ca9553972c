"""What do routes take? Models of parameters and bodies, from which the framework reads requests and writes OpenAPI.

Requests about events, of which there are most, are read by msgspec: see `parameters`.
"""

from typing import Annotated, Final, Literal, Self

from fastapi import Query
from pydantic import BaseModel, BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator

from service.api.messages.parameters import MEDIA_TIME
from service.errors import FilterError, QueryError
from service.export.events import ROLE_PREFIX
from service.questions.events.queries import DEFAULT_LIMIT, MAX_LIMIT
from service.questions.recognition.explaining import MAX_NEAR_MISSES, AbsenceQuestion
from service.records.times import parse_media_us

DEFAULT_NEAR_MISSES = 5
SOURCE_NAME = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
Text = Annotated[str, Field(pattern=r"^[^\x00]*$")]
"""What databases and files take: JSON may hold halves of characters, which do not fit a pattern either."""
_DETECTOR = "^(auto|motion|motion:thermal|motion:both|onnx:[A-Za-z0-9_-]+)$"


def _media_us(value: object, given: ValidationInfo) -> int:
    assert given.field_name
    return parse_media_us(str(value), parameter=given.field_name.rstrip("_"))


MediaTime = Annotated[int, BeforeValidator(_media_us), WithJsonSchema(MEDIA_TIME)]


Form = Annotated[Literal["json", "geojson"], Field(description="GeoJSON needs a site file with [frame].")]
GEOJSON: Final = "application/geo+json"


class NoParameters(BaseModel, extra="forbid"):
    """Nothing: a parameter that restricts nothing was meant to, so it is refused."""


def take_none(asked: Annotated[NoParameters, Query()]) -> None:
    """Take no parameters: what routes depend on that take none."""


class Paged(NoParameters):
    """Which page of a list is asked for."""

    limit: int = Field(DEFAULT_LIMIT, ge=1, le=MAX_LIMIT, description="Items on a page.")
    cursor: str | None = Field(None, description="`next_cursor` of the page before.")


class OfRun(NoParameters):
    """Which run is asked about."""

    run: Text | None = Field(None, description="Identifier of a run; may be left out if the log holds one.")


class InWindow(OfRun):
    """Which run is asked about, and which time of it."""

    from_: MediaTime | None = Field(None, alias="from", description="Start of the window, media time.")
    to: MediaTime | None = Field(None, description="End of the window, excluded, media time.")

    @model_validator(mode="after")
    def _check_window(self) -> Self:
        if self.from_ is not None and self.to is not None and self.from_ >= self.to:
            raise FilterError(
                f"from: expected a time before 'to' ({self.to} us), got {self.from_} us", parameter="from"
            )
        return self


class _OfRoles(OfRun, extra="allow"):
    """Which run is asked about, and what fills some roles there: `role.NAME`, whose names nobody knows beforehand."""

    __pydantic_extra__: dict[str, str]
    limit: int = Field(DEFAULT_NEAR_MISSES, ge=1, le=MAX_NEAR_MISSES, description="Instances at most.")

    def about(self, chronicle: str, start_us: int | None, end_us: int | None) -> AbsenceQuestion:
        """Ask about a chronicle in a window.

        Raises
        ------
        QueryError
            If there is another parameter than roles.
        """
        roles = self.__pydantic_extra__
        for name in roles:
            if not name.startswith(ROLE_PREFIX) or name == ROLE_PREFIX:
                raise QueryError(f"query: expected a parameter of this path or role.NAME, got {name!r}", parameter=name)
        return AbsenceQuestion(
            chronicle=chronicle,
            run=self.run,
            roles={name.removeprefix(ROLE_PREFIX): actor for name, actor in roles.items()},
            start_us=start_us,
            end_us=end_us,
            limit=self.limit,
        )


class Absence(_OfRoles, InWindow, extra="allow"):
    """Which near misses of a chronicle are asked about."""


class Awaited(_OfRoles):
    """What a chronicle waited for at a time, and what ended since another one."""

    at: MediaTime | None = Field(None, description="When, media time; the end of the run, if left out.")
    from_: MediaTime | None = Field(None, alias="from", description="Since when, media time.")


class TextWindow(InWindow):
    """Where chronicle texts are tried."""

    limit: int = Field(DEFAULT_NEAR_MISSES, ge=1, le=MAX_NEAR_MISSES, description="Near misses of each chronicle.")

    def question(self) -> AbsenceQuestion:
        """Ask about the window, and no chronicle yet."""
        return AbsenceQuestion(
            chronicle="", run=self.run, roles={}, start_us=self.from_, end_us=self.to, limit=self.limit
        )


class TrialOrder(TextWindow):
    """A text to try."""

    text: Text


class DifferenceOrder(TextWindow):
    """Two texts to compare."""

    before: Text
    after: Text


class MonitorOrder(OfRun):
    """Monitors to try."""

    text: Text


class SourceOrder(BaseModel, extra="forbid"):
    """A file in its place that is to be a source."""

    name: str = Field(pattern=SOURCE_NAME)
    file: Text = Field(description="Its whole path.")


class RunOrder(BaseModel, extra="forbid"):
    """What is to be processed, and how; more is in the options of `dyknow process`."""

    source: Text = Field(description="Its name, or that of a camera.")
    chronicles: list[Text] = Field([], description="Names of chronicle texts of the log; none means the library.")
    detector: str | None = Field(None, pattern=_DETECTOR)
    rate_hz: Annotated[float, Field(gt=0)] | Literal["full"] | None = None
    site: Text | None = Field(None, description="The whole path of a site file.")
    monitors: list[Text] = Field([], description="The whole paths of files of monitors.")
    kpl: Text | None = Field(None, description="The whole path of a file that declares the streams.")
    linkage: Text | None = Field(None, description="The whole path of a file of classes and links.")
    start_utc: Text | None = Field(None, description="RFC 3339.")
    min_confidence: float | None = Field(None, ge=0, le=1)
    final: bool = False
