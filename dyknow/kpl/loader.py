"""How does a specification begin to run? Its processes are created in a node, out of what a registry offers.

The text says which processes there are, what they read and under which policies. What a unit is made with (a road
network, a model file, thresholds) is no matter of streams: the host registers a factory that knows it. A factory is
called once for every process, so two processes never share a unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from dyknow.diagnostics import Diagnostic, Reporter, suggest
from dyknow.kpl import model
from dyknow.kpl.checks import Checked, check_kpl, terms_of
from dyknow.kpl.findings import KplError
from dyknow.kpl.model import ConstraintKind
from dyknow.kpl.parser import parse_type
from dyknow.kpl.policies import policy_of
from dyknow.kpl.printer import print_statement
from dyknow.kpl.vocabulary import Function
from dyknow.node import Node
from dyknow.policy import Policy
from dyknow.pull_stream import Stream, WhenFull
from dyknow.registry import Registry
from dyknow.stream import Consumer, StreamGenerator, Subscription


@dataclass(frozen=True, slots=True)
class DeclaredStream:
    """Read the stream of a process under the policy that the text declares; made by ``stream NAME = ...``.

    Attributes
    ----------
    label : of the process whose stream it is.
    """

    name: str
    label: str
    policy: Policy
    _generator: StreamGenerator

    def subscribe(self, consumer: Consumer) -> Subscription:
        """Call ``consumer`` with every sample; see `StreamGenerator.subscribe`."""
        return self._generator.subscribe(consumer, self.policy)

    def open(self, capacity: int = 1_024, when_full: WhenFull = WhenFull.DROP_OLDEST) -> Stream:
        """Open a buffer to take samples from; see `StreamGenerator.open`."""
        return self._generator.open(self.policy, capacity, when_full)


@dataclass(frozen=True, slots=True)
class Deployment:
    """Hold what a text has created in a node.

    Attributes
    ----------
    node : the node.
    made_of : the label of each process with the name of its source or unit, inputs before what reads them.
    sources : where the host publishes, by label.
    streams : what the host reads, by name.
    warnings : see `dyknow.kpl.checks.Checked`.
    """

    node: Node
    made_of: Mapping[str, str]
    sources: Mapping[str, StreamGenerator]
    streams: Mapping[str, DeclaredStream]
    warnings: tuple[Diagnostic, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the labels of all processes, inputs before what reads them."""
        return tuple(self.made_of)

    def publishers(self, source: str) -> tuple[StreamGenerator, ...]:
        """Give the streams that were made of a source of the host, to publish to each; there may be none."""
        return tuple(stream for label, stream in self.sources.items() if self.made_of[label] == source)

    def remove(self) -> None:
        """Remove every process of the text from the node, readers before what they read."""
        for label in reversed(self.labels):
            self.node.remove(label)


def load_kpl(text: str, registry: Registry, node: Node, *, name: str = "kpl") -> Deployment:
    """Create what a KPL text declares.

    Parameters
    ----------
    text : the whole text.
    registry : the host code by name; the text must declare it with the types under which it was registered.
    node : takes the processes; whatever runs there already is left alone.
    name : file name of the text, for messages.

    Returns
    -------
    Where to publish and what to read. If anything is refused, the node is as it was before.

    Raises
    ------
    KplError
        If the text is malformed or means nothing, if the registry lacks what it declares, or if a label is in use.

    Examples
    --------
    >>> from dyknow.sample import Sample
    >>> registry = Registry()
    >>> registry.source("thermometer", output="float")
    >>> @registry.unit("is_frost", inputs=("float",), output="bool")
    ... class IsFrost:
    ...     def update(self, sample):
    ...         return [Sample(sample.available_us, sample.valid_us, sample.value < 0)]
    ...     def finish(self):
    ...         return []
    >>> deployment = load_kpl('''
    ...     source float thermometer;
    ...     compunit bool is_frost(float);
    ...     strmgen temperature = thermometer;
    ...     strmgen frost = is_frost(temperature);
    ...     stream changes = frost with any change;
    ... ''', registry, Node())
    >>> changes = deployment.streams["changes"].open()
    >>> for t_us, value in enumerate([1.5, 0.5, -0.5, -1.0, 0.5]):
    ...     deployment.sources["temperature"].publish(Sample(t_us, t_us, value))
    >>> [(sample.valid_us, sample.value) for sample in changes.take()]
    [(0, False), (2, True), (4, False)]
    """
    checked = check_kpl(text, name=name)
    reporter = Reporter(text, name, KplError)
    _check_host_code(checked, registry, reporter)
    _check_labels(checked, node, reporter)
    reporter.raise_if_any()
    return _deploy(checked, registry, node)


def _check_host_code(checked: Checked, registry: Registry, reporter: Reporter) -> None:
    for name, declared in checked.vocabulary.functions.items():
        is_source = isinstance(declared, model.SourceDeclaration)
        offered = registry.sources if is_source else registry.units
        if name in offered:
            _check_signature(declared, _as_registered(name, registry), checked, reporter)
        else:
            kind = "source" if is_source else "unit"
            message = f"expected a {kind} that the host offers, got {name!r}"
            reporter.error("K0701", message, declared.name.span, suggest(name, offered))


def _as_registered(name: str, registry: Registry) -> Function:
    """Write the signature of a source or unit as the statement that would declare it."""
    if name in registry.sources:
        return model.SourceDeclaration(_type(registry.sources[name].output, name), model.Name(name))
    unit = registry.units[name]
    inputs = tuple(_type(text, name) for text in unit.inputs)
    return model.UnitDeclaration(_type(unit.output, name), model.Name(name), inputs)


def _type(text: str, name: str) -> model.Type:
    return parse_type(text, name=f"type of {name} in the registry")


def _check_signature(
    declared: Function,
    registered: Function,
    checked: Checked,
    reporter: Reporter,
) -> None:
    theirs, ours = _types_of(registered), _types_of(declared)
    if len(theirs) != len(ours) or not all(map(checked.vocabulary.are_same, theirs, ours)):
        message = f"expected {print_statement(registered)!r} as the host has it, got {print_statement(declared)!r}"
        reporter.error("K0702", message, declared.name.span)


def _types_of(function: Function) -> tuple[model.Type, ...]:
    inputs = function.inputs if isinstance(function, model.UnitDeclaration) else ()
    return (function.type, *inputs)


def _check_labels(checked: Checked, node: Node, reporter: Reporter) -> None:
    for process in checked.processes:
        if str(process.label) in node:
            message = f"expected a label that is new in the node, got {str(process.label)!r}"
            reporter.error("K0703", message, process.label.span)


def _deploy(checked: Checked, registry: Registry, node: Node) -> Deployment:
    generators: dict[str, StreamGenerator] = {}
    oldest_us = _oldest_us(checked)
    try:
        for process in checked.processes:
            label = str(process.label)
            generators[label] = _create(process, registry, node)
            if label in oldest_us:
                generators[label].remember(oldest_us[label])
    except BaseException:
        for label in reversed(generators):
            node.remove(label)
        raise
    streams = {
        name: _declared_stream(declared, generators[str(declared.term.label)])
        for name, declared in checked.vocabulary.streams.items()
    }
    sources = {str(one.label): generators[str(one.label)] for one in checked.processes if not one.inputs}
    return Deployment(
        node,
        made_of=MappingProxyType({str(one.label): one.function.text for one in checked.processes}),
        sources=MappingProxyType(sources),
        streams=MappingProxyType(streams),
        warnings=checked.warnings,
    )


def _create(process: model.GeneratorDeclaration, registry: Registry, node: Node) -> StreamGenerator:
    label = str(process.label)
    if not process.inputs:
        return node.add_source(label)
    unit = registry.create(process.function.text)
    labels = tuple(str(term.label) for term in process.inputs)
    policies = tuple(policy_of(term.constraints) for term in process.inputs)
    return node.add_refinement(label, unit, of=labels, policy=policies).output


def _declared_stream(declared: model.StreamDeclaration, generator: StreamGenerator) -> DeclaredStream:
    return DeclaredStream(declared.name.text, generator.label, policy_of(declared.term.constraints), generator)


def _oldest_us(checked: Checked) -> dict[str, int]:
    """Find how long each label's samples must be stored for those that ask for the oldest."""
    stored_us: dict[str, int] = {}
    for term in terms_of(checked.specification):
        for constraint in term.constraints:
            if constraint.kind is ConstraintKind.OLDEST and constraint.us:
                label = str(term.label)
                stored_us[label] = max(stored_us.get(label, 0), constraint.us)
    return stored_us
