"""Does a pattern fit the declaration of its event, and what stands in each of its fields?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from chronicles.compilation.symbols import UNDECLARED_FIELD, Field, Symbols, check_value
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
    span: Span

    @property
    def all(self) -> tuple[Cell, ...]:
        """Arguments and values in one row."""
        return self.arguments + self.values


class PatternResolver:
    """Looks patterns up in a name space; what does not fit goes to the reporter."""

    def __init__(self, symbols: Symbols, reporter: Reporter) -> None:
        self._symbols = symbols
        self._reporter = reporter

    def event(self, pattern: model.Pattern) -> Cells:
        """Resolve the pattern of an event: a message, or a change of an attribute."""
        values = pattern.change or ()
        cells = self._cells(pattern, pattern.arguments, values, is_message=pattern.change is None)
        if len(cells.values) == 2 and cells.values[0].constant is not None:
            old, new = cells.values
            if old.constant == new.constant:
                message = f"expected a change between two values, got {old.constant!r} twice"
                hint = "the two differ; in a chronicle one of them may be ?"
                self._reporter.error("C0306", message, new.span, hint)
        return cells

    def fluent(self, fluent: model.Fluent) -> Cells:
        """Resolve an attribute and the value it must have."""
        return self._cells(fluent, fluent.arguments, (fluent.value,), is_message=False)

    def _cells(
        self,
        named: model.Pattern | model.Fluent,
        arguments: Sequence[model.Term],
        values: Sequence[model.Term],
        *,
        is_message: bool,
    ) -> Cells:
        fields, value_field = self._signature(named, len(arguments), is_message=is_message)
        return Cells(
            named.name,
            tuple(self._cell(term, field) for term, field in zip(arguments, fields, strict=True)),
            tuple(self._cell(term, value_field) for term in values),
            named.span,
        )

    def _cell(self, term: model.Term, field: Field) -> Cell:
        match term:
            case model.Variable(name, span):
                return Cell(name, None, field, span)
            case model.Anything(span):
                return Cell("", None, field, span)
            case model.Literal():
                text = self._symbols.value_of(term, self._reporter)
                check_value(text, field, term.span, self._reporter)
                return Cell("", text, field, term.span)

    def _signature(
        self, named: model.Pattern | model.Fluent, count: int, *, is_message: bool
    ) -> tuple[tuple[Field, ...], Field]:
        undeclared = (UNDECLARED_FIELD,) * count, UNDECLARED_FIELD
        if self._symbols.is_open:
            return undeclared
        signature = self._symbols.signatures.get(named.name)
        if signature is None:
            wanted = "an attribute or a message" if isinstance(named, model.Pattern) else "an attribute"
            message = f"expected {wanted}, got the unknown name {named.name!r}"
            near = suggest(named.name, list(self._symbols.signatures))
            if near.edit is None:
                near = Hint("; ".join(filter(None, [f"declare it: {_declaration(named)}", near.text])))
            self._reporter.error("C0201", message, named.name_span, near)
            return undeclared
        if (signature.value is None) != is_message:
            self._report_kind(named, is_message=is_message)
        if len(signature.arguments) != count:
            wanted = _arguments(len(signature.arguments))
            message = f"expected {wanted} for {named.name!r}, got {count}"
            hint = f"write {named.name} with {wanted}; in a chronicle ? stands for anything"
            self._reporter.error("C0301", message, named.span, hint)
            return undeclared
        return signature.arguments, signature.value or UNDECLARED_FIELD

    def _report_kind(self, named: model.Pattern | model.Fluent, *, is_message: bool) -> None:
        name = named.name
        if is_message:
            message = f"expected the old and the new value of the attribute {name!r}, got none"
            hint = f"write {name}[...]:(old, new), where ? stands for any value"
        else:
            message = f"expected an attribute, got the message {name!r}, which has no value"
            hint = f"write {name}[...] without ':'" if isinstance(named, model.Pattern) else ""
        self._reporter.error("C0302", message, named.span, hint)


def _arguments(count: int) -> str:
    return "1 argument" if count == 1 else f"{count} arguments"


def _declaration(named: model.Pattern | model.Fluent) -> str:
    """Write the declaration that an unknown name lacks."""
    kind = "message" if isinstance(named, model.Pattern) and named.change is None else "attribute"
    parameters = ", ".join(f"?a{place}" for place in range(1, len(named.arguments) + 1))
    return f"{kind} {named.name}[{parameters}]"
