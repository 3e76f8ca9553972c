"""What runs here? A node: the labelled streams and processes of one place, created by name and open to inspection.

Processes may come and go while samples flow, also by the hand of a process that is being served. The graph has no
cycles: a process reads what was there before it, and a mediation is refused what depends on itself.
"""

from collections.abc import Callable, Generator, Hashable, Iterator, Mapping
from contextlib import ExitStack
from itertools import repeat
from typing import Any

from dyknow.errors import ProcessError, StreamError
from dyknow.language.ways import inside_first, reached
from dyknow.policies.policy import Policy
from dyknow.registry import Registry
from dyknow.streams.configuration import Configuration, Wanted
from dyknow.streams.mediation import Mediation, MediationKind
from dyknow.streams.process import Clock, ComputationalUnit, JoiningUnit, Process, Refinement
from dyknow.streams.stream import EVERYTHING, Consumer, StreamGenerator, Subscription, exhaust
from dyknow.streams.stream_report import StreamReport, report_on

Labels = str | tuple[str, ...]
Policies = Policy | tuple[Policy, ...]


class Node:
    """Create and remove streams and processes by label, and report on them.

    Parameters
    ----------
    clock : nanoseconds, for the cost of each process only; the default stands still, so costs read zero. No result
        ever depends on it.
    registry : where units are looked up that are given by name.

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

    def __init__(self, clock: Clock = lambda: 0, registry: Registry | None = None) -> None:
        self.registry = registry if registry is not None else Registry()
        self._clock = clock
        self._processes: dict[str, Process] = {}
        self._mediations: dict[str, Mediation] = {}
        self._order: tuple[Process, ...] | None = None
        self._being_built: list[list[str]] = []  # labels created by the configurations that are at work, innermost last

    def __contains__(self, label: object) -> bool:
        """Tell whether a process or stream has this label."""
        return label in self._processes

    @property
    def labels(self) -> tuple[str, ...]:
        """Return all labels, in the order of creation."""
        return tuple(self._processes)

    def add_source(self, label: str) -> StreamGenerator:
        """Create a stream that the host publishes to.

        Raises
        ------
        StreamError
            If the label is taken.
        """
        source = Process(self._new_stream(label))
        self._begin(source, lambda: None)
        return source.output

    def add_refinement(
        self, label: str, unit: ComputationalUnit | JoiningUnit | str, *, of: Labels, policy: Policies = EVERYTHING
    ) -> Refinement:
        """Create a process that refines the streams ``of``, each under its policy, into the stream ``label``.

        Parameters
        ----------
        unit : with ``update(sample)`` for one stream, ``update(index, sample)`` for several; or the name of a
            registered unit, of which a new one is made.
        policy : one for all inputs, or one for each.

        Raises
        ------
        StreamError
            If a label in ``of`` is unknown or ``label`` is taken.
        ProcessError
            If there are not as many policies, or not as many inputs as the registered unit takes.
        RegistryError
            If no unit has the name.
        """
        labels = (of,) if isinstance(of, str) else of
        policies = tuple(repeat(policy, len(labels))) if isinstance(policy, Policy) else policy
        if not labels or len(labels) != len(policies):
            raise ProcessError(
                f"refinement {label!r}: expected one input or more with a policy each, got {labels!r} and {policies!r}"
            )
        streams = [self.stream(one) for one in labels]
        output = self._new_stream(label)
        made = self._unit(label, unit, len(labels)) if isinstance(unit, str) else unit
        refinement = Refinement(output, made, self._clock)
        self._begin(refinement, lambda: refinement.follow(list(zip(streams, policies, strict=True))))
        return refinement

    def add_mediation(
        self, label: str, kind: str | MediationKind, *, control: str, policy: Policy = EVERYTHING
    ) -> Mediation:
        """Create a process that passes on the streams whose labels the stream ``control`` names, under ``policy``.

        Parameters
        ----------
        kind : ``selection`` passes on at most one stream as it is; ``collection`` merges any number of streams into
            one of `Collected` values.

        Raises
        ------
        StreamError
            If ``control`` is unknown or ``label`` is taken.
        ProcessError
            If ``kind`` is another word.
        """
        known = {one.value: one for one in MediationKind}
        chosen = kind if isinstance(kind, MediationKind) else known.get(kind)
        if chosen is None:
            raise ProcessError(f"mediation {label!r}: expected one of {', '.join(known)}, got {kind!r}")
        stream = self.stream(control)
        output = self._new_stream(label)
        mediation = Mediation(
            output, chosen, control=control, policy=policy, find=lambda wanted: self._independent(wanted, label)
        )
        self._mediations[label] = mediation
        self._begin(mediation, lambda: mediation.follow(stream))
        return mediation

    def add_configuration(
        self,
        label: str,
        *,
        of: str,
        wanted: Wanted,
        build: Callable[["Node", Any], object],  # Any: the keys are whatever `wanted` gives
        policy: Policy = EVERYTHING,
    ) -> Configuration:
        """Create a process that creates and removes processes in response to the stream ``of``.

        Parameters
        ----------
        wanted : gives the keys for which processes should exist now, from a value of the stream.
        build : adds the processes for one key to the node. They are removed when the key is not wanted any more, and
            with the configuration.

        Raises
        ------
        StreamError
            If ``of`` is unknown or ``label`` is taken.
        """
        stream = self.stream(of)
        output = self._new_stream(label)
        configuration = Configuration(
            output, wanted=wanted, build=lambda key: self._build(build, key), tear_down=self._remove_if_there
        )
        self._begin(configuration, lambda: configuration.follow(stream, policy))
        return configuration

    def remove(self, label: str) -> None:
        """Remove a process with its stream, after what it holds back; also while samples flow.

        Subscribers from outside the node get nothing more; mediations go on without it.

        Raises
        ------
        StreamError
            If the label is unknown.
        ProcessError
            If another process reads the stream.
        """
        process = self._process(label)
        readers = {one.reader for one in process.output.subscriptions if one.reader is not None}
        mediations = [self._mediations[one] for one in sorted(readers & self._mediations.keys())]
        passing_on = {one.label for one in mediations if one.control != label}
        if readers - passing_on:
            raise ProcessError(
                f"process {label!r}: expected no reader in the node, got {sorted(readers - passing_on)!r}"
            )
        # Gone from here on: whoever answers its last words by removing it, or by creating another, finds no such label.
        del self._processes[label]
        self._mediations.pop(label, None)
        self._order = None
        with ExitStack() as steps:  # each is taken, last one first, also when the code of the process fails
            for mediation in mediations:
                steps.callback(self._connect_again, mediation, label)
            steps.callback(process.output.close)
            for mediation in reversed(mediations):
                steps.callback(mediation.disconnect, label)
            steps.callback(process.close)

    def stream(self, label: str) -> StreamGenerator:
        """Give the stream of a label.

        Raises
        ------
        StreamError
            If the label is unknown.
        """
        return self._process(label).output

    def subscribe(self, label: str, consumer: Consumer, policy: Policy = EVERYTHING) -> Subscription:
        """Call ``consumer`` with the samples of a stream; see `StreamGenerator.subscribe`."""
        return self.stream(label).subscribe(consumer, policy)

    def advance(self, available_us: int) -> None:
        """Let time pass everywhere: nothing that became available before this time will be published to a source.

        Inputs come before what reads them. Sampled values, synchronised states and timed units need this where the
        sources fall silent; as long as samples come, these tell the time themselves.
        """
        for process in self._inputs_first():
            if self._processes.get(process.label) is process:  # else a process before it has removed it
                process.advance(available_us)

    def finish(self) -> None:
        """Tell every process that its input has ended, inputs before what reads them; also those created by that.

        Nothing can be published to a stream that has ended. Doing so again reaches only what was created since.
        """
        exhaust(self.finish_in_steps())

    def finish_in_steps(self) -> Generator[None, None, None]:
        """Do what `finish` does, and give the control back as `StreamGenerator.publish_in_steps` does.

        Whoever leaves off drops what the process at work had still to say; `finish` then tells the others.
        """
        while any(not process.is_finished for process in self._processes.values()):
            order = self._inputs_first()
            for process in order:
                if self._processes.get(process.label) is process:
                    yield from process.finish_in_steps()
                if self._order is not order:  # what has come may belong before what is next
                    break

    @property
    def owes_from_us(self) -> int | None:
        """Return the valid time of the first sample to which some unit owes an answer (see `NOT_YET`), or None."""
        return min((us for one in self._processes.values() if (us := one.owes_from_us) is not None), default=None)

    def forgive(self) -> None:
        """Let go what units owe, for a host that ends early: they are not asked for it at the end."""
        for process in self._processes.values():
            process.forgive()

    def report(self) -> tuple[StreamReport, ...]:
        """Describe every process and its stream, in the order of creation."""
        return tuple(map(report_on, self._processes.values()))

    def _new_stream(self, label: str) -> StreamGenerator:
        if label in self._processes:
            raise StreamError(f"stream {label!r}: expected a new label, got one that is in use")
        return StreamGenerator(label)

    def _begin(self, process: Process, start: Callable[[], None]) -> None:
        self._processes[process.label] = process
        self._order = None
        try:
            start()
            for mediation in tuple(self._mediations.values()):
                mediation.connect(process.label)
        except BaseException:
            self._remove_if_there(process.label)
            raise
        if self._being_built:
            self._being_built[-1].append(process.label)

    def _unit(self, label: str, name: str, count: int) -> Any:  # Any: see `UnitFactory`
        expected = len(self.registry.unit_named(name).inputs)
        if count != expected:
            raise ProcessError(f"refinement {label!r}: unit {name!r} expected {expected} inputs, got {count!r}")
        return self.registry.create(name)

    def _build(self, build: Callable[["Node", Any], object], key: Hashable) -> tuple[str, ...]:
        """Let a host function add processes, and remember which."""
        created: list[str] = []
        self._being_built.append(created)
        try:
            build(self, key)
        except BaseException:
            for label in reversed(created):
                self._remove_if_there(label)
            raise
        finally:
            self._being_built.pop()
        return tuple(created)

    def _connect_again(self, mediation: Mediation, label: str) -> None:
        """Connect what was created under a label while its predecessor was removed."""
        if label in self._processes and self._mediations.get(mediation.label) is mediation:
            mediation.connect(label)

    def _remove_if_there(self, label: str) -> None:
        if label in self._processes:
            self.remove(label)

    def _independent(self, label: str, reader: str) -> StreamGenerator | None:
        """Give a stream for ``reader`` to read, None if it is not there; refuse it if it depends on the reader."""
        if label not in self._processes:
            return None
        if depends_on(self._processes, label, reader):
            raise ProcessError(f"mediation {reader!r}: expected streams that do not depend on it, got {label!r}")
        self._order = None
        return self._processes[label].output

    def _inputs_first(self) -> tuple[Process, ...]:
        if self._order is None:
            self._order = inputs_first(self._processes)
        return self._order

    def _process(self, label: str) -> Process:
        if label not in self._processes:
            known = ", ".join(sorted(self._processes)) or "none"
            raise StreamError(f"stream {label!r}: expected one of the declared streams ({known})")
        return self._processes[label]


def inputs_first(processes: Mapping[str, Process]) -> tuple[Process, ...]:
    """Sort processes so that each comes after what it reads, and otherwise as they are.

    The order of creation is not enough: a mediation may read what was created after it.
    """
    reads = {label: [one.label for one in _read_by(process, processes)] for label, process in processes.items()}
    ordered, _ = inside_first(reads)
    return tuple(processes[label] for label in ordered)


def depends_on(processes: Mapping[str, Process], label: str, other: str) -> bool:
    """Tell whether a process is another one, reads it, or reads what depends on it."""
    return other in reached([label], lambda one: [read.label for read in _read_by(processes[one], processes)])


def _read_by(process: Process, processes: Mapping[str, Process]) -> Iterator[Process]:
    """Give the processes whose streams a process reads, but for those that are just being removed."""
    return (processes[one.stream.label] for one in process.inputs if one.stream.label in processes)
