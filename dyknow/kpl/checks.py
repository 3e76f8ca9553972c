"""Does a specification mean anything? Names, types, policies and the graph are checked without any host code."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from dyknow.diagnostics import Diagnostic, Reporter
from dyknow.kpl import model
from dyknow.kpl.findings import KplError
from dyknow.kpl.parser import read_statements
from dyknow.kpl.policies import check_policy
from dyknow.kpl.type_checks import check_declarations, check_process, check_term
from dyknow.kpl.vocabulary import Vocabulary


@dataclass(frozen=True, slots=True)
class Checked:
    """Hold a specification that means something.

    Attributes
    ----------
    vocabulary : its declarations by name.
    processes : its processes, inputs before what reads them.
    warnings : what is allowed but probably not meant.
    """

    specification: model.Specification
    vocabulary: Vocabulary
    processes: tuple[model.GeneratorDeclaration, ...]
    warnings: tuple[Diagnostic, ...]


def check_kpl(text: str, *, name: str = "kpl") -> Checked:
    """Read a KPL text and check whatever can be checked without the host.

    Parameters
    ----------
    text : the whole text.
    name : its file name, for messages.

    Raises
    ------
    KplError
        If the text is malformed or means nothing; it lists every error found.

    Examples
    --------
    >>> checked = check_kpl("source float gps; strmgen pos = gps; stream seen = pos;")
    >>> [str(one.label) for one in checked.processes], checked.warnings
    (['pos'], ())
    >>> check_kpl("source float gps; strmgen pos = gsp; stream seen = pos;")
    Traceback (most recent call last):
    dyknow.kpl.findings.KplError: error[K0202]: expected a declared source, got 'gsp'
     --> kpl:1:33
      |
    1 | source float gps; strmgen pos = gsp; stream seen = pos;
      |                                 ^^^
      = help: did you mean 'gps'?
    """
    reporter = Reporter(text, name, KplError)
    specification, doubtful = read_statements(text, reporter)
    vocabulary = Vocabulary(specification, reporter, doubtful)
    check_declarations(specification, vocabulary, reporter)
    for statement in specification.statements:
        if isinstance(statement, model.GeneratorDeclaration):
            check_process(statement, vocabulary, reporter)
        elif isinstance(statement, model.StreamDeclaration):
            check_term(statement.term, vocabulary, reporter)
    for term in terms_of(specification):
        check_policy(term.constraints, reporter)
    processes = _inputs_first(vocabulary, reporter)
    reporter.raise_if_any()
    _doubt_unread(specification, vocabulary, reporter)
    return Checked(specification, vocabulary, processes, reporter.warnings)


def terms_of(specification: model.Specification) -> Iterator[model.Term]:
    """Give every place where the stream of a process is read, in the order of the text."""
    for statement in specification.statements:
        if isinstance(statement, model.GeneratorDeclaration):
            yield from statement.inputs
        elif isinstance(statement, model.StreamDeclaration):
            yield statement.term


def _inputs_first(vocabulary: Vocabulary, reporter: Reporter) -> tuple[model.GeneratorDeclaration, ...]:
    """Sort the processes so that each comes after what it reads; report every cycle."""
    processes = vocabulary.processes
    inputs = {  # lists without repetition, not sets: the order of creation must not depend on hashes
        label: [one for one in dict.fromkeys(str(term.label) for term in process.inputs) if one in processes]
        for label, process in processes.items()
    }
    while True:
        try:
            return tuple(processes[label] for label in TopologicalSorter(inputs).static_order())
        except CycleError as found:
            cycle: list[str] = found.args[1]  # each is read by the next; the last is the first
            inputs[cycle[1]].remove(cycle[0])
            order = list(processes)
            start = min(range(1, len(cycle)), key=lambda index: order.index(cycle[index]))
            path = " -> ".join([*cycle[start:], *cycle[1 : start + 1]])
            message = f"expected a label that does not read itself, got the cycle {path}"
            reporter.error("K0501", message, processes[cycle[start]].label.span)


def _doubt_unread(specification: model.Specification, vocabulary: Vocabulary, reporter: Reporter) -> None:
    read = {str(term.label) for term in terms_of(specification)}
    for label, process in vocabulary.processes.items():
        if label not in read:
            hint = f"stream NAME = {label}; hands it to the host"
            reporter.warning("K0601", f"label {label!r} is read by no unit and no stream", process.label.span, hint)
