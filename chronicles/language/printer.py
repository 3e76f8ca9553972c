"""How is a chronicle tree written as text?

Reading the text again gives an equal tree. One construct has one form: one statement a line, two spaces of indent,
durations in the largest unit that divides them.
"""

import re
from collections.abc import Callable, Iterable
from typing import Any  # the table of printers maps each class to a function of exactly that class

from chronicles.language import model
from chronicles.language.syntax_errors import ACTION_WORDS, DECLARATION_WORDS, EXAMPLE_WORDS, STATEMENT_WORDS
from dyknow.language.durations import format_duration
from dyknow.language.words import quoted

_OTHER_WORDS = ("in", "value", "default", "symbol", "oo", "recognised", "recognized", "at")
_WORDS = frozenset((*DECLARATION_WORDS, *STATEMENT_WORDS, *ACTION_WORDS, *EXAMPLE_WORDS, *_OTHER_WORDS))
_PLAIN = re.compile(r"(?!t[0-9])[A-Za-z_][A-Za-z0-9_]*|-?[0-9]+(\.[0-9]+)?")


def print_file(file: model.ChronicleFile) -> str:
    """Write a whole text.

    Examples
    --------
    >>> from dyknow.language.diagnostics import Reporter
    >>> from chronicles.language.parser import parse
    >>> text = "chronicle a(t1){event(b[?x ,?],t1) t1<t2+1500ms}"
    >>> print(print_file(parse(text, "a", Reporter({"a": text}))))
    chronicle a(t1) {
      event(b[?x, ?], t1)
      t1 < t2 + 1500ms
    }
    <BLANKLINE>
    """
    return "".join(print_declaration(declaration) + "\n" for declaration in file.declarations)


def print_declaration(declaration: model.Declaration) -> str:
    """Write one declaration without a final newline."""
    return _PRINTERS[type(declaration)](declaration)


def print_statement(statement: model.Statement | model.Action) -> str:
    """Write one statement or action of a chronicle's body."""
    return _PRINTERS[type(statement)](statement)


def print_pattern(pattern: model.Pattern) -> str:
    """Write an event, or an attribute and its value."""
    values = _terms(pattern.values)
    behind = {0: "", 1: f":{values}", 2: f":({values})"}[len(pattern.values)]
    return f"{pattern.name}[{_terms(pattern.arguments)}]{behind}"


def print_term(term: model.Term) -> str:
    """Write a variable, a value or `?`."""
    if isinstance(term, model.Variable):
        return f"?{term.name}"
    if isinstance(term, model.Anything):
        return "?"
    if not term.quoted and _PLAIN.fullmatch(term.text) and term.text not in _WORDS:
        return term.text
    return quoted(term.text)


def print_domain(expression: model.DomainExpression) -> str:
    """Write a domain expression with the fewest parentheses."""
    match expression:
        case model.DomainValues(values):
            return "{" + _terms(values) + "}"
        case model.DomainRange(low, high):
            return f"[{low}..{high}]"
        case model.DomainSymbol():
            return "symbol"
        case model.DomainName(name):
            return name
        case model.DomainOperation(left, operator, right):
            written = print_domain(right)
            # The operators group to the left, so only a right operand needs parentheses.
            written = f"({written})" if isinstance(right, model.DomainOperation) else written
            return f"{print_domain(left)} {operator} {written}"


def _terms(terms: Iterable[model.Term]) -> str:
    return ", ".join(map(print_term, terms))


def print_bound(bound: model.Bound) -> str:
    """Write one end of a range of time differences."""
    length = "oo" if bound.duration is None else bound.duration.constant or format_duration(bound.duration.us)
    return ("-" if bound.negative else "") + length


def _offset(offset: model.Bound | None) -> str:
    if offset is None or offset.duration is None:
        return ""
    return f" {'-' if offset.negative else '+'} {print_bound(offset).removeprefix('-')}"


def _time(time: model.TimeExpression) -> str:
    return time.point.name + _offset(time.offset)


def _interval(interval: model.Interval) -> str:
    return f"({_time(interval.start)}, {_time(interval.end)})"


def _occurs(statement: model.OccursStatement) -> str:
    most = "oo" if statement.most is None else statement.most
    return f"occurs(({statement.least}, {most}), {print_pattern(statement.pattern)}, {_interval(statement.interval)})"


def _range(statement: model.Range) -> str:
    difference = f"{statement.later.name} - {statement.earlier.name}"
    low, high = print_bound(statement.low), print_bound(statement.high)
    if statement.chained:
        less, more = ("<" if statement.low_open else "<="), ("<" if statement.high_open else "<=")
        return f"{low} {less} {difference} {more} {high}"
    return f"{difference} in {']' if statement.low_open else '['}{low}, {high}{'[' if statement.high_open else ']'}"


def _emit(action: model.Emit) -> str:
    if action.time is None:
        return f"emit {print_pattern(action.pattern)}"
    return f"emit event({print_pattern(action.pattern)}, {_time(action.time)})"


def _select(statement: model.SelectStatement) -> str:
    return f"select {statement.kind}" + (f"({statement.anchor.name})" if statement.anchor is not None else "")


def _block(head: str, items: Iterable[str]) -> str:
    lines = [f"  {line}" for item in items for line in item.split("\n")]
    return "\n".join([f"{head} {{", *lines, "}"])


def _member(item: model.Membership) -> str:
    return f"?{item.variable.name} in {print_domain(item.domain)}"


def _attribute(declaration: model.Attribute) -> str:
    items = list(map(_member, declaration.domains))
    if declaration.value_domain is not None:
        items.append(f"value in {print_domain(declaration.value_domain)}")
    if declaration.default is not None:
        items.append(f"default {print_term(declaration.default)}")
    head = f"attribute {declaration.name}[{_terms(declaration.parameters)}]"
    return _block(head, items) if items else head


def _message(declaration: model.Message) -> str:
    head = f"message {declaration.name}[{_terms(declaration.parameters)}]"
    return _block(head, map(_member, declaration.domains)) if declaration.domains else head


def _constant(declaration: model.Constant) -> str:
    value = declaration.value
    written = format_duration(value.us) if isinstance(value, model.Duration) else print_term(value)
    return f"constant {declaration.name} = {written}"


def _chronicle(declaration: model.Chronicle) -> str:
    parameters = f"[{_terms(declaration.parameters)}]" if declaration.parameters else ""
    points = ", ".join(point.name for point in declaration.points)
    lines = [print_statement(statement) for statement in declaration.statements]
    # A constraint that starts with a sign would read as the offset of the line before.
    for index in range(1, len(lines)):
        if lines[index].startswith("-"):
            lines[index - 1] += ";"
    if declaration.actions:
        lines.append(_block("when recognised", (_PRINTERS[type(action)](action) for action in declaration.actions)))
    return _block(f"chronicle {declaration.name}{parameters}({points})", lines)


def _example(declaration: model.Example) -> str:
    lines = [f"{format_duration(one.t_us)} {print_pattern(one.pattern)}" for one in declaration.events]
    if declaration.until_us is not None:
        lines.append(f"until {format_duration(declaration.until_us)}")
    lines += map(_expectation, declaration.expected)
    return _block(f"example {quoted(declaration.title)}", lines)


def _expectation(one: model.ExpectedOccurrence) -> str:
    roles = ", ".join(map(_role, one.fillings))
    return f"expect {one.chronicle}[{roles}] {format_duration(one.start_us)}..{format_duration(one.end_us)}"


def _role(role: model.Role) -> str:
    is_plain = _PLAIN.fullmatch(role.name) and role.name not in _WORDS
    return f"{'' if is_plain else '?'}{role.name}={print_term(role.value)}"


_PRINTERS: dict[type, Callable[[Any], str]] = {
    model.TimeUnit: lambda unit: f"timeunit {format_duration(unit.us)}",
    model.Constant: _constant,
    model.Domain: lambda domain: f"domain {domain.name} = {print_domain(domain.expression)}",
    model.Attribute: _attribute,
    model.Message: _message,
    model.Chronicle: _chronicle,
    model.Example: _example,
    model.EventStatement: lambda one: f"event({print_pattern(one.pattern)}, {one.point.name})",
    model.NoEventStatement: lambda one: f"noevent({print_pattern(one.pattern)}, {_interval(one.interval)})",
    model.OccursStatement: _occurs,
    model.HoldStatement: lambda one: f"hold({print_pattern(one.pattern)}, {_interval(one.interval)})",
    model.AssertStatement: lambda one: f"assert({print_pattern(one.pattern)}, {_interval(one.interval)})",
    model.Comparison: lambda one: f"{one.left.name} {one.comparator} {one.right.name}{_offset(one.offset)}",
    model.Range: _range,
    model.Equality: lambda one: f"?{one.variable.name} {'==' if one.equal else '!='} {print_term(one.term)}",
    model.Allowance: lambda one: f"allow ?{one.left.name} == ?{one.right.name}",
    model.Membership: _member,
    model.SelectStatement: _select,
    model.ConfidenceStatement: lambda one: f"confidence >= {one.least:.6g}",
    model.Emit: _emit,
    model.Report: lambda one: f"report {quoted(one.text)}",
    model.AssertAction: lambda one: f"assert({print_pattern(one.pattern)}, {_time(one.time)})",
}
