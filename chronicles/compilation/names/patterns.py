"""Does a pattern fit the declaration of its event, and what stands in each of its fields?"""

from dataclasses import dataclass

from chronicles.compilation.names.symbols import UNDECLARED_FIELD, Field, Symbols, arguments_text, check_value
from chronicles.language import model
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.places import Span


@dataclass(frozen=True, slots=True)
class Cell:
    """What a pattern has in one field: a variable, a constant, or (both empty) anything."""

    variable: str
    constant: str | None
    field: Field
    span: Span


@dataclass(frozen=True, slots=True)
class Cells:
    """The fields of a pattern: arguments, then old and new value (a change), the value (a fluent) or nothing."""

    name: str
    arguments: tuple[Cell, ...]
    values: tuple[Cell, ...]

    @property
    def all(self) -> tuple[Cell, ...]:
        """Arguments and values in one row."""
        return self.arguments + self.values


class PatternResolver:
    """Looks patterns up in a name space; what does not fit goes to the reporter."""

    def __init__(self, symbols: Symbols, reporter: Reporter) -> None:
        self._symbols = symbols
        self._reporter = reporter

    def cells(self, pattern: model.Pattern) -> Cells:
        """Resolve a message, a change of an attribute, or an attribute and the value it must have."""
        fields, value_field = self._signature(pattern)
        arguments = tuple(self._cell(term, field) for term, field in zip(pattern.arguments, fields, strict=True))
        values = tuple(self._cell(term, value_field) for term in pattern.values)
        constants = [one.constant for one in values]
        if len(values) == 2 and constants[0] is not None and constants[0] == constants[1]:
            message = f"expected a change between two values, got {constants[0]!r} twice"
            hint = "the two differ; in a chronicle one of them may be ?"
            self._reporter.error("C0306", message, values[1].span, hint)
        return Cells(pattern.name, arguments, values)

    def _cell(self, term: model.Term, field: Field) -> Cell:
        match term:
            case model.Variable(name):
                return Cell(name, None, field, term.span)
            case model.Anything():
                return Cell("", None, field, term.span)
            case model.Literal():
                text = self._symbols.value_of(term, self._reporter)
                check_value(text, field, term.span, self._reporter)
                return Cell("", text, field, term.span)

    def _signature(self, named: model.Pattern) -> tuple[tuple[Field, ...], Field]:
        count, is_message = len(named.arguments), not named.values
        undeclared = (UNDECLARED_FIELD,) * count, UNDECLARED_FIELD
        if self._symbols.is_open:
            return undeclared
        signature = self._symbols.signatures.get(named.name)
        if signature is None:
            wanted = "an attribute" if len(named.values) == 1 else "an attribute or a message"
            message = f"expected {wanted}, got the unknown name {named.name!r}"
            near = suggest(named.name, list(self._symbols.signatures))
            if near.edit is None:
                near = Hint(
                    "; ".join(filter(None, [f"if the events have it, declare it: {_declaration(named)}", near.text]))
                )
            self._reporter.error("C0201", message, named.name_span, near)
            return undeclared
        if (signature.value is None) != is_message:
            self._report_kind(named)
        if len(signature.arguments) != count:
            wanted = arguments_text(len(signature.arguments))
            message = f"expected {wanted} for {named.name!r}, got {count}"
            hint = f"write {named.name} with {wanted}; in a chronicle ? stands for anything"
            self._reporter.error("C0301", message, named.span, hint)
            return undeclared
        return signature.arguments, signature.value or UNDECLARED_FIELD

    def _report_kind(self, named: model.Pattern) -> None:
        name = named.name
        if not named.values:
            message = f"expected the old and the new value of the attribute {name!r}, got none"
            hint = f"write {name}[...]:(old, new), where ? stands for any value"
        else:
            message = f"expected an attribute, got the message {name!r}, which has no value"
            hint = f"write {name}[...] without ':'" if len(named.values) == 2 else ""
        self._reporter.error("C0302", message, named.span, hint)


def _declaration(named: model.Pattern) -> str:
    """Write the declaration that an unknown name lacks."""
    kind = "attribute" if named.values else "message"
    parameters = ", ".join(f"?a{place}" for place in range(1, len(named.arguments) + 1))
    return f"{kind} {named.name}[{parameters}]"
