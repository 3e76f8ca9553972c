"""Which text says all that a chronicle means, and nothing else?"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from chronicles.language import model
from chronicles.language.printer import print_declaration

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
            reached = sorted(_reached(one.names, others))
            used = [declared for name in reached for _, declared in sorted(others[name].items())]
            # Durations are printed with their unit, but a constant without one counts in that of the text that uses it.
            unit = unit_of.get(one.declaration.span.file, "")
            head = [unit] if unit and any(_is_bare_number(other.declaration) for other in used) else []
            found[one.declaration.name] = "\n".join([*head, *(other.text for other in used), one.text])
    return found


def _is_bare_number(declaration: model.Declaration) -> bool:
    if not isinstance(declaration, model.Constant) or isinstance(declaration.value, model.Duration):
        return False
    return declaration.value.is_whole_number


def _reached(names: Iterable[str], others: Mapping[str, Mapping[str, Printed]]) -> set[str]:
    """Give the declarations that some names mention, directly or by way of others."""
    reached: set[str] = set()
    pending = [name for name in names if name in others]
    while pending:
        name = pending.pop()
        if name not in reached:
            reached.add(name)
            pending += [further for one in others[name].values() for further in one.names if further in others]
    return reached
