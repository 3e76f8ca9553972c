"""What is named in some texts and then not used, or used and never given by anybody?"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from chronicles.compilation.canonical import Printed
from chronicles.compilation.patterns import Cell
from chronicles.language import model
from chronicles.language.printer import print_statement
from dyknow.language.diagnostics import Hint, Reporter, suggest

# How a variable stands in the text of a report.
VARIABLE = re.compile(r"\?([A-Za-z_][A-Za-z0-9_]*)")


def warn_single_uses(
    chronicle: model.Chronicle, cells: Iterable[Cell], distinct: Collection[str], reporter: Reporter
) -> None:
    """Warn about variables that stand once and so ask for nothing that `?` does not ask for.

    Parameters
    ----------
    chronicle : its head, constraints and actions count as uses.
    cells : the fields of its patterns that hold variables.
    distinct : variables that must differ from others, each named by its class: to stand once is enough for them.
    reporter : receives the warnings.
    """
    counted = Counter(cell.variable for cell in cells)
    used = {one.name for one in chronicle.parameters} | set(distinct)
    for one in (*chronicle.statements, *chronicle.actions):
        if isinstance(one, model.Equality | model.Membership | model.Allowance | model.Emit | model.AssertAction):
            used.update(VARIABLE.findall(print_statement(one)))
        elif isinstance(one, model.Report):
            used.update(VARIABLE.findall(one.text))
    for cell in cells:
        if counted[cell.variable] == 1 and cell.variable not in used:
            message = f"expected ?{cell.variable} to be used again, got it once"
            reporter.warning("C0806", message, cell.span, Hint("write ? for anything", "?"))


def warn_unused(printed: Collection[Printed], reporter: Reporter) -> None:
    """Warn about constants and domains that no other declaration mentions.

    A text without chronicles is a vocabulary for others: what it declares need not be used.
    """
    mentioned = Counter(name for one in printed for name in one.names)
    with_chronicles = {one.declaration.span.file for one in printed if isinstance(one.declaration, model.Chronicle)}
    for declaration in (one.declaration for one in printed):
        if not isinstance(declaration, model.Constant | model.Domain) or mentioned[declaration.name] > 1:
            continue
        if declaration.span.file in with_chronicles:
            kind = "constant" if isinstance(declaration, model.Constant) else "domain"
            message = f"expected the {kind} {declaration.name!r} to be used, got no use of it"
            reporter.warning("C0209", message, declaration.name_span, "leave it out")


def warn_unproduced(files: Iterable[model.ChronicleFile], produced: Collection[str], reporter: Reporter) -> None:
    """Warn about events and attributes that chronicles look at and that nothing gives.

    Parameters
    ----------
    files : the texts; what their chronicles emit and assert is given too.
    produced : names of the messages and attributes that the stream has.
    reporter : receives the warnings.
    """
    chronicles = [one for file in files for one in file.declarations if isinstance(one, model.Chronicle)]
    emitted = {name for one in chronicles for name in _emitted(one)}
    known = sorted({*produced, *emitted})
    for chronicle in chronicles:
        first = {named.name: named for named in reversed([*_looked_at(chronicle)])}
        for named in first.values():
            if named.name not in known:
                message = f"expected a name that the stream or a chronicle gives, got {named.name!r}"
                reporter.warning("C0901", message, named.name_span, suggest(named.name, known))


def _emitted(chronicle: model.Chronicle) -> Iterator[str]:
    for one in chronicle.actions:
        if isinstance(one, model.Emit):
            yield one.pattern.name
        elif isinstance(one, model.AssertAction):
            yield one.fluent.name


def _looked_at(chronicle: model.Chronicle) -> Iterator[model.Pattern | model.Fluent]:
    for one in chronicle.statements:
        if isinstance(one, model.EventStatement | model.NoEventStatement | model.OccursStatement):
            yield one.pattern
        elif isinstance(one, model.HoldStatement | model.AssertStatement):
            yield one.fluent
