"""Which chronicles do some texts define?

`load` reads and checks texts and gives a `ChronicleSet`, which every executor takes; a text with errors gives none.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from chronicles.compilation.compiler import compile_chronicle
from chronicles.compilation.hierarchy import order_by_emission
from chronicles.compilation.plan import Plan
from chronicles.compilation.symbols import Symbols, collect_symbols
from chronicles.errors import ChronicleError
from chronicles.language import model
from chronicles.language.diagnostics import Diagnostic, Reporter
from chronicles.language.parser import parse
from chronicles.language.printer import print_declaration

_VERSION_LENGTH = 12


@dataclass(frozen=True, slots=True)
class ChronicleSet:
    """Chronicles that share one name space, checked and compiled.

    `plans` stand in an order in which every chronicle comes after those whose emitted events it looks at; `defaults`
    gives the value of an attribute before its first change where that is not "unknown"; `texts` the canonical text of
    each chronicle; `warnings` what the check found besides errors.
    """

    plans: tuple[Plan, ...]
    defaults: tuple[tuple[str, str], ...]
    texts: tuple[tuple[str, str], ...]
    warnings: tuple[Diagnostic, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chronicles in the order of `plans`."""
        return tuple(plan.name for plan in self.plans)

    def plan(self, name: str) -> Plan:
        """Give the plan of a chronicle.

        Raises
        ------
        ChronicleError
            If there is no such chronicle.
        """
        for plan in self.plans:
            if plan.name == name:
                return plan
        raise ChronicleError(f"chronicle set: expected one of {list(self.names)}, got {name!r}")


def load(text: str, *, name: str = "<text>") -> ChronicleSet:
    """Read one chronicle text.

    Parameters
    ----------
    text : the whole text.
    name : what messages call it, such as a file name.

    Raises
    ------
    ChronicleError
        With all diagnostics, if the text has an error.

    Examples
    --------
    >>> load("message honk[?car] chronicle twice[?car](t1, t2) { "
    ...      "event(honk[?car], t1) event(honk[?car], t2) t2 - t1 in ]0s, 2s] }").names
    ('twice',)
    >>> load("message honk[?car] chronicle once[?car](t1) { event(hnk[?car], t1) }")
    Traceback (most recent call last):
        ...
    chronicles.errors.ChronicleError: error[C0201]: expected an attribute or a message, got the unknown name 'hnk'
     --> <text>:1:53
      |
    1 | message honk[?car] chronicle once[?car](t1) { event(hnk[?car], t1) }
      |                                                     ^^^
      = help: did you mean 'honk'?
    """
    return load_texts([(name, text)])


def load_texts(texts: Sequence[tuple[str, str]]) -> ChronicleSet:
    """Read several texts, (name, text) each, into one name space.

    Raises
    ------
    ChronicleError
        With all diagnostics of all texts, if one has an error.
    """
    loaded, diagnostics = _read(texts)
    if loaded is None:
        raise ChronicleError.from_diagnostics(diagnostics)
    return loaded


def check_texts(texts: Sequence[tuple[str, str]]) -> tuple[Diagnostic, ...]:
    """Give everything that is wrong or doubtful in some texts, empty if nothing is."""
    return _read(texts)[1]


def _read(texts: Sequence[tuple[str, str]]) -> tuple[ChronicleSet | None, tuple[Diagnostic, ...]]:
    reporter = Reporter(dict(texts))
    files = [parse(text, name, reporter) for name, text in texts]
    symbols = collect_symbols(files, reporter)
    chronicles = _chronicles(files, reporter)
    canonical = {one.name: _canonical_text(one, files) for one in chronicles}
    plans = [compile_chronicle(one, symbols, _digest(canonical[one.name]), reporter) for one in chronicles]
    compiled = [plan for plan in plans if plan is not None]
    ordered = order_by_emission(compiled, {one.name: one.name_span for one in chronicles}, reporter)
    found = reporter.diagnostics
    if reporter.errors:
        return None, found
    texts_of = tuple((plan.name, canonical[plan.name]) for plan in ordered)
    return ChronicleSet(ordered, _defaults(symbols), texts_of, found), found


def _chronicles(files: Iterable[model.ChronicleFile], reporter: Reporter) -> list[model.Chronicle]:
    found: dict[str, model.Chronicle] = {}
    for file in files:
        for one in file.declarations:
            if not isinstance(one, model.Chronicle):
                continue
            if one.name in found:
                first = found[one.name].name_span
                message = f"expected one chronicle {one.name!r}, got another one than at {first.file}:{first.line}"
                reporter.error("C0206", message, one.name_span, "choose another name")
            found.setdefault(one.name, one)
    return list(found.values())


def _canonical_text(chronicle: model.Chronicle, files: Iterable[model.ChronicleFile]) -> str:
    """Write a chronicle with the declarations it rests on, so that equal texts mean equal things."""
    others = {
        one.name: print_declaration(one)
        for file in files
        for one in file.declarations
        if not isinstance(one, model.Chronicle | model.TimeUnit)
    }
    used: dict[str, str] = {}
    pending = [print_declaration(chronicle)]
    while pending:
        words = set(re.findall(r"\w+", pending.pop()))
        for name in sorted(words & others.keys() - used.keys()):
            used[name] = others[name]
            pending.append(others[name])
    return "\n".join([*(used[name] for name in sorted(used)), print_declaration(chronicle)])


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_VERSION_LENGTH]


def _defaults(symbols: Symbols) -> tuple[tuple[str, str], ...]:
    return tuple((one.name, one.default) for one in symbols.signatures.values() if one.value is not None)
