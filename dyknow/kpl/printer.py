"""How is a KPL model written? One statement a line, in the shortest form that reads back as the same model."""

from collections.abc import Sequence

from dyknow.kpl import model
from dyknow.kpl.model import Constraint, ConstraintKind
from dyknow.language.durations import format_duration


def print_kpl(specification: model.Specification) -> str:
    """Write a specification.

    Returns
    -------
    The text, with a final newline unless it is empty; comments of the text it was read from are gone.

    Examples
    --------
    >>> from dyknow.kpl.parser import parse_kpl
    >>> print(print_kpl(parse_kpl("stream fast=pos with from 0 to oo,sample every 1000ms // a comment\\n;")), end="")
    stream fast = pos with from 0s to oo, sample every 1s;
    """
    return "".join(f"{print_statement(one)};\n" for one in specification.statements)


def print_statement(statement: model.Statement) -> str:  # noqa: PLR0911 - one form each
    """Write one statement without its semicolon.

    Examples
    --------
    >>> print_statement(model.ObjectDeclaration(model.Name("Car"), (model.Name("car1"), model.Name("car2"))))
    'object Car car1, car2'
    """
    match statement:
        case model.SortDeclaration(name, None):
            return f"sort {name}"
        case model.SortDeclaration(name, type_):
            return f"sort {name} = {type_}"
        case model.ObjectDeclaration(sort, names):
            return f"object {sort} {_list(names)}"
        case model.FeatureDeclaration(type_, name, sorts):
            return f"feature {type_} {name}" + (f"({_list(sorts)})" if sorts else "")
        case model.SourceDeclaration(type_, name):
            return f"source {type_} {name}"
        case model.UnitDeclaration(type_, name, inputs):
            return f"compunit {type_} {name}({_list(inputs)})"
        case model.ConfigurationDeclaration(name, input_):
            return f"configuration {name}({input_})"
        case model.MediationDeclaration(label, kind, type_, constraints, control):
            return f"strmgen {label} = {kind.value} of {type_}{_with(constraints)} by {_term(control)}"
        case model.ConfigureDeclaration(label, function, input_):
            return f"configure {label} = {function}({_term(input_)})"
        case model.GeneratorDeclaration(label, function, inputs):
            arguments = f"({', '.join(map(_term, inputs))})" if inputs else ""
            return f"strmgen {label} = {function}{arguments}"
        case model.StreamDeclaration(name, term):
            return f"stream {name} = {_term(term)}"


def print_constraints(constraints: Sequence[Constraint]) -> str:
    """Write the constraints of a policy; `from` and the `to` behind it become one form.

    Examples
    --------
    >>> print_constraints([Constraint(ConstraintKind.FROM, 0), Constraint(ConstraintKind.TO, 90_000_000)])
    'from 0s to 90s'
    """
    text = ""
    previous: ConstraintKind | None = None
    for constraint in constraints:
        is_end = constraint.kind is ConstraintKind.TO and previous is ConstraintKind.FROM
        text += (" " if is_end else ", ") + _constraint(constraint) if text else _constraint(constraint)
        previous = constraint.kind
    return text


def _constraint(constraint: Constraint) -> str:
    words = constraint.kind.value
    if constraint.us is not None:
        return f"{words} {format_duration(constraint.us)}"
    match constraint.kind:
        case ConstraintKind.FROM:
            return f"{words} now"
        case ConstraintKind.TO | ConstraintKind.MAX_DELAY:
            return f"{words} oo"
        case _:
            return words


def _term(term: model.Term) -> str:
    return f"{term.label}{_with(term.constraints)}"


def _with(constraints: Sequence[Constraint]) -> str:
    return f" with {print_constraints(constraints)}" if constraints else ""


def _list(parts: Sequence[model.Name | model.Type]) -> str:
    return ", ".join(map(str, parts))
