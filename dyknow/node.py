"""What runs here? A node: the labelled streams and processes of one place, created by name and open to inspection."""

from dataclasses import dataclass

from dyknow.errors import StreamError
from dyknow.policy import Consumer, Policy
from dyknow.process import Clock, ComputationalUnit, Refinement
from dyknow.stream import StreamGenerator, Subscription


@dataclass(frozen=True, slots=True)
class StreamReport:
    """Say what one stream has done so far.

    Attributes
    ----------
    published, dropped : samples offered, and samples refused by some subscriber's policy, by cause.
    updates, busy_ns : calls of the producing unit and the time spent in it; zero for a source.
    """

    label: str
    inputs: tuple[str, ...]
    published: int
    dropped: dict[str, int]
    subscribers: int
    last_valid_us: int | None
    updates: int
    busy_ns: int


class Node:
    """Create streams and processes by label, and report on them.

    Parameters
    ----------
    clock : nanoseconds, for the cost of each process only; the default stands still, so costs read zero. No result
        ever depends on it.

    Examples
    --------
    >>> from dyknow.sample import Sample
    >>> class Doubling:
    ...     def update(self, sample):
    ...         return [Sample(sample.available_us, sample.valid_us, 2 * sample.value)]
    ...     def finish(self):
    ...         return []
    >>> node = Node()
    >>> numbers = node.add_source("numbers")
    >>> _ = node.add_refinement("doubled", Doubling(), of="numbers")
    >>> seen = []
    >>> _ = node.subscribe("doubled", lambda sample: seen.append(sample.value))
    >>> numbers.publish(Sample(0, 0, 21))
    >>> seen
    [42]
    """

    def __init__(self, clock: Clock = lambda: 0) -> None:
        self._clock = clock
        self._generators: dict[str, StreamGenerator] = {}
        self._refinements: dict[str, Refinement] = {}
        self._inputs: dict[str, tuple[str, ...]] = {}

    def add_source(self, label: str) -> StreamGenerator:
        """Create a stream that the host publishes to.

        Raises
        ------
        StreamError
            If the label is taken.
        """
        if label in self._generators:
            raise StreamError(f"stream {label!r}: expected a new label, got one that is in use")
        generator = StreamGenerator(label)
        self._generators[label] = generator
        self._inputs[label] = ()
        return generator

    def add_refinement(
        self,
        label: str,
        unit: ComputationalUnit,
        *,
        of: str,
        policy: Policy = Policy(),  # noqa: B008 - frozen value
    ) -> Refinement:
        """Create a process that refines the stream ``of`` under ``policy`` into the stream ``label``.

        Raises
        ------
        StreamError
            If ``of`` is unknown or ``label`` is taken.
        """
        source = self._generator(of)
        refinement = Refinement(self.add_source(label), unit, self._clock)
        source.subscribe(refinement.consume, policy)
        self._refinements[label] = refinement
        self._inputs[label] = (of,)
        return refinement

    def subscribe(
        self,
        label: str,
        consumer: Consumer,
        policy: Policy = Policy(),  # noqa: B008 - frozen value
    ) -> Subscription:
        """Call ``consumer`` with the samples of a stream; see `StreamGenerator.subscribe`."""
        return self._generator(label).subscribe(consumer, policy)

    def finish(self) -> None:
        """Flush every process, in the order in which they were created: inputs before what refines them."""
        for refinement in self._refinements.values():
            refinement.finish()

    def report(self) -> tuple[StreamReport, ...]:
        """Describe every stream, in the order of creation."""
        return tuple(self._report_one(label, generator) for label, generator in self._generators.items())

    def _report_one(self, label: str, generator: StreamGenerator) -> StreamReport:
        refinement = self._refinements.get(label)
        dropped: dict[str, int] = {}
        for subscription in generator.subscriptions:
            for cause, count in subscription.filter.dropped.items():
                dropped[cause] = dropped.get(cause, 0) + count
        return StreamReport(
            label=label,
            inputs=self._inputs[label],
            published=generator.published,
            dropped=dropped,
            subscribers=len(generator.subscriptions),
            last_valid_us=generator.last_valid_us,
            updates=refinement.updates if refinement else 0,
            busy_ns=refinement.busy_ns if refinement else 0,
        )

    def _generator(self, label: str) -> StreamGenerator:
        if label not in self._generators:
            known = ", ".join(sorted(self._generators)) or "none"
            raise StreamError(f"stream {label!r}: expected one of the declared streams ({known})")
        return self._generators[label]
