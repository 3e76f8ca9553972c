"""Do names, numbers of arguments and types of values fit together?"""

from __future__ import annotations

from dyknow.diagnostics import Reporter, suggest
from dyknow.kpl import model
from dyknow.kpl.model import ConstraintKind, Name
from dyknow.kpl.vocabulary import BASIC_TYPES, Vocabulary, names_in


def check_declarations(specification: model.Specification, vocabulary: Vocabulary, reporter: Reporter) -> None:
    """Report unknown names of types and sorts in all declarations, and sorts that are made of themselves."""
    for statement in specification.statements:
        match statement:
            case model.SortDeclaration(name, type_) if type_:
                _check_type(type_, vocabulary)
                if vocabulary.is_made_of_itself(name):
                    message = f"expected a sort that is not made of itself, got {name.text!r}"
                    reporter.error("K0306", message, name.span)
            case model.ObjectDeclaration(sort):
                vocabulary.knows(vocabulary.sorts, "sort", sort)
            case model.FeatureDeclaration(type_, _, sorts):
                _check_type(type_, vocabulary)
                for sort in sorts:
                    vocabulary.knows(vocabulary.sorts, "sort", sort)
            case model.SourceDeclaration(type_):
                _check_type(type_, vocabulary)
            case model.UnitDeclaration(type_, _, inputs):
                for one in (type_, *inputs):
                    _check_type(one, vocabulary)


def check_process(process: model.GeneratorDeclaration, vocabulary: Vocabulary, reporter: Reporter) -> None:
    """Report a source or unit that is applied wrongly, and a label that cannot carry what comes out."""
    for term in process.inputs:
        check_term(term, vocabulary, reporter)
    output = _output_type(process, vocabulary)
    feature = _check_label(process.label, vocabulary, reporter)
    _check_function(process, vocabulary, reporter)
    if feature and output and not vocabulary.are_same(feature.type, output):
        message = f"expected values of type {feature.type} for the feature {feature.name}, got {output}"
        reporter.error("K0303", message, process.function.span)


def check_term(term: model.Term, vocabulary: Vocabulary, reporter: Reporter) -> None:
    """Report a label that does not exist, and an interpolation of what is no number."""
    label = str(term.label)
    hint = ""
    if label in vocabulary.streams:
        hint = "a stream is read by the host only; read the label behind it"
    elif label in vocabulary.functions:
        hint = "that is host code; 'strmgen' gives its stream a label"
    if not vocabulary.knows(vocabulary.processes, "label", term.label, hint=hint):
        return
    type_ = _output_type(vocabulary.processes[label], vocabulary)
    for constraint in term.constraints:
        if constraint.kind is ConstraintKind.LINEAR and type_ and not vocabulary.is_numeric(type_):
            message = f"expected numbers or tuples of numbers to interpolate, got {label!r} of type {type_}"
            reporter.error("K0304", message, constraint.span, "write 'use most recent'")


def _check_label(label: model.Label, vocabulary: Vocabulary, reporter: Reporter) -> model.FeatureDeclaration | None:
    feature = vocabulary.features.get(label.name.text)
    if feature is None:
        if label.arguments:
            vocabulary.knows(vocabulary.features, "feature", label.name)
        return None
    if len(feature.sorts) != len(label.arguments):
        message = f"expected {_count(len(feature.sorts), 'object')} for the feature {feature.name}, got {label}"
        reporter.error("K0301", message, label.span)
        return feature
    for argument, sort in zip(label.arguments, feature.sorts, strict=True):
        if vocabulary.knows(vocabulary.objects, "object", argument):
            actual = vocabulary.objects[argument.text]
            if not vocabulary.are_same(model.NamedType(actual), model.NamedType(sort)):
                message = f"expected an object of sort {sort}, got {argument.text!r} of sort {actual}"
                reporter.error("K0305", message, argument.span)
    return feature


def _check_function(process: model.GeneratorDeclaration, vocabulary: Vocabulary, reporter: Reporter) -> None:
    name = process.function
    kind = "unit" if process.inputs else "source"
    hint = "a stream under a policy is declared by 'stream'" if name.text in vocabulary.processes else ""
    known = {text for text, one in vocabulary.functions.items() if isinstance(one, _CLASSES[kind])}
    function = vocabulary.functions.get(name.text)
    if function is None:
        hint = "" if suggest(name.text, known).startswith("did") else hint
        vocabulary.knows(dict.fromkeys(known), kind, name, hint=hint)
    elif isinstance(function, model.SourceDeclaration):
        if process.inputs:
            reporter.error("K0302", f"expected a unit before '(', got the source {name.text!r}", name.span)
    elif len(function.inputs) != len(process.inputs):
        message = (
            f"expected {_count(len(function.inputs), 'input')} for the unit {name}, got {len(process.inputs) or 'none'}"
        )
        reporter.error("K0302", message, name.span)
    else:
        _check_inputs(process, function, vocabulary, reporter)


_CLASSES = {"unit": model.UnitDeclaration, "source": model.SourceDeclaration}


def _check_inputs(
    process: model.GeneratorDeclaration, unit: model.UnitDeclaration, vocabulary: Vocabulary, reporter: Reporter
) -> None:
    for term, expected in zip(process.inputs, unit.inputs, strict=True):
        producer = vocabulary.processes.get(str(term.label))
        actual = _output_type(producer, vocabulary) if producer else None
        if actual and not vocabulary.are_same(expected, actual):
            message = (
                f"expected an input of type {expected} for the unit {unit.name}, got {term.label} of type {actual}"
            )
            reporter.error("K0303", message, term.label.span)


def _output_type(process: model.GeneratorDeclaration, vocabulary: Vocabulary) -> model.Type | None:
    function = vocabulary.functions.get(process.function.text)
    return function.type if function else None


def _check_type(type_: model.Type, vocabulary: Vocabulary) -> None:
    for name in names_in(type_):
        if name.text not in BASIC_TYPES:
            vocabulary.knows(vocabulary.sorts, "type", name, hint=_nearest_type(name, vocabulary))


def _nearest_type(name: Name, vocabulary: Vocabulary) -> str:
    return suggest(name.text, [*BASIC_TYPES, *vocabulary.sorts]) or f"'sort {name};' declares it"


def _count(number: int, word: str) -> str:
    return f"{number or 'no'} {word}" + ("" if number == 1 else "s")
