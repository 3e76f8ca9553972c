"""Does each name have one number of arguments, where no declaration says how many?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from chronicles.language import model
from dyknow.language.diagnostics import Reporter


def warn_arities(files: Iterable[model.ChronicleFile], reporter: Reporter) -> None:
    """Warn about names that stand with different numbers of arguments: an event has one number, so one is a slip.

    Parameters
    ----------
    files : texts that declare neither messages nor attributes.
    reporter : receives a warning for the first place of each further number of arguments.
    """
    first: dict[str, model.Pattern | model.Fluent] = {}
    warned: set[tuple[str, int]] = set()
    for one in (named for file in files for declaration in file.declarations for named in _named(declaration)):
        known, count = first.setdefault(one.name, one), len(one.arguments)
        if count != len(known.arguments) and (one.name, count) not in warned:
            warned.add((one.name, count))
            wanted = "1 argument" if len(known.arguments) == 1 else f"{len(known.arguments)} arguments"
            message = f"expected {wanted} for {one.name!r} as in line {known.span.line}"
            hint = "an event fits only a pattern with as many arguments as it has; ? stands for anything"
            related = [(known.span, f"{wanted} here")]
            reporter.warning("C0308", f"{message}, got {count}", one.span, hint, related=related)


def _named(declaration: model.Declaration) -> Iterator[model.Pattern | model.Fluent]:
    if isinstance(declaration, model.Example):
        yield from (event.pattern for event in declaration.events)
    elif isinstance(declaration, model.Chronicle):
        for one in (*declaration.statements, *declaration.actions):
            match one:
                case model.EventStatement() | model.NoEventStatement() | model.OccursStatement() | model.Emit():
                    yield one.pattern
                case model.HoldStatement() | model.AssertStatement() | model.AssertAction():
                    yield one.fluent
                case _:
                    pass
