"""What is named in some texts and then not used, or used and never given by anybody?"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from chronicles.compilation.names.patterns import Cell
from chronicles.language import model
from chronicles.language.printer import print_declaration, print_statement
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.ways import reached

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
    emitted = {pattern.name for one in chronicles for pattern in one.given}
    known = sorted({*produced, *emitted})
    for chronicle in chronicles:
        first = {named.name: named for named in reversed(chronicle.looked_at)}
        for named in first.values():
            if named.name not in known:
                message = f"expected a name that the stream or a chronicle gives, got {named.name!r}"
                reporter.warning("C0901", message, named.name_span, suggest(named.name, known))


_NAME = re.compile(r"\w+")


@dataclass(frozen=True, slots=True)
class Printed:
    """A declaration, its canonical text, and all names in the text."""

    declaration: model.Declaration
    text: str
    names: frozenset[str]


def print_all(files: Iterable[model.ChronicleFile]) -> list[Printed]:
    """Write every declaration of some texts."""
    found = []
    for file in files:
        for one in file.declarations:
            text = print_declaration(one)
            found.append(Printed(one, text, frozenset(_NAME.findall(text))))
    return found


def canonical_texts(printed: Collection[Printed]) -> dict[str, str]:
    """Write each chronicle with the declarations it rests on, so that equal texts mean equal things.

    Returns
    -------
    By name of the chronicle; of several of one name the first.
    """
    others: dict[str, dict[str, Printed]] = {}  # by name and text: a message and its domain may have one name
    for one in printed:
        if not isinstance(one.declaration, model.Chronicle | model.TimeUnit | model.Example):
            others.setdefault(one.declaration.name, {})[one.text] = one
    unit_of = {one.declaration.span.file: one.text for one in printed if isinstance(one.declaration, model.TimeUnit)}
    found: dict[str, str] = {}
    for one in printed:
        if isinstance(one.declaration, model.Chronicle) and one.declaration.name not in found:
            used = [
                declared for name in sorted(_reached(one.names, others)) for _, declared in sorted(others[name].items())
            ]
            # Durations are printed with their unit, but a constant without one counts in that of the text that uses it.
            unit = unit_of.get(one.declaration.span.file, "")
            head = [unit] if unit and any(_is_bare_number(other.declaration) for other in used) else []
            found[one.declaration.name] = "\n".join([*head, *(other.text for other in used), one.text])
    return found


def _is_bare_number(one: model.Declaration) -> bool:
    return isinstance(one, model.Constant) and isinstance(one.value, model.Literal) and one.value.is_whole_number


def _reached(names: Iterable[str], others: Mapping[str, Mapping[str, Printed]]) -> frozenset[str]:
    """Give the declarations that some names mention, directly or by way of others."""
    return reached(
        others.keys() & names,
        lambda name: others.keys() & frozenset().union(*(one.names for one in others[name].values())),
    )
