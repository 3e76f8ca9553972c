"""How does chronicle recognition sit in a stream graph? A DyKnow process: relation changes in, occurrences out."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol, TypeVar

from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from dyknow.sample import Sample
from dyknow.streams.hypotheses import Hypotheses


class Change(Protocol):
    """Describe a change of a qualitative relation: a truth value or a word; None stands for unknown."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def args(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def t_us(self) -> int: ...  # noqa: D102
    @property
    def old(self) -> bool | str | None: ...  # noqa: D102
    @property
    def new(self) -> bool | str | None: ...  # noqa: D102
    @property
    def confidence(self) -> float: ...  # noqa: D102


_Change = TypeVar("_Change", bound=Change)


class FrameChanges(Protocol[_Change]):
    """Describe the changes of one frame, and what has become of the hypotheses that changes rest on."""

    @property
    def changes(self) -> Sequence[_Change]: ...  # noqa: D102
    @property
    def hypotheses(self) -> Hypotheses: ...  # noqa: D102
    def hypotheses_of(self, change: _Change) -> tuple[str, ...]: ...  # noqa: D102


class RecognitionUnit:
    """Run a recogniser as a computational unit.

    Every sample, with changes or without, moves the recogniser's clock, so absences conclude in quiet traffic too. An
    occurrence comes out each time its status changes: tentative first, confirmed or retracted later.

    Parameters
    ----------
    horizon_us : see `finish`.
    now_us : how far the recogniser has come already.
    """

    def __init__(self, recogniser: Recogniser, *, horizon_us: int, now_us: int = 0) -> None:
        self._recogniser = recogniser
        self._horizon_us = horizon_us
        self._now_us = now_us

    @property
    def left_out(self) -> Mapping[str, int]:
        """Count by chronicle the instances that were beyond its limits."""
        return {f"instances of {name}": count for name, count in self._recogniser.left_out.items()}

    def update(self, sample: Sample[FrameChanges[_Change]]) -> Iterable[Sample[Occurrence]]:
        """Take what one frame decided, all at once, then let time pass up to the frame."""
        self._now_us = sample.valid_us
        frame, known = sample.value, sample.value.hypotheses
        occurrences = self._recogniser.revise(
            opened=known.opened,
            refuted=known.refuted,
            confirmed=known.validated,
            undecided=known.undecided,
            events=[event_of(change, frame.hypotheses_of(change)) for change in frame.changes],
        )
        occurrences += self._recogniser.advance(sample.valid_us)
        return [Sample(sample.available_us, occurrence.end_us, occurrence) for occurrence in occurrences]

    def finish(self) -> Iterable[Sample[Occurrence]]:
        """Conclude what the end of the input allows: no later change can come any more.

        Time moves on by ``horizon_us``, the lateness of the changes, so that everything observed takes part. Absences
        whose window reaches beyond the end of the input stay open: nobody saw them come true. Hypotheses that are open
        will never be decided: what is tentative stays so.
        """
        occurrences = self._recogniser.revise(undecided=self._recogniser.open_hypotheses)
        occurrences += self._recogniser.advance(self._now_us + self._horizon_us)
        return [Sample(self._now_us, occurrence.end_us, occurrence) for occurrence in occurrences]


def event_of(change: Change, hypotheses: tuple[str, ...] = ()) -> Event:
    """Make the event that a change of a relation is to chronicles."""
    old, new = value_text(change.old), value_text(change.new)
    return Event(change.name, change.args, change.t_us, old, new, hypotheses, change.confidence)


def value_text(value: bool | str | None) -> str:
    """Write a value of a relation as chronicles do.

    Examples
    --------
    >>> value_text(True), value_text("left"), value_text(None)
    ('true', 'left', 'unknown')
    """
    if isinstance(value, str):
        return value
    return "unknown" if value is None else "true" if value else "false"
