"""Do names, numbers of arguments and types of values fit together?"""

from collections.abc import Sequence

from dyknow.kpl import model
from dyknow.kpl.model import ConstraintKind, Name
from dyknow.kpl.vocabulary import BASIC_TYPES, Vocabulary, names_in
from dyknow.language.diagnostics import Hint


def check_declarations(specification: model.Specification, vocabulary: Vocabulary) -> None:
    """Report unknown names of types and sorts in all declarations, and sorts that are made of themselves."""
    for statement in specification.statements:
        for written in types_in(statement):
            _check_type(written, vocabulary)
        match statement:
            case model.SortDeclaration(name, type_) if type_ and vocabulary.is_made_of_itself(name):
                message = f"expected a sort that is not made of itself, got {name.text!r}"
                vocabulary.reporter.error("K0306", message, name.span)
            case model.ObjectDeclaration(sort):
                vocabulary.knows(vocabulary.sorts, "sort", sort)
            case model.FeatureDeclaration(_, _, sorts):
                for sort in sorts:
                    vocabulary.knows(vocabulary.sorts, "sort", sort)


def types_in(statement: model.Statement) -> tuple[model.Type, ...]:
    """Give the types that a statement is written with."""
    match statement:
        case model.SortDeclaration(_, type_):
            return (type_,) if type_ else ()
        case model.FeatureDeclaration(type_) | model.SourceDeclaration(type_):
            return (type_,)
        case model.UnitDeclaration(type_, _, inputs):
            return (type_, *inputs)
        case model.ConfigurationDeclaration(_, type_) | model.MediationDeclaration(_, _, type_):
            return (type_,)
        case _:
            return ()


def check_process(process: model.Process, vocabulary: Vocabulary) -> None:
    """Report host code that is applied wrongly, and a label that cannot carry what comes out."""
    for term in process.inputs:
        check_term(term, vocabulary)
    if isinstance(process, model.ConfigureDeclaration):
        _check_configure(process, vocabulary)
        return
    output = vocabulary.output_of(process)
    feature = _check_label(process.label, vocabulary)
    if isinstance(process, model.MediationDeclaration):
        _check_control(process, vocabulary)
        _check_interpolation(process.constraints, f"streams of type {process.type}", process.type, vocabulary)
    else:
        _check_function(process, vocabulary)
    if feature and output and not vocabulary.are_same(feature.type, output):
        message = f"expected values of type {feature.type} for the feature {feature.name}, got {output}"
        span = process.label.span if isinstance(process, model.MediationDeclaration) else process.function.span
        vocabulary.reporter.error("K0303", message, span)


def check_term(term: model.Term, vocabulary: Vocabulary) -> None:
    """Report a label that does not exist, and an interpolation of what is no number."""
    label = str(term.label)
    hint = ""
    if label in vocabulary.configures:
        hint = "a configuration gives no values; read what it creates"
    elif label in vocabulary.streams:
        hint = "a stream is read by the host only; read the label behind it"
    elif label in vocabulary.functions:
        hint = "that is host code; 'strmgen' gives its stream a label"
    if vocabulary.knows(vocabulary.processes, "label", term.label, hint=hint):
        type_ = vocabulary.output_of(vocabulary.processes[label])
        if type_:
            _check_interpolation(term.constraints, f"{label!r} of type {type_}", type_, vocabulary)


def _check_interpolation(
    constraints: Sequence[model.Constraint], came: str, type_: model.Type, vocabulary: Vocabulary
) -> None:
    for constraint in constraints:
        if constraint.kind is ConstraintKind.LINEAR and not vocabulary.is_numeric(type_):
            message = f"expected numbers or tuples of numbers to interpolate, got {came}"
            vocabulary.reporter.error("K0304", message, constraint.span, "write 'use most recent'")


def _check_label(label: model.Label, vocabulary: Vocabulary) -> model.FeatureDeclaration | None:
    feature = vocabulary.features.get(label.name.text)
    if feature is None:
        if label.arguments:
            vocabulary.knows(vocabulary.features, "feature", label.name)
        return None
    if len(feature.sorts) != len(label.arguments):
        message = f"expected {_count(len(feature.sorts), 'object')} for the feature {feature.name}, got {label}"
        vocabulary.reporter.error("K0301", message, label.span)
        return feature
    for argument, sort in zip(label.arguments, feature.sorts, strict=True):
        if vocabulary.knows(vocabulary.objects, "object", argument):
            actual = vocabulary.objects[argument.text]
            if not vocabulary.are_same(model.NamedType(actual), model.NamedType(sort)):
                message = f"expected an object of sort {sort}, got {argument.text!r} of sort {actual}"
                vocabulary.reporter.error("K0305", message, argument.span)
    return feature


def _check_control(process: model.MediationDeclaration, vocabulary: Vocabulary) -> None:
    label = process.control.label
    producer = vocabulary.processes.get(str(label))
    actual = vocabulary.output_of(producer) if producer else None
    if actual and not vocabulary.are_same(_SET_OF_LABELS, actual):
        message = f"expected a control of type {_SET_OF_LABELS}, the labels to pass on, got {label} of type {actual}"
        vocabulary.reporter.error("K0303", message, label.span)


_SET_OF_LABELS = model.SetType(model.NamedType(Name("string")))


def _check_configure(process: model.ConfigureDeclaration, vocabulary: Vocabulary) -> None:
    name = process.function
    hint = "'strmgen' runs a unit" if name.text in vocabulary.functions else ""
    if vocabulary.knows(vocabulary.configurations, "configuration", name, hint=hint):
        declared = vocabulary.configurations[name.text]
        _check_input(process.input, declared.input, f"configuration {name}", vocabulary)


def _check_function(process: model.GeneratorDeclaration, vocabulary: Vocabulary) -> None:
    name = process.function
    function = vocabulary.functions.get(name.text)
    if function is None:
        _report_unknown_function(process, vocabulary)
    elif isinstance(function, model.SourceDeclaration):
        if process.inputs:
            vocabulary.reporter.error("K0302", f"expected a unit before '(', got the source {name.text!r}", name.span)
    elif len(function.inputs) != len(process.inputs):
        message = (
            f"expected {_count(len(function.inputs), 'input')} for the unit {name}, got {len(process.inputs) or 'none'}"
        )
        vocabulary.reporter.error("K0302", message, name.span)
    else:
        for term, expected in zip(process.inputs, function.inputs, strict=True):
            _check_input(term, expected, f"unit {name}", vocabulary)


def _report_unknown_function(process: model.GeneratorDeclaration, vocabulary: Vocabulary) -> None:
    name = process.function
    kind, class_ = ("unit", model.UnitDeclaration) if process.inputs else ("source", model.SourceDeclaration)
    known = [text for text, one in vocabulary.functions.items() if isinstance(one, class_)]
    hint = vocabulary.nearest(name.text, known)
    if hint.edit is None:
        if name.text in vocabulary.configurations:
            hint = Hint("'configure' runs a configuration")
        elif name.text in vocabulary.processes:
            hint = Hint("a stream under a policy is declared by 'stream'")
    vocabulary.knows({}, kind, name, hint=hint)


def _check_input(term: model.Term, expected: model.Type, reader: str, vocabulary: Vocabulary) -> None:
    producer = vocabulary.processes.get(str(term.label))
    actual = vocabulary.output_of(producer) if producer else None
    is_interpolated = any(constraint.kind is ConstraintKind.LINEAR for constraint in term.constraints)
    if actual and not vocabulary.are_same(expected, actual, is_interpolated=is_interpolated):
        message = f"expected an input of type {expected} for the {reader}, got {term.label} of type {actual}"
        is_between = is_interpolated and vocabulary.are_same(expected, actual)
        hint = "interpolated between whole numbers, it gives floats" if is_between else ""
        vocabulary.reporter.error("K0303", message, term.label.span, hint)


def _check_type(type_: model.Type, vocabulary: Vocabulary) -> None:
    for name in names_in(type_):
        if name.text not in BASIC_TYPES:
            hint = "" if name.text in vocabulary.sorts else _nearest_type(name, vocabulary)
            vocabulary.knows(vocabulary.sorts, "type", name, hint=hint)


def _nearest_type(name: Name, vocabulary: Vocabulary) -> str | Hint:
    found = vocabulary.nearest(name.text, [*BASIC_TYPES, *vocabulary.sorts])
    return found if found.edit is not None else f"'sort {name};' declares it"


def _count(number: int, word: str) -> str:
    return f"{number or 'no'} {word}" + ("" if number == 1 else "s")
