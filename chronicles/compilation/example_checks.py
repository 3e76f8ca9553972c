"""Do the examples in some texts fit the declarations and chronicles of the texts?

Events are looked up as the patterns of a chronicle are, expected occurrences in the heads of the chronicles. In the
examples handed on, names of constants are replaced by their values.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from chronicles.compilation.names.patterns import Cell, PatternResolver
from chronicles.compilation.names.symbols import Symbols
from chronicles.language import model
from chronicles.language.printer import print_term
from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.durations import format_duration


def check_examples(
    files: Iterable[model.ChronicleFile],
    chronicles: Mapping[str, model.Chronicle],
    symbols: Symbols,
    reporter: Reporter,
) -> tuple[model.Example, ...]:
    """Check the examples of some texts and give them with their constants replaced.

    Parameters
    ----------
    files : the texts; what they declare besides examples is in `chronicles` and `symbols`.
    chronicles : by name.
    symbols : the name space of the texts.
    reporter : receives what does not fit.
    """
    checker = _ExampleChecker(chronicles, symbols, reporter)
    declarations = (one for file in files for one in file.declarations)
    return tuple(checker.example(one) for one in declarations if isinstance(one, model.Example))


class _ExampleChecker:
    """Checks examples against one name space."""

    def __init__(self, chronicles: Mapping[str, model.Chronicle], symbols: Symbols, reporter: Reporter) -> None:
        self._chronicles = chronicles
        self._symbols = symbols
        self._reporter = reporter
        self._resolver = PatternResolver(symbols, reporter)

    def example(self, example: model.Example) -> model.Example:
        """Check one example; give it with constants replaced."""
        _check_until(example, self._reporter)
        events, expected = map(self._event, example.events), map(self._expected, example.expected)
        return replace(example, events=tuple(events), expected=tuple(expected))

    def _event(self, event: model.ExampleEvent) -> model.ExampleEvent:
        cells = self._resolver.cells(event.pattern)
        arguments, values = (tuple(map(_literal, part)) for part in (cells.arguments, cells.values))
        return replace(event, pattern=replace(event.pattern, arguments=arguments, values=values))

    def _expected(self, one: model.ExpectedOccurrence) -> model.ExpectedOccurrence:
        chronicle = self._chronicles.get(one.chronicle)
        if chronicle is None:
            message = f"expected a chronicle, got the unknown name {one.chronicle!r}"
            self._reporter.error("C0207", message, one.name_span, suggest(one.chronicle, list(self._chronicles)))
        else:
            self._check_roles(one, [parameter.name for parameter in chronicle.parameters])
        fillings = tuple(replace(role, value=self._value(role.value)) for role in one.fillings)
        return replace(one, fillings=fillings)

    def _value(self, literal: model.Literal) -> model.Literal:
        return model.Literal(self._symbols.value_of(literal, self._reporter), True, span=literal.span)

    def _check_roles(self, one: model.ExpectedOccurrence, known: list[str]) -> None:
        names = [role.name for role in one.fillings]
        for index, role in enumerate(one.fillings):
            if role.name not in known:
                message = f"expected a role of {one.chronicle!r}, got {role.name!r}"
                hint = suggest(role.name, known)
                if hint.edit is not None:
                    hint = hint._replace(edit=f"{hint.edit}={print_term(role.value)}")
                self._reporter.error("C0208", message, role.span, hint)
            elif role.name in names[:index]:
                message = f"expected each role once, got {role.name!r} twice"
                self._reporter.error("C0208", message, role.span, "keep one of them")
        missing = [name for name in known if name not in names]
        if missing and set(names) <= set(known):  # a misspelled one is not missing too
            message = f"expected all roles of {one.chronicle!r}, got none for {missing[0]!r}"
            listed = ", ".join(f"{name}=..." for name in known)
            self._reporter.error("C0208", message, one.name_span, f"write {one.chronicle}[{listed}]")


def _check_until(example: model.Example, reporter: Reporter) -> None:
    """Time does not end before the last event."""
    until_us = example.until_us
    if until_us is None or until_us == model.UNREAD_US or not example.events:
        return
    last = max(example.events, key=lambda event: event.t_us)
    if last.t_us > until_us:
        times = f"{format_duration(until_us)}, got one at {format_duration(last.t_us)}"
        message = f"expected the events of an example up to its 'until' at {times}"
        reporter.error("C0410", message, last.span, f"write until {format_duration(last.t_us)}, or later")


def _literal(cell: Cell) -> model.Literal:
    # What has no constant was reported by the parser: events of examples have values only.
    return model.Literal(cell.constant or "", True, span=cell.span)
