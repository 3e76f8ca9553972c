"""How does a chronicle become a plan?

Patterns are looked up, variables sorted into classes, time points into a minimal network; then `assembly.py` numbers
everything in an order that does not depend on the text. What is wrong goes to the reporter.
"""

import re
from dataclasses import replace

from chronicles.compilation.assembly import Assembly, Resolved
from chronicles.compilation.names.patterns import PatternResolver
from chronicles.compilation.names.symbols import Symbols
from chronicles.compilation.names.usage import VARIABLE
from chronicles.compilation.names.variables import Variables, resolve_variables
from chronicles.compilation.plan import Plan
from chronicles.compilation.times.timing import resolve_timing
from chronicles.language import model
from chronicles.language.printer import print_statement
from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.places import Span


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
    before = reporter.error_count
    # Where statements are missing, only what each of the others says by itself can be judged.
    is_whole = not reporter.has_syntax_error_in(chronicle.span)
    _check_head(chronicle, reporter)
    resolved = _resolve(chronicle, symbols, reporter)
    if not is_whole:
        return None
    binding = [cells for _, cells in (*resolved.events, *resolved.holds)]
    testing = [cells for _, cells in (*resolved.counts, *resolved.asserts)]
    variables = resolve_variables(chronicle, binding, testing, symbols, reporter)
    if not resolved.events:
        message = f"expected at least one event in chronicle {chronicle.name!r}, got none"
        reporter.error("C0802", message, chronicle.name_span, "add event(name[...], t1)")
        return None
    _check_changes(resolved, variables, reporter)
    _check_bound(resolved, variables, reporter)
    _check_asserts(resolved, variables, reporter)
    _check_ranges(resolved, reporter)
    _warn_reports(resolved, variables, reporter)
    _check_selection(resolved, reporter)
    timing = resolve_timing(chronicle, symbols, reporter)
    if timing is None or reporter.error_count > before:
        return None
    plan = Assembly(resolved, variables, timing, symbols, reporter).plan(version)
    return plan if reporter.error_count == before else None


def _check_head(chronicle: model.Chronicle, reporter: Reporter) -> None:
    """A role or a time point stands in the head once."""
    first: dict[str, Span] = {}
    roles = [(f"?{one.name}", one.span) for one in chronicle.parameters]
    for name, span in [*roles, *((one.name, one.span) for one in chronicle.points)]:
        if first.setdefault(name, span) != span:
            message = f"expected each name once in the head of {chronicle.name!r}, got {name} twice"
            reporter.error("C0203", message, span, "keep one of them", related=[(first[name], "the first")])


def _resolve(chronicle: model.Chronicle, symbols: Symbols, reporter: Reporter) -> Resolved:
    resolver = PatternResolver(symbols, reporter)
    events = [(one, resolver.cells(one.pattern)) for one in chronicle.of(model.EventStatement)]
    counts = [(one, resolver.cells(one.pattern)) for one in chronicle.of(model.CountStatement)]
    holds = [(one, resolver.cells(one.pattern)) for one in chronicle.of(model.HoldStatement)]
    asserts = [(one, resolver.cells(one.pattern)) for one in chronicle.of(model.AssertStatement)]
    emits = [(one, resolver.cells(one.pattern)) for one in chronicle.actions if not isinstance(one, model.Report)]
    selections = chronicle.of(model.SelectStatement)
    for word, found in (("select", selections), ("confidence", chronicle.of(model.ConfidenceStatement))):
        for second in found[1:]:
            message = f"expected one {word} in chronicle {chronicle.name!r}, got another one than in line"
            reporter.error("C0203", f"{message} {found[0].span.line}", second.span, "keep one of them")
    return Resolved(chronicle, events, counts, holds, asserts, emits, selections[0] if selections else None)


def _check_changes(resolved: Resolved, variables: Variables, reporter: Reporter) -> None:
    """The old and the new value of a change cannot be one variable, or two made equal."""
    patterns = [cells for _, cells in (*resolved.events, *resolved.counts, *resolved.emits) if len(cells.values) == 2]
    for old, new in (cells.values for cells in patterns):
        is_free = bool(old.variable or new.variable)  # two values of the text were compared where they were looked up
        is_known = {old.variable, new.variable} - {""} <= variables.class_of.keys()
        if is_free and is_known and variables.content(old) == variables.content(new):
            came = " and ".join(dict.fromkeys(f"?{one.variable}" for one in (old, new) if one.variable))
            came = f"{came} for both" if old.variable == new.variable else f"{came}, which are equal by '=='"
            message = f"expected a change between two values, got {came}"
            reporter.error("C0306", message, new.span, "the two differ; one of them may be ?, or another variable")


def _check_bound(resolved: Resolved, variables: Variables, reporter: Reporter) -> None:
    """Every variable of the header and of an action must get a value from an event or a hold."""
    known = _known_names(resolved, variables)

    def check(name: str, span: Span, code: str) -> None:
        """Report a variable that no event and no hold gives a value."""
        if name not in known:
            message = f"expected ?{name} to get its value from an event or a hold, got no such statement"
            reporter.error(code, message, span, suggest(f"?{name}", [f"?{one}" for one in known]))

    for parameter in resolved.chronicle.parameters:
        check(parameter.name, parameter.span, "C0801")
    for one, cells in resolved.emits:
        where = "an emitted event" if isinstance(one, model.Emit) else "an assert"
        for cell in cells.all:
            if cell.variable:
                check(cell.variable, cell.span, "C0804")
            elif cell.constant is None:
                message = f"expected a variable or a value in {where}, got '?'"
                reporter.error("C0804", message, cell.span, "write a variable of an event or hold, or a value")


def _check_asserts(resolved: Resolved, variables: Variables, reporter: Reporter) -> None:
    """An assert passes where nothing is known, so it can give no variable a value and looks for none."""
    known = [f"?{name}" for name, root in variables.class_of.items() if root in variables.bound]
    for cell in (cell for _, cells in resolved.asserts for cell in cells.all):
        if cell.variable and variables.class_of[cell.variable] not in variables.bound:
            message = f"expected ?{cell.variable} to get its value from an event or a hold, got only an assert"
            reporter.error("C0805", message, cell.span, suggest(f"?{cell.variable}", known))
        elif not cell.variable and cell.constant is None:
            message = "expected a variable or a value in an assert, got '?'"
            reporter.error("C0805", message, cell.span, "nothing contradicts an assert about anything")


def _check_ranges(resolved: Resolved, reporter: Reporter) -> None:
    for one, _ in resolved.counts:
        if one.most is not None and one.least > one.most:
            message = f"expected a number of events between two bounds, got {one.least} to {one.most}"
            reporter.error("C0401", message, one.span, "the smaller number comes first")
        elif (one.least, one.most) == (0, None):
            message = "expected a number of events with a bound, got 0 to oo, which every number is"
            reporter.warning("C0603", message, one.span, "leave it out, or give a bound")


def _warn_reports(resolved: Resolved, variables: Variables, reporter: Reporter) -> None:
    """What looks like a variable in a report and has no value stays as it is written."""
    known = _known_names(resolved, variables)
    for one in resolved.chronicle.actions:
        if isinstance(one, model.Report):
            for name in dict.fromkeys(VARIABLE.findall(one.text)):
                if name not in known:
                    message = f"expected variables with a value in a report, got ?{name}"
                    hint = suggest(f"?{name}", [f"?{other}" for other in known])
                    if hint.edit is not None:
                        text = re.sub(rf"\?{name}\b", hint.edit, one.text)
                        hint = hint._replace(edit=print_statement(replace(one, text=text)))
                    reporter.warning("C0807", message, one.span, hint)


def _check_selection(resolved: Resolved, reporter: Reporter) -> None:
    """The anchor of a selection must be the time point of exactly one event."""
    anchor = None if resolved.selection is None else resolved.selection.anchor
    if anchor is None:
        return
    points = [one.point.name for one, _ in resolved.events]
    if anchor.name not in points:
        message = f"expected the time point of an event, got {anchor.name}"
        reporter.error("C0408", message, anchor.span, suggest(anchor.name, sorted(set(points))))
    elif points.count(anchor.name) > 1:
        message = f"expected the time point of one event, got {anchor.name}, which {points.count(anchor.name)} share"
        new = f"{anchor.name}b"
        hint = f"give one of them a time point of its own, such as {new}, and add {new} = {anchor.name}"
        reporter.error("C0408", message, anchor.span, hint)


def _known_names(resolved: Resolved, variables: Variables) -> list[str]:
    known = variables.bound | variables.constants.keys()
    return sorted(name for name, root in variables.class_of.items() if root in known)
