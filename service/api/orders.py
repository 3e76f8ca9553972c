"""What do routes take in their bodies? Models from which the framework reads requests, and writes OpenAPI."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from service.api.asked import DEFAULT_NEAR_MISSES, InWindow
from service.questions.explaining import MAX_NEAR_MISSES, AbsenceQuestion

SOURCE_NAME = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
Text = Annotated[str, Field(pattern=r"^[^\x00]*$")]
"""What databases and files take: JSON may hold halves of characters, which do not fit a pattern either."""
_DETECTOR = "^(auto|motion|motion:thermal|motion:both|onnx:[A-Za-z0-9_-]+)$"


class TextWindow(InWindow):
    """Where chronicle texts are tried."""

    run: Text | None = Field(None, description="Identifier of a run; may be left out if the log holds one.")
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


class MonitorOrder(BaseModel, extra="forbid"):
    """Monitors to try."""

    text: Text
    run: Text | None = Field(None, description="Identifier of a run; may be left out if the log holds one.")


class SourceOrder(BaseModel, extra="forbid"):
    """A file in its place that is to be a source."""

    name: str = Field(pattern=SOURCE_NAME)
    file: Text = Field(description="Its whole path.")


class RunOrder(BaseModel, extra="forbid"):
    """What is to be processed, and how; more is in the options of `dyknow process`."""

    source: Text = Field(description="Its name.")
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
