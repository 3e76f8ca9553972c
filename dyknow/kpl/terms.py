"""Where does a specification read streams, and under which policies?"""

from __future__ import annotations

from collections.abc import Iterator

from dyknow.kpl import model


def terms_of(specification: model.Specification) -> Iterator[model.Term]:
    """Give every place where the stream of a declared label is read, in the order of the text."""
    for statement in specification.statements:
        if isinstance(statement, model.Process):
            yield from statement.inputs
        elif isinstance(statement, model.StreamDeclaration):
            yield statement.term


def policies_of(specification: model.Specification) -> Iterator[tuple[model.Constraint, ...]]:
    """Give the constraints of every policy, those under which mediations read included, in the order of the text."""
    for statement in specification.statements:
        if isinstance(statement, model.MediationDeclaration):
            yield statement.constraints
        elif isinstance(statement, model.Process):
            yield from (term.constraints for term in statement.inputs)
        elif isinstance(statement, model.StreamDeclaration):
            yield statement.term.constraints
