"""How does chronicle recognition sit in a stream graph? A DyKnow process: relation changes in, occurrences out."""

from collections.abc import Iterable, Sequence
from typing import Protocol

from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from dyknow.sample import Sample


class Change(Protocol):
    """Describe a change of a qualitative relation; None stands for unknown."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def args(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def t_us(self) -> int: ...  # noqa: D102
    @property
    def old(self) -> bool | None: ...  # noqa: D102
    @property
    def new(self) -> bool | None: ...  # noqa: D102


class RecognitionUnit:
    """Run a recogniser as a computational unit.

    Every sample, with changes or without, moves the recogniser's clock, so absences conclude in quiet traffic too.
    """

    __slots__ = ("_horizon_us", "_now_us", "_recogniser")

    def __init__(self, recogniser: Recogniser, *, horizon_us: int) -> None:
        self._recogniser = recogniser
        self._horizon_us = horizon_us
        self._now_us = 0

    def update(self, sample: Sample[Sequence[Change]]) -> Iterable[Sample[Occurrence]]:
        """Observe one frame's changes, then let time pass up to the frame."""
        self._now_us = sample.valid_us
        occurrences: list[Occurrence] = []
        for change in sample.value:
            occurrences += self._recogniser.observe(_event(change))
        occurrences += self._recogniser.advance(sample.valid_us)
        return [Sample(sample.available_us, occurrence.end_us, occurrence) for occurrence in occurrences]

    def finish(self) -> Iterable[Sample[Occurrence]]:
        """Conclude what the end of the input allows: no later change can come any more.

        Time moves on by ``horizon_us``, the lateness of the changes, so that everything observed takes part. Absences
        whose window reaches beyond the end of the input stay open: nobody saw them come true.
        """
        occurrences = self._recogniser.advance(self._now_us + self._horizon_us)
        return [Sample(self._now_us, occurrence.end_us, occurrence) for occurrence in occurrences]


_VALUE = {True: "true", False: "false", None: "unknown"}


def _event(change: Change) -> Event:
    return Event(change.name, change.args, change.t_us, _VALUE[change.old], _VALUE[change.new])
