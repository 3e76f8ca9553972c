"""Which messages do monitors give to chronicles, and do chronicles look at them as they are?

One rule for processing, recognising again and checking: each monitor gives ``NAME_violated`` and ``NAME_satisfied``,
with the objects of its variables as arguments and without values. What asks for another shape would never match.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import get_args

from chronicles.language import model
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Diagnostic, Reporter
from dyknow.mtl.formula import Monitor
from dyknow.mtl.monitors import Outcome
from dyknow.mtl.parser import parse_monitors
from service.records.runs import RunRecord

Messages = Mapping[str, int]

NO_MESSAGES: Messages = {}


def messages_of(monitors: Iterable[Monitor]) -> Messages:
    """Give the messages of monitors, each with its number of arguments.

    Examples
    --------
    >>> messages_of(parse_monitors("monitor careful per Car: always speed[?c] < 50 km/h"))
    {'careful_violated': 1, 'careful_satisfied': 1}
    """
    return {f"{one.name}_{outcome}": len(one.subjects) for one in monitors for outcome in get_args(Outcome)}


def messages_of_run(run: RunRecord) -> Messages:
    """Give the messages of the monitors that were run with a run."""
    return messages_of(monitor for one in run.monitors for monitor in parse_monitors(one.text, name=one.name))


def misuses(texts: Sequence[tuple[str, str]], messages: Messages) -> tuple[Diagnostic, ...]:
    """Give the places where chronicles look at a monitor's message in another shape than it has.

    Examples
    --------
    >>> text = "chronicle late[?a, ?b](t1) { event(careful_violated[?a, ?b], t1) }"
    >>> [(one.code, one.column, one.message) for one in misuses([("a", text)], {"careful_violated": 1})]
    [('C0301', 36, "expected 1 argument of 'careful_violated', as its monitor has, got 2")]
    """
    if not messages:
        return ()
    reporter = Reporter(dict(texts))
    unread = Reporter(dict(texts))  # what is no chronicle is told by the compiler
    for name, text in texts:
        for declaration in parse(text, name, unread).declarations:
            if isinstance(declaration, model.Chronicle):
                for used in declaration.looked_at:
                    _check_use(used, messages, reporter)
    return reporter.diagnostics


def _check_use(used: model.Pattern, messages: Messages, reporter: Reporter) -> None:
    expected = messages.get(used.name)
    if expected is None:
        return
    if len(used.arguments) != expected:
        arguments = "1 argument" if expected == 1 else f"{expected} arguments"
        message = f"expected {arguments} of {used.name!r}, as its monitor has, got {len(used.arguments)}"
        reporter.error("C0301", message, used.name_span)
    elif used.values:
        message = f"expected {used.name!r} without values, as its monitor gives it, got one with values"
        reporter.error("C0302", message, used.name_span)
