"""Does a specification mean anything? Names, types, policies and the graph are checked without any host code."""

from dataclasses import dataclass
from graphlib import TopologicalSorter

from dyknow.errors import KplError
from dyknow.kpl import model
from dyknow.kpl.doubts import doubt
from dyknow.kpl.model import policies_of
from dyknow.kpl.parser import open_kpl
from dyknow.kpl.policies import check_policy
from dyknow.kpl.type_checks import check_declarations, check_process, check_term
from dyknow.kpl.vocabulary import Vocabulary
from dyknow.language.diagnostics import Diagnostic, Reporter
from dyknow.language.ways import inside_first

_LONGEST_CYCLE = 10  # labels that a message names


@dataclass(frozen=True, slots=True)
class Checked:
    """Hold a specification that means something.

    Attributes
    ----------
    vocabulary : its declarations by name.
    processes : its processes, inputs before what reads them, configurations last.
    warnings : what is allowed but probably not meant.
    """

    specification: model.Specification
    vocabulary: Vocabulary
    processes: tuple[model.Process, ...]
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
    dyknow.errors.KplError: error[K0202]: expected a declared source, got 'gsp'
     --> kpl:1:33
      |
    1 | source float gps; strmgen pos = gsp; stream seen = pos;
      |                                 ^^^
      = help: did you mean 'gps'?
    """
    specification, doubtful, reporter = open_kpl(text, name)
    vocabulary = Vocabulary(specification, reporter, doubtful)
    check_declarations(specification, vocabulary)
    for statement in specification.statements:
        if isinstance(statement, model.Process):
            check_process(statement, vocabulary)
        elif isinstance(statement, model.StreamDeclaration):
            check_term(statement.term, vocabulary)
    for constraints in policies_of(specification):
        check_policy(constraints, reporter)
    processes = _inputs_first(vocabulary, reporter)
    reporter.raise_if_any(KplError)
    doubt(specification, vocabulary, reporter)
    return Checked(specification, vocabulary, processes, reporter.warnings)


def _inputs_first(vocabulary: Vocabulary, reporter: Reporter) -> tuple[model.Process, ...]:
    """Sort the processes so that each comes after what it reads; report every cycle.

    Configurations come last: nobody reads them, and what they create at once may read everything else.
    """
    processes = vocabulary.processes
    inputs = {  # lists without repetition, not sets: the order of creation must not depend on hashes
        label: [one for one in dict.fromkeys(str(term.label) for term in process.inputs) if one in processes]
        for label, process in processes.items()
    }
    _, circles = inside_first(inputs)
    place = {label: index for index, label in enumerate(inputs)}
    for circle in circles:
        cycle = circle[::-1]  # each is read by the next
        start = cycle.index(min(cycle, key=place.__getitem__))
        first, *others = cycle[start:] + cycle[:start]
        others = others if len(cycle) <= _LONGEST_CYCLE else [*others[: _LONGEST_CYCLE - 2], "..."]
        path = " -> ".join([first, *others, first])
        message = f"expected a label that does not read itself, got the cycle {path}"
        reporter.error("K0501", message, processes[first].label.span)
    if circles:
        return ()
    return (*(processes[label] for label in TopologicalSorter(inputs).static_order()), *vocabulary.configures.values())
