"""How do streams that come and go become one stream? A mediation process passes on those that a control stream names.

*Selection* passes on one stream at a time, as it is. *Collection* merges many, and says where each value came from.
"""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any

from dyknow.errors import ProcessError
from dyknow.policies.policy import Policy
from dyknow.sample import Sample
from dyknow.streams.process import Input, Process
from dyknow.streams.stream import EVERYTHING, Relay, StreamGenerator


class MediationKind(Enum):
    """Name the two ways to pass streams on."""

    SELECTION = "selection"
    COLLECTION = "collection"


@dataclass(frozen=True, slots=True)
class Collected:
    """Say which stream a value of a collection came from."""

    label: str
    value: Any  # Any: a stream may carry any value


class Mediation(Process):
    """Pass on the samples of the streams that a control stream names.

    A label that no stream has, or has yet, is waited for: the processes it names may be created and removed by others
    in the same breath. `waiting_for` shows these labels, so that a misspelling is seen.

    Parameters
    ----------
    control : label of a stream of sets of labels; a selection takes sets of at most one.
    policy : under which each named stream is read.
    find : gives the stream of a label, or None; refuses one that depends on this process.
    """

    def __init__(
        self,
        output: StreamGenerator,
        kind: MediationKind,
        *,
        control: str,
        policy: Policy,
        find: Callable[[str], StreamGenerator | None],
    ) -> None:
        super().__init__(output, kind=kind.value)
        self.control = control
        self._mediation_kind = kind
        self._policy = policy
        self._find = find
        self._wanted: Set[str] = frozenset()
        self._connected: dict[str, Input] = {}

    def follow(self, control: StreamGenerator) -> None:
        """Begin to read the control stream."""
        self.read(control, Relay(self._select, self.output), EVERYTHING)

    @property
    def waiting_for(self) -> tuple[str, ...]:
        """Return the labels named by the control stream that no stream has, in alphabetical order."""
        return tuple(sorted(self._wanted - self._connected.keys()))

    def connect(self, label: str) -> None:
        """Begin to pass a stream on, if it is wanted and there."""
        stream = self._find(label) if label in self._wanted and label not in self._connected else None
        if stream is not None:
            is_collection = self._mediation_kind is MediationKind.COLLECTION
            answer = partial(self._collect, label) if is_collection else self._pass_on
            self.read(stream, Relay(answer, self.output), self._policy)
            self._connected[label] = self.inputs[-1]

    def disconnect(self, label: str) -> None:
        """Stop passing a stream on."""
        if label in self._connected:
            self.stop_reading(self._connected.pop(label))

    def _select(self, sample: Sample[Any]) -> tuple[()]:
        self.updates += 1
        wanted = self._labels(sample.value)
        for label in wanted - self._connected.keys():
            self._find(label)  # refuses what must not be read, before anything has changed
        self._wanted = wanted
        for label in sorted(self._connected.keys() - wanted):
            self.disconnect(label)
        for label in sorted(wanted):
            self.connect(label)
        return ()

    def _labels(self, value: object) -> Set[str]:
        if not isinstance(value, Set) or not all(isinstance(label, str) for label in value):
            raise ProcessError(f"{self.kind} {self.label!r}: expected a set of labels on its control, got {value!r}")
        if self._mediation_kind is MediationKind.SELECTION and len(value) > 1:
            raise ProcessError(f"{self.kind} {self.label!r}: expected at most one label, got {sorted(value)!r}")
        if self.control in value:
            raise ProcessError(
                f"{self.kind} {self.label!r}: expected other streams than its control, got {self.control!r}"
            )
        return frozenset(value)

    def _pass_on(self, sample: Sample[Any]) -> Sequence[Sample[Any]]:
        return (sample,)

    def _collect(self, label: str, sample: Sample[Any]) -> Sequence[Sample[Any]]:
        return (Sample(sample.available_us, sample.valid_us, Collected(label, sample.value)),)
