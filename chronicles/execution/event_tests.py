"""Does an event fit a pattern, and which values does it give to the variables?

The tests of a pattern are written as a small Python function with its constants in it: several times as fast as loops
over tables, and readable.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import indent
from typing import Any  # the namespaces of generated code

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import EventTest
from chronicles.events import Event

Values = tuple[str, ...]
EventMatcher = Callable[[Event], Values | None]


@dataclass(frozen=True, slots=True)
class Code:
    """The source text of one function, and the objects that it names."""

    name: str
    lines: Sequence[str]
    names: Mapping[str, Any]

    @property
    def text(self) -> str:
        """The source text."""
        return f"def {self.name}:\n" + indent("\n".join(self.lines), "    ") + "\n"

    def function(self) -> Callable[..., Any]:
        """Compile it."""
        namespace = dict(self.names)
        exec(compile(self.text, f"<{self.name}>", "exec"), namespace)
        function: Callable[..., Any] = namespace[self.name.split("(")[0]]
        return function


def event_matcher(test: EventTest, fields: Sequence[int]) -> EventMatcher:
    """Make the function that tests an event.

    Parameters
    ----------
    test : what the event must look like; its name is not tested.
    fields : which fields of a fitting event the function returns.

    Examples
    --------
    >>> matcher = event_matcher(EventTest("honk", 2, is_change=False, constants=((0, "car1"),)), [1])
    >>> matcher(Event("honk", ("car1", "car2"), 0)), matcher(Event("honk", ("car3", "car2"), 0))
    (('car2',), None)
    """
    lines, names = fit_code(test)
    values = tuple_text([field_text(test, field) for field in fields])
    return Code("match(event)", [*lines, f"return {values}"], names).function()


def fit_code(test: EventTest) -> tuple[list[str], dict[str, Any]]:
    """Write the lines that return None if `event` does not fit, and give the objects that they name.

    A value stated again is no change; one that is not told, or empty, is unknown.
    """
    lines = ["args = event.args"]
    lines += _none_if([f"len(args) != {test.arity}", f"event.new is {'' if test.is_change else 'not '}None"])
    if test.is_change:
        lines += ["old, new = event.old or UNKNOWN, event.new or UNKNOWN"]
    wrong = ["old == new"] * test.is_change
    wrong += [f"{field_text(test, field)} != {text!r}" for field, text in test.constants]
    wrong += [f"{field_text(test, field)} not in allowed_{field}" for field, _ in test.filters]
    wrong += [f"{field_text(test, first)} != {field_text(test, second)}" for first, second in test.equal]
    wrong += [f"{field_text(test, first)} == {field_text(test, second)}" for first, second in test.different]
    lines += _none_if(wrong)
    return lines, {"UNKNOWN": UNKNOWN} | {f"allowed_{field}": allowed for field, allowed in test.filters}


def field_text(test: EventTest, field: int) -> str:
    """Name a field of an event in the lines of `fit_code`: arguments, then the old and the new value."""
    return f"args[{field}]" if field < test.arity else ("old", "new")[field - test.arity]


def tuple_text(texts: Sequence[str]) -> str:
    """Write a tuple of expressions."""
    return f"({', '.join(texts)}{',' * (len(texts) == 1)})"


def _none_if(conditions: Sequence[str]) -> list[str]:
    return [f"if {' or '.join(conditions)}:", "    return None"] if conditions else []
