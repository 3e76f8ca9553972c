"""How is a formula written? So that reading it again gives the same formula."""

import re
from collections.abc import Iterable
from decimal import Decimal

from dyknow.language.durations import format_duration
from dyknow.language.words import quoted
from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Term

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_OPERATOR_WORDS = ("not", "and", "or", "implies", "iff", "until", "always", "eventually", "next", "tolerate")
_WORDS = frozenset((*_OPERATOR_WORDS, "true", "false", "forall", "exists", "in", "monitor", "per", "oo"))
# How tightly an operator holds its parts; a part that holds less tightly gets parentheses.
_IFF, _IMPLIES, _OR, _AND, _UNTIL, _UNARY, _ATOM = range(7)


def print_formula(formula: Formula) -> str:
    """Write a formula in the language, on one line, with no more parentheses than it needs.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> print_formula(parse_formula("(not p -> eventually[0s,60s]((q)))"))
    'not p implies eventually[0s, 1min] q'
    """
    return _written(formula)[0]


def print_monitors(monitors: Iterable[model.Monitor]) -> str:
    """Write monitors, one a line.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> print_monitors(parse_monitors("monitor calm per Car: always speed[?c] <50km/h"))
    'monitor calm per ?c in Car: always speed[?c] < 50 km/h\\n'
    """
    return "".join(map(_monitor, monitors))


def _monitor(monitor: model.Monitor) -> str:
    subjects = ", ".join(f"?{one.variable.name} in {one.sort}" for one in monitor.subjects)
    return f"monitor {monitor.name}{' per ' if subjects else ''}{subjects}: {print_formula(monitor.formula)}\n"


def _written(formula: Formula) -> tuple[str, int]:  # noqa: PLR0911, PLR0912 - one case per kind of formula
    match formula:
        case model.Truth(value):
            return ("true" if value else "false"), _ATOM
        case model.Proposition(feature):
            return print_term(feature), _ATOM
        case model.Comparison(left, comparator, right):
            return f"{print_term(left)} {comparator} {print_term(right)}", _ATOM
        case model.Not(body):
            return f"not {_inside(body, _UNARY)}", _UNARY
        case model.And(parts):
            return _chain(" and ", parts, _UNTIL), _AND
        case model.Or(parts):
            return _chain(" or ", parts, _AND), _OR
        case model.Implies(left, right):
            return f"{_inside(left, _OR)} implies {_inside(right, _IMPLIES)}", _IMPLIES
        case model.Iff(left, right):
            return f"{_inside(left, _IMPLIES)} iff {_inside(right, _IMPLIES)}", _IFF
        case model.Until(left, right, window):
            return f"{_inside(left, _UNARY)} until{_window(window)} {_inside(right, _UNTIL)}", _UNTIL
        case model.Always(body, window):
            return f"always{_window(window)} {_inside(body, _UNARY)}", _UNARY
        case model.Eventually(body, window):
            return f"eventually{_window(window)} {_inside(body, _UNARY)}", _UNARY
        case model.Next(body):
            return f"next {_inside(body, _UNARY)}", _UNARY
        case model.Tolerate(body, return_us, stay_us):
            windows = f"{format_duration(return_us)}, {format_duration(stay_us)}"
            return f"tolerate({print_formula(body)}, {windows})", _ATOM
        case model.Quantified(quantifier, variable, sort, body):
            return f"{quantifier.value} ?{variable.name} in {sort}: {print_formula(body)}", _IFF


def _chain(word: str, parts: tuple[Formula, ...], level: int) -> str:
    return word.join(_inside(part, level) for part in parts)


def _inside(formula: Formula, level: int) -> str:
    text, own = _written(formula)
    return text if own >= level else f"({text})"


def print_term(term: Term | model.Argument) -> str:  # noqa: PLR0911 - one case per kind of term
    """Write a term.

    Examples
    --------
    >>> print_term(model.Scaled(Decimal("1.2"), model.Feature("speed", (model.Variable("c"), model.Object("a b")))))
    '1.2 * speed[?c, "a b"]'
    """
    match term:
        case model.Variable(name):
            return f"?{name}"
        case model.Object(model.ANY):
            return model.ANY
        case model.Object(name):
            return name if _PLAIN.fullmatch(name) and name not in _WORDS else quoted(name)
        case model.Text(text):
            return quoted(text)
        case model.Feature(name, arguments):
            return f"{name}[{', '.join(map(print_term, arguments))}]" if arguments else name
        case model.Number(amount, unit):
            return f"{_decimal(amount)} {unit}".rstrip()
        case model.Scaled(factor, feature):
            return f"{_decimal(factor)} * {print_term(feature)}"
        case model.Sum(left, sign, right):
            return f"{print_term(left)} {sign} {print_term(right)}"


def _decimal(value: Decimal) -> str:
    return format(value, "f")


def _window(window: model.Window) -> str:
    if window == model.ALWAYS_OPEN:
        return ""
    end = "oo" if window.end_us is None else format_duration(window.end_us)
    return f"[{format_duration(window.start_us)}, {end}]"
