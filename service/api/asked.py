"""Which parameters do routes about one run take? Models from which the framework reads requests, and writes OpenAPI.

The hot routes about events have tables of their own, see `parameters`.
"""

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, Field, ValidationInfo, WithJsonSchema

from service.api.parameters import MEDIA_TIME
from service.times import parse_media_us


def _media_us(value: str, given: ValidationInfo) -> int:
    assert given.field_name
    return parse_media_us(value, parameter=given.field_name.rstrip("_"))


MediaTime = Annotated[int, BeforeValidator(_media_us), WithJsonSchema(MEDIA_TIME)]


class NoParameters(BaseModel, extra="forbid"):
    """Nothing: a parameter that restricts nothing was meant to, so it is refused."""


class OfRun(NoParameters):
    """Which run is asked about."""

    run: str | None = Field(None, description="Identifier of a run; may be left out if the log holds one.")


class InWindow(OfRun):
    """Which run is asked about, and which time of it."""

    from_: MediaTime | None = Field(None, alias="from", description="Start of the window, media time.")
    to: MediaTime | None = Field(None, description="End of the window, excluded, media time.")
