"""How does a chronicle become a plan?

Patterns are looked up, variables sorted into classes, time points into a minimal network; then `assembly.py` numbers
everything in an order that does not depend on the text. What is wrong goes to the reporter.
"""

from __future__ import annotations

from chronicles.compilation.assembly import Assembly, Resolved
from chronicles.compilation.patterns import PatternResolver
from chronicles.compilation.plan import Plan
from chronicles.compilation.symbols import Symbols
from chronicles.compilation.timing import resolve_timing
from chronicles.compilation.variables import Variables, resolve_variables
from chronicles.language import model
from chronicles.language.diagnostics import Reporter, Span, suggest

_NOT_YET = {model.OccursStatement: "occurs", model.AssertStatement: "assert", model.AssertAction: "assert"}


def compile_chronicle(chronicle: model.Chronicle, symbols: Symbols, version: str, reporter: Reporter) -> Plan | None:
    """Make the plan of a chronicle.

    Parameters
    ----------
    chronicle : as parsed.
    symbols : the name space of its texts.
    version : digest of its canonical text.
    reporter : receives errors and warnings.

    Returns
    -------
    None if an error was reported for this chronicle.
    """
    before = len(reporter.errors)
    # Where statements are missing, only what each of the others says by itself can be judged.
    is_whole = not reporter.has_syntax_error_in(chronicle.span)
    _report_unsupported(chronicle, reporter)
    resolved = _resolve(chronicle, symbols, reporter)
    if not is_whole:
        return None
    variables = resolve_variables(chronicle, resolved.binding, resolved.forbidding, symbols, reporter)
    if not resolved.events:
        message = f"expected at least one event in chronicle {chronicle.name!r}, got none"
        reporter.error("C0802", message, chronicle.name_span)
        return None
    _check_bound(resolved, variables, reporter)
    timing = resolve_timing(chronicle, symbols, reporter)
    if timing is None or len(reporter.errors) > before:
        return None
    plan = Assembly(resolved, variables, timing, symbols, reporter).plan(version)
    return plan if len(reporter.errors) == before else None


def _report_unsupported(chronicle: model.Chronicle, reporter: Reporter) -> None:
    for one in (*chronicle.statements, *chronicle.actions):
        word = _NOT_YET.get(type(one))
        if word is not None:
            message = f"expected event, noevent, hold, emit, report or a constraint, got {word!r}"
            reporter.error("C0106", message, one.span, f"{word!r} is part of the language but not recognised yet")


def _resolve(chronicle: model.Chronicle, symbols: Symbols, reporter: Reporter) -> Resolved:
    resolver = PatternResolver(symbols, reporter)
    events = [one for one in chronicle.statements if isinstance(one, model.EventStatement)]
    absences = [one for one in chronicle.statements if isinstance(one, model.NoEventStatement)]
    holds = [one for one in chronicle.statements if isinstance(one, model.HoldStatement)]
    emits = [one for one in chronicle.actions if isinstance(one, model.Emit)]
    return Resolved(
        chronicle,
        tuple((one, resolver.event(one.pattern)) for one in events),
        tuple((one, resolver.event(one.pattern)) for one in absences),
        tuple((one, resolver.fluent(one.fluent)) for one in holds),
        tuple((one, resolver.event(one.pattern)) for one in emits),
    )


def _check_bound(resolved: Resolved, variables: Variables, reporter: Reporter) -> None:
    """Every variable of the header and of an emitted event must get a value from an event or a hold."""
    known = _known_names(resolved, variables)

    def check(name: str, span: Span, code: str) -> None:
        """Report a variable that no event and no hold gives a value."""
        if name not in known:
            message = f"expected ?{name} to get its value from an event or a hold, got no such statement"
            reporter.error(code, message, span, suggest(f"?{name}", [f"?{one}" for one in known]))

    for parameter in resolved.chronicle.parameters:
        check(parameter.name, parameter.span, "C0801")
    for cell in (cell for _, cells in resolved.emits for cell in cells.all):
        if cell.variable:
            check(cell.variable, cell.span, "C0804")
        elif cell.constant is None:
            reporter.error("C0804", "expected a variable or a value in an emitted event, got '?'", cell.span)


def _known_names(resolved: Resolved, variables: Variables) -> list[str]:
    known = variables.bound | variables.constants.keys()
    return sorted(name for name, root in variables.class_of.items() if root in known)
