"""What is wrong or doubtful in chronicle texts, as this pipeline would run them?"""

from collections.abc import Sequence
from dataclasses import dataclass

from chronicles.chronicle_set import check_texts
from chronicles.language import model
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Diagnostic, Reporter
from qsr.relations import RANK
from service.monitoring.monitor_messages import NO_MESSAGES, Messages, misuses
from service.texts.chronicle_files import with_relations
from service.texts.text_streams import Stream, stream_of


@dataclass(frozen=True, slots=True)
class Checked:
    """Hold what was found in some texts.

    Attributes
    ----------
    findings : errors and warnings, in the order of the texts.
    empty : names of the texts that can be read and hold no chronicle.
    stream : what the texts were taken to be about.
    """

    findings: tuple[Diagnostic, ...]
    empty: tuple[str, ...]
    stream: Stream

    @property
    def errors(self) -> int:
        """Return how many findings are errors."""
        return sum(one.severity == "error" for one in self.findings)


def check_chronicles(
    texts: Sequence[tuple[str, str]], stream: Stream | None = None, messages: Messages = NO_MESSAGES
) -> Checked:
    """Check texts (name, text) in one name space.

    Parameters
    ----------
    stream : "traffic" checks them with the relations that the pipeline produces, "own" with what they declare alone;
        None leaves it to the texts.
    messages : of the monitors that are to run with them.

    Examples
    --------
    >>> checked = check_chronicles([("mine", "chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")])
    >>> checked.errors, checked.empty, checked.stream
    (0, (), 'traffic')
    >>> check_chronicles([("mine", "message met[?a, ?b]")]).empty
    ('mine',)
    """
    stream = stream or stream_of(texts)
    names = {name for name, _ in texts}
    found = check_texts(with_relations(texts, stream), {*RANK, *messages} if stream == "traffic" else None)
    unknown = {_place(one) for one in found if one.code == "C0201"}
    findings = tuple(
        one
        for one in found
        # Doubts about the relations' own file are not for the user, who has not written it; and of a name that nobody
        # declares it goes without saying that nobody gives it.
        if (one.severity == "error" or one.file in names) and not (one.code == "C0901" and _place(one) in unknown)
    )
    if not any(one.severity == "error" for one in findings):  # as where a run is refused
        findings += misuses(texts, messages)
    return Checked(findings, tuple(name for name, text in texts if _is_empty(name, text)), stream)


def _place(one: Diagnostic) -> tuple[str, int, int]:
    return one.file, one.line, one.column


def _is_empty(name: str, text: str) -> bool:
    reporter = Reporter({name: text})
    declarations = parse(text, name, reporter).declarations
    return not reporter.errors and not any(isinstance(one, model.Chronicle) for one in declarations)
