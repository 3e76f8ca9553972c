"""What in a specification is allowed but probably not meant? What nobody uses, and constraints that change nothing."""

from collections.abc import Iterable

from dyknow.kpl import model
from dyknow.kpl.model import ConstraintKind, Name, policies_of, terms_of
from dyknow.kpl.type_checks import types_in
from dyknow.kpl.vocabulary import Vocabulary, names_in
from dyknow.language.diagnostics import Reporter

_WITHOUT_EFFECT = (ConstraintKind.MOST_RECENT, ConstraintKind.LINEAR)


def doubt(specification: model.Specification, vocabulary: Vocabulary, reporter: Reporter) -> None:
    """Warn of labels that nobody reads, names that nobody uses, and constraints without effect."""
    # What a configuration creates may read every label, and speak of every object and feature.
    has_configurations = bool(vocabulary.configures)
    if not has_configurations:
        _doubt_unread(specification, vocabulary, reporter)
        statements = specification.statements
        objects = (name for one in statements if isinstance(one, model.ObjectDeclaration) for name in one.names)
        labels = [one.label for one in statements if isinstance(one, model.Process)]
        _doubt_unused("object", objects, {one.text for label in labels for one in label.arguments}, reporter)
        features = (one.name for one in vocabulary.features.values())
        _doubt_unused("feature", features, {label.name.text for label in labels}, reporter)
    _doubt_unused("sort", (one.name for one in vocabulary.sorts.values()), _sorts_used(specification), reporter)
    _doubt_host_code(specification, vocabulary, reporter)
    for constraints in policies_of(specification):
        _doubt_approximation(constraints, reporter)
    _doubt_oldest(specification, reporter)


def _doubt_unread(specification: model.Specification, vocabulary: Vocabulary, reporter: Reporter) -> None:
    read = {str(term.label) for term in terms_of(specification)}
    mediated = _mediated_types(specification, vocabulary)
    for label, process in vocabulary.processes.items():
        if label not in read and vocabulary.output_of(process) not in mediated:
            hint = f"stream NAME = {label}; hands it to the host"
            message = f"label {label!r} is read by no unit and no stream"
            reporter.warning("K0601", message, process.label.span, hint)


def _mediated_types(specification: model.Specification, vocabulary: Vocabulary) -> set[model.Type | None]:
    """Find which of the types that processes give some mediation may be told to pass on."""
    wanted = {one.type for one in specification.statements if isinstance(one, model.MediationDeclaration)}
    given = {vocabulary.output_of(process) for process in vocabulary.processes.values()} if wanted else set()
    return {one for one in given if one and any(vocabulary.are_same(type_, one) for type_ in wanted)}


def _doubt_host_code(specification: model.Specification, vocabulary: Vocabulary, reporter: Reporter) -> None:
    used = {
        one.function.text
        for one in specification.statements
        if isinstance(one, model.GeneratorDeclaration | model.ConfigureDeclaration)
    }
    for function in vocabulary.functions.values():
        kind = "source" if isinstance(function, model.SourceDeclaration) else "unit"
        _doubt_unused(kind, [function.name], used, reporter)
    _doubt_unused("configuration", (one.name for one in vocabulary.configurations.values()), used, reporter)


def _doubt_unused(kind: str, declared: Iterable[Name], used: set[str], reporter: Reporter) -> None:
    for name in declared:
        if name.text not in used:
            reporter.warning("K0602", f"{kind} {name.text!r} is declared, but not used", name.span)


def _doubt_approximation(constraints: tuple[model.Constraint, ...], reporter: Reporter) -> None:
    if any(one.kind is ConstraintKind.SAMPLE_EVERY for one in constraints):
        return
    for one in constraints:
        if one.kind in _WITHOUT_EFFECT:
            message = f"{one.kind.value!r} has no effect without 'sample every'"
            reporter.warning("K0603", message, one.span, "values are approximated at sampled times only")


def _doubt_oldest(specification: model.Specification, reporter: Reporter) -> None:
    for statement in specification.statements:
        if isinstance(statement, model.Process):
            for one in (one for term in statement.inputs for one in term.constraints):
                if one.kind is ConstraintKind.OLDEST:
                    message = "'oldest' has no effect on a process, which reads from the beginning"
                    reporter.warning("K0603", message, one.span, "it is for streams of the host, and for mediations")


def _sorts_used(specification: model.Specification) -> set[str]:
    used: set[str] = set()
    for statement in specification.statements:
        used.update(name.text for type_ in types_in(statement) for name in names_in(type_))
        if isinstance(statement, model.ObjectDeclaration):
            used.add(statement.sort.text)
        elif isinstance(statement, model.FeatureDeclaration):
            used.update(sort.text for sort in statement.sorts)
    return used
