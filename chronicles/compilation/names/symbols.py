"""Which names do the declarations of some texts introduce, and what do they stand for?

All texts share one name space. The same declaration may stand in several texts; a different one under the same name
is a clash.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from chronicles.compilation.names.domains import ANY_VALUE, ValueSet, one_of
from chronicles.language import model
from chronicles.language.printer import print_domain, print_term
from chronicles.language.syntax_errors import INFINITIES
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.durations import LARGEST_US, LONGEST_NUMBER
from dyknow.language.places import Span
from dyknow.language.ways import inside_first

# Every attribute has this value while nothing is known about it, whatever its domain.
UNKNOWN = "unknown"
_LARGEST_RANGE = 100_000


@dataclass(frozen=True, slots=True)
class Field:
    """An argument or the value of an attribute: `sort` names its domain ("" if none is declared)."""

    sort: str
    values: ValueSet


UNDECLARED_FIELD = Field("", ANY_VALUE)


@dataclass(frozen=True, slots=True)
class Signature:
    """An attribute (with a value field) or a message (value None) and the fields of its arguments."""

    name: str
    arguments: tuple[Field, ...]
    value: Field | None
    default: str


_Kind = TypeVar("_Kind", bound=model.Named)


@dataclass(frozen=True, slots=True)
class Symbols:
    """The name space of some texts. `timeunits` gives the microseconds of a bare number, by text."""

    constants: Mapping[str, model.Constant]
    domains: Mapping[str, ValueSet]
    signatures: Mapping[str, Signature]
    timeunits: Mapping[str, int]

    @property
    def is_open(self) -> bool:
        """Whether events need no declaration: true when no text declares an attribute or a message."""
        return not self.signatures

    def value_of(self, literal: model.Literal, reporter: Reporter) -> str:
        """Replace the name of a constant by its value."""
        constant = None if literal.quoted else self.constants.get(literal.text)
        if constant is None:
            return literal.text
        if isinstance(constant.value, model.Duration):
            message = f"expected a value, got the constant {literal.text!r}, which is a duration"
            quoted = f'"{literal.text}"'
            reporter.error("C0305", message, literal.span, Hint(f"as a value it needs quotes: {quoted}", quoted))
            return literal.text
        return constant.value.text

    def duration_of(self, duration: model.Duration, reporter: Reporter) -> int:
        """Give a duration in microseconds, looking up a constant's name; 0 if that counts an error."""
        if not duration.constant:
            return self._read_us(duration, reporter)
        constant = self.constants.get(duration.constant)
        value = None if constant is None else constant.value
        if isinstance(value, model.Duration):
            return self._read_us(value, reporter)
        if value is not None and value.is_whole_number:
            return self._counted_us(duration, value.text, reporter)
        if value is None:
            message = f"expected a duration or a constant, got the unknown name {duration.constant!r}"
            hint = suggest(duration.constant, list(self.constants))
            if duration.constant.lower() in INFINITIES:
                hint = Hint("no bound is written oo", "oo")
            reporter.error("C0204", message, duration.span, hint)
        else:
            message = f"expected a duration, got the constant {duration.constant!r}, which is {value.text!r}"
            hint = Hint(f"write constant {duration.constant} = 5s, or the duration itself")
            reporter.error("C0305", message, duration.span, hint)
        return 0

    def _read_us(self, duration: model.Duration, reporter: Reporter) -> int:
        if duration.is_read:
            return duration.us
        reporter.count_again()
        return 0

    def _counted_us(self, duration: model.Duration, digits: str, reporter: Reporter) -> int:
        """Give how long so many units of the text that uses a constant are."""
        unit_us = self.timeunits.get(duration.span.file, 0 if digits.strip("0") == "" else None)
        if unit_us is None:
            message = f"expected a duration with a unit of time, got {duration.constant!r}, which is {digits!r}"
            hint = f"write constant {duration.constant} = {digits}s, or say what numbers count: timeunit 1s"
            reporter.error("C0106", message, duration.span, hint)
            return 0
        if unit_us == model.UNREAD_US:
            reporter.count_again()
            return 0
        if len(digits) <= LONGEST_NUMBER and (us := int(digits) * unit_us) <= LARGEST_US:
            return us
        message = f"expected at most 35 years, got {duration.constant!r}, which counts more times {unit_us} us"
        reporter.error("C0105", message, duration.span, f"write constant {duration.constant} = 5s")
        return 0


def collect_symbols(files: Collection[model.ChronicleFile], reporter: Reporter) -> Symbols:
    """Read all declarations but the chronicles; clashes and unknown domains go to the reporter."""
    declarations = [declaration for file in files for declaration in file.declarations]
    constants = _unique([one for one in declarations if isinstance(one, model.Constant)], reporter)
    domains = _unique([one for one in declarations if isinstance(one, model.Domain)], reporter)
    events = _unique([one for one in declarations if isinstance(one, model.Attribute | model.Message)], reporter)
    timeunits = {one.span.file: one.us for one in declarations if isinstance(one, model.TimeUnit)}
    nameless = Symbols(constants, {}, {}, timeunits)
    before = reporter.error_count
    sets = _resolved(domains, nameless, reporter)
    if reporter.error_count == before:
        for name, values in sets.items():
            _warn_empty(domains[name].expression, values, reporter)
    resolver = _Resolver(nameless, sets, reporter)
    signatures = {name: resolver.signature(declaration) for name, declaration in events.items()}
    symbols = Symbols(constants, sets, signatures, timeunits)
    if symbols.is_open:
        warn_arities(files, reporter)
    return symbols


def _warn_empty(expression: model.DomainExpression, values: ValueSet, reporter: Reporter) -> None:
    if values.is_empty and not isinstance(expression, model.DomainName):
        message = f"expected a domain with a value, got {print_domain(expression)}, which has none"
        reporter.warning("C0309", message, expression.span, "nothing but unknown fits it")


def _unique(declarations: Iterable[_Kind], reporter: Reporter) -> dict[str, _Kind]:
    found: dict[str, _Kind] = {}
    for declaration in declarations:
        first = found.setdefault(declaration.name, declaration)
        if first != declaration:
            place = f"{first.name_span.file}:{first.name_span.line}"
            message = f"expected one declaration of {declaration.name!r}, got another one than at {place}"
            hint, related = "choose another name, or make them equal", [(first.name_span, "the first")]
            reporter.error("C0203", message, declaration.name_span, hint, related=related)
    return found


def _resolved(domains: Mapping[str, model.Domain], symbols: Symbols, reporter: Reporter) -> dict[str, ValueSet]:
    """Give the values of each declared domain; one that is made of itself is an error."""
    mentioned = {name: _names_in(domain.expression) for name, domain in domains.items()}
    ordered, circles = inside_first(
        {name: [one for one in found if one in domains] for name, found in mentioned.items()}
    )
    for names in circles:
        path = " -> ".join([*names, names[0]])
        message = f"expected a domain made of others, got one made of itself: {path}"
        reporter.error("C0205", message, domains[names[0]].name_span, "list the values of one of them")
    # One that is asked for before it is there is part of a circle.
    sets = dict.fromkeys(domains, ANY_VALUE)
    for name in ordered:
        sets[name] = resolve_domain(domains[name].expression, sets, symbols, reporter)
    return sets


class _Resolver:
    """Looks up what the fields of declarations are; `sets` has the values of each declared domain."""

    def __init__(self, symbols: Symbols, sets: Mapping[str, ValueSet], reporter: Reporter) -> None:
        self._symbols = symbols
        self._sets = sets
        self._reporter = reporter

    def signature(self, declaration: model.Attribute | model.Message) -> Signature:
        """Resolve the domains of an event, and check its default against them."""
        names = [parameter.name for parameter in declaration.parameters]
        self._check_parameters(declaration, names)
        by_name = {item.variable.name: item.domain for item in declaration.domains}
        arguments = tuple(self._field(by_name.get(name)) for name in names)
        if isinstance(declaration, model.Message):
            return Signature(declaration.name, arguments, None, UNKNOWN)
        value = self._field(declaration.value_domain)
        default = UNKNOWN
        if declaration.default is not None:
            default = self._symbols.value_of(declaration.default, self._reporter)
            check_value(default, value, declaration.default.span, self._reporter)
        return Signature(declaration.name, arguments, value, default)

    def _check_parameters(self, declaration: model.Attribute | model.Message, names: list[str]) -> None:
        for index, parameter in enumerate(declaration.parameters):
            if parameter.name in names[:index]:
                message = f"expected parameters that differ, got ?{parameter.name} twice"
                self._reporter.error("C0203", message, parameter.span, "choose another name")
        for item in declaration.domains:
            if item.variable.name not in names:
                message = f"expected a parameter of {declaration.name!r}, got ?{item.variable.name}"
                hint = suggest(f"?{item.variable.name}", [f"?{name}" for name in names])
                self._reporter.error("C0205", message, item.variable.span, hint)

    def _field(self, expression: model.DomainExpression | None) -> Field:
        if expression is None:
            return UNDECLARED_FIELD
        values = resolve_domain(expression, self._sets, self._symbols, self._reporter)
        _warn_empty(expression, values, self._reporter)
        return Field(print_domain(expression), values)


def _names_in(expression: model.DomainExpression) -> Iterator[str]:
    """Give the names of the domains that an expression mentions."""
    if isinstance(expression, model.DomainName):
        yield expression.name
    elif isinstance(expression, model.DomainOperation):
        yield from _names_in(expression.left)
        yield from _names_in(expression.right)


def resolve_domain(
    expression: model.DomainExpression, known: Mapping[str, ValueSet], symbols: Symbols, reporter: Reporter
) -> ValueSet:
    """Give the values that an expression over `known` domains allows; anything where that counts an error."""
    match expression:
        case model.DomainValues(values):
            return one_of(*(symbols.value_of(value, reporter) for value in values))
        case model.DomainRange(low, high):
            if not 0 <= high - low < _LARGEST_RANGE:
                message = f"expected a range of 1 to {_LARGEST_RANGE} numbers, got [{low}..{high}]"
                swapped = Hint("the smaller number comes first", f"[{high}..{low}]") if high < low else ""
                reporter.error("C0401", message, expression.span, swapped)
                return ANY_VALUE
            return one_of(*map(str, range(low, high + 1)))
        case model.DomainSymbol():
            return ANY_VALUE
        case model.DomainName(name):
            if name not in known:
                message = f"expected a domain, got the unknown name {name!r}"
                reporter.error("C0202", message, expression.span, suggest(name, list(known)))
            return known.get(name, ANY_VALUE)
        case model.DomainOperation(left, operator, right):
            first = resolve_domain(left, known, symbols, reporter)
            second = resolve_domain(right, known, symbols, reporter)
            return first.union(second) if operator == "|" else first.difference(second)


def check_value(text: str, field: Field, span: Span, reporter: Reporter) -> None:
    """Report a value outside its declared domain; `unknown` is always allowed."""
    if text != UNKNOWN and text not in field.values:
        known = [] if field.values.complement else sorted(field.values.texts)
        named = print_term(model.Literal(text, False, span=span))
        hint = suggest(text, known)
        if hint.edit is not None:
            hint = hint._replace(edit=print_term(model.Literal(hint.edit, False, span=span)))
        reporter.error("C0303", f"expected a value of {field.sort}, got {named}", span, hint)


def warn_arities(files: Iterable[model.ChronicleFile], reporter: Reporter) -> None:
    """Warn about names that stand with different numbers of arguments: an event has one number, so one is a slip.

    Parameters
    ----------
    files : texts that declare neither messages nor attributes.
    reporter : receives a warning for the first place of each further number of arguments.
    """
    first: dict[str, model.Pattern] = {}
    warned: set[tuple[str, int]] = set()
    for one in (named for file in files for declaration in file.declarations for named in _patterns(declaration)):
        known, count = first.setdefault(one.name, one), len(one.arguments)
        if count != len(known.arguments) and (one.name, count) not in warned:
            warned.add((one.name, count))
            wanted = arguments_text(len(known.arguments))
            message = f"expected {wanted} for {one.name!r} as in line {known.span.line}"
            hint = "an event fits only a pattern with as many arguments as it has; ? stands for anything"
            related = [(known.span, f"{wanted} here")]
            reporter.warning("C0308", f"{message}, got {count}", one.span, hint, related=related)


def arguments_text(count: int) -> str:
    """Write a number of arguments."""
    return "1 argument" if count == 1 else f"{count} arguments"


def _patterns(declaration: model.Declaration) -> Sequence[model.Pattern]:
    match declaration:
        case model.Example():
            return [event.pattern for event in declaration.events]
        case model.Chronicle():
            return declaration.looked_at + declaration.given
        case _:
            return ()
