"""What is wrong or doubtful in chronicle texts, as this pipeline would run them?"""

from collections.abc import Sequence
from dataclasses import dataclass

from chronicles.chronicle_set import check_texts
from chronicles.language import model
from chronicles.language.diagnostics import Diagnostic, Reporter
from chronicles.language.parser import parse
from qsr.relations import RANK
from service.chronicle_files import with_relations


@dataclass(frozen=True, slots=True)
class Checked:
    """Hold what was found in some texts.

    Attributes
    ----------
    findings : errors and warnings, in the order of the texts.
    empty : names of the texts that can be read and hold no chronicle.
    """

    findings: tuple[Diagnostic, ...]
    empty: tuple[str, ...]

    @property
    def errors(self) -> int:
        """Return how many findings are errors."""
        return sum(one.severity == "error" for one in self.findings)


def check_chronicles(texts: Sequence[tuple[str, str]]) -> Checked:
    """Check texts (name, text) in one name space, with the relations that the pipeline produces.

    Examples
    --------
    >>> checked = check_chronicles([("mine", "chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")])
    >>> checked.errors, checked.empty
    (0, ())
    >>> check_chronicles([("mine", "message met[?a, ?b]")]).empty
    ('mine',)
    """
    names = {name for name, _ in texts}
    found = check_texts(with_relations(texts), frozenset(RANK))
    # Doubts about the relations' own file are not for the user, who has not written it.
    findings = tuple(one for one in found if one.severity == "error" or one.file in names)
    return Checked(findings, tuple(name for name, text in texts if _is_empty(name, text)))


def _is_empty(name: str, text: str) -> bool:
    reporter = Reporter({name: text})
    declarations = parse(text, name, reporter).declarations
    return not reporter.errors and not any(isinstance(one, model.Chronicle) for one in declarations)
