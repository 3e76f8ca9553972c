"""How does a specification begin to run? Its processes are created in a node, out of what a registry offers.

The text says which processes there are, what they read and under which policies. What a unit is made with (a road
network, a model file, thresholds) is no matter of streams: the host registers a factory that knows it. A factory is
called once for every process, so two processes never share a unit.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from dyknow.errors import KplError
from dyknow.kpl import model
from dyknow.kpl.checks import Checked, check_kpl
from dyknow.kpl.model import terms_of
from dyknow.kpl.parser import parse_type
from dyknow.kpl.policies import policy_of
from dyknow.kpl.printer import print_statement
from dyknow.kpl.type_checks import types_in
from dyknow.language.diagnostics import Diagnostic, Reporter
from dyknow.language.words import normalised
from dyknow.node import Node
from dyknow.policies.policy import Policy
from dyknow.registry import Registry
from dyknow.streams.buffers import Stream, WhenFull
from dyknow.streams.stream import Consumer, StreamGenerator, Subscription


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
    made_of : the label of each process with the name of its source, unit or configuration, or the kind of mediation;
        inputs before what reads them, configurations last.
    types : the label of each process with the type of its values, in the words of KPL; configurations have none.
    sources : where the host publishes, by label.
    streams : what the host reads, by name.
    warnings : see `dyknow.kpl.checks.Checked`.
    """

    node: Node
    made_of: Mapping[str, str]
    types: Mapping[str, str]
    sources: Mapping[str, StreamGenerator]
    streams: Mapping[str, DeclaredStream]
    warnings: tuple[Diagnostic, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the labels of all processes of the text, inputs before what reads them, configurations last."""
        return tuple(self.made_of)

    def publishers(self, source: str) -> tuple[StreamGenerator, ...]:
        """Give the streams that were made of a source of the host, to publish to each; there may be none."""
        return tuple(stream for label, stream in self.sources.items() if self.made_of[label] == source)

    def remove(self) -> None:
        """Remove every process of the text from the node, readers before what they read.

        Configurations go first, and with each what it has created.
        """
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
    reporter = Reporter({name: normalised(text)})
    _check_host_code(checked, registry, reporter)
    _check_labels(checked, node, reporter)
    reporter.raise_if_any(KplError)
    return _deploy(checked, registry, node)


_HostCode = model.SourceDeclaration | model.UnitDeclaration | model.ConfigurationDeclaration


def _check_host_code(checked: Checked, registry: Registry, reporter: Reporter) -> None:
    declared: dict[str, _HostCode] = {**checked.vocabulary.functions, **checked.vocabulary.configurations}
    for name, statement in declared.items():
        kind, offered = _offered(statement, registry)
        if name in offered:
            _check_signature(statement, _as_registered(name, registry), checked, reporter)
        else:
            message = f"expected a {kind} that the host offers, got {name!r}"
            reporter.error("K0701", message, statement.name.span, checked.vocabulary.nearest(name, offered))


def _offered(statement: _HostCode, registry: Registry) -> tuple[str, Mapping[str, object]]:
    match statement:
        case model.SourceDeclaration():
            return "source", registry.sources
        case model.UnitDeclaration():
            return "unit", registry.units
        case _:
            return "configuration", registry.configurations


def _as_registered(name: str, registry: Registry) -> _HostCode:
    """Write the signature of host code as the statement that would declare it."""
    if name in registry.sources:
        return model.SourceDeclaration(_type(registry.sources[name].output, name), model.Name(name))
    if name in registry.configurations:
        return model.ConfigurationDeclaration(model.Name(name), _type(registry.configurations[name].input, name))
    unit = registry.units[name]
    inputs = tuple(_type(text, name) for text in unit.inputs)
    return model.UnitDeclaration(_type(unit.output, name), model.Name(name), inputs)


def _type(text: str, name: str) -> model.Type:
    return parse_type(text, name=f"type of {name} in the registry")


def _check_signature(declared: _HostCode, registered: _HostCode, checked: Checked, reporter: Reporter) -> None:
    theirs, ours = types_in(registered), types_in(declared)
    if len(theirs) != len(ours) or not all(map(checked.vocabulary.are_same, theirs, ours)):
        message = f"expected {print_statement(registered)!r} as the host has it, got {print_statement(declared)!r}"
        reporter.error("K0702", message, declared.name.span)


def _check_labels(checked: Checked, node: Node, reporter: Reporter) -> None:
    for process in checked.processes:
        if str(process.label) in node:
            message = f"expected a label that is new in the node, got {str(process.label)!r}"
            reporter.error("K0703", message, process.label.span)


def _deploy(checked: Checked, registry: Registry, node: Node) -> Deployment:
    created: list[str] = []
    stored_us = _stored_us(checked)
    try:
        for process in checked.processes:
            label = str(process.label)
            _create(process, registry, node)
            created.append(label)
            if label in stored_us:
                node.stream(label).remember(stored_us[label])
    except BaseException:
        for label in reversed(created):
            node.remove(label)
        raise
    streams = {name: _declared_stream(one, node) for name, one in checked.vocabulary.streams.items()}
    made_by_host = (one for one in checked.processes if isinstance(one, model.GeneratorDeclaration) and not one.inputs)
    return Deployment(
        node,
        made_of=MappingProxyType({str(one.label): made_of(one) for one in checked.processes}),
        types=MappingProxyType(dict(_output_types(checked))),
        sources=MappingProxyType({str(one.label): node.stream(str(one.label)) for one in made_by_host}),
        streams=MappingProxyType(streams),
        warnings=checked.warnings,
    )


def made_of(process: model.Process) -> str:
    """Name the source, unit or configuration of a process, or the kind of a mediation.

    Examples
    --------
    >>> [made_of(one) for one in check_kpl("source int gps; strmgen pos = gps; stream seen = pos;").processes]
    ['gps']
    """
    return process.kind.value if isinstance(process, model.MediationDeclaration) else process.function.text


def _create(process: model.Process, registry: Registry, node: Node) -> None:
    label = str(process.label)
    labels = tuple(str(term.label) for term in process.inputs)
    policies = tuple(policy_of(term.constraints) for term in process.inputs)
    match process:
        case model.MediationDeclaration(kind=kind, constraints=constraints):
            node.add_mediation(label, kind, control=labels[0], policy=policy_of(constraints))
        case model.ConfigureDeclaration(function=name):
            code = registry.configurations[name.text].factory()
            node.add_configuration(label, of=labels[0], wanted=code.wanted, build=code.build, policy=policies[0])
        case model.GeneratorDeclaration(inputs=()):
            node.add_source(label)
        case model.GeneratorDeclaration(function=name):
            node.add_refinement(label, registry.create(name.text), of=labels, policy=policies)


def _declared_stream(declared: model.StreamDeclaration, node: Node) -> DeclaredStream:
    label = str(declared.term.label)
    return DeclaredStream(declared.name.text, label, policy_of(declared.term.constraints), node.stream(label))


def _output_types(checked: Checked) -> Iterator[tuple[str, str]]:
    for label, process in checked.vocabulary.processes.items():
        output = checked.vocabulary.output_of(process)
        assert output is not None, "a checked process runs declared code"
        yield label, str(output)


def _stored_us(checked: Checked) -> dict[str, int]:
    """Find how long each label's samples must be stored for those that ask for the oldest.

    A mediation may be told to pass on any label of its type. At least a microsecond is stored: `oldest 0s` asks for
    what is valid just now.
    """
    stored_us: dict[str, int] = {}
    for label, constraints in _readings(checked):
        oldest_us = policy_of(constraints).oldest_us
        if oldest_us is not None:
            stored_us[label] = max(stored_us.get(label, 0), oldest_us or 1)
    return stored_us


def _readings(checked: Checked) -> Iterator[tuple[str, tuple[model.Constraint, ...]]]:
    for term in terms_of(checked.specification):
        yield str(term.label), term.constraints
    vocabulary = checked.vocabulary
    for mediation in vocabulary.processes.values():
        if isinstance(mediation, model.MediationDeclaration) and policy_of(mediation.constraints).oldest_us is not None:
            for label, process in vocabulary.processes.items():
                output = vocabulary.output_of(process)
                if output is not None and vocabulary.are_same(mediation.type, output):
                    yield label, mediation.constraints
