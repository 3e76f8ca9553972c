"""What does a formula see of the world at one time? Values of features, and which objects each sort has."""

from collections.abc import Collection, Mapping
from enum import Enum
from typing import Any, Protocol

from dyknow.errors import DyKnowError


class StateError(DyKnowError):
    """A state that a formula cannot be evaluated in: a value of the wrong type, or a time that is not later."""


class State(Protocol):
    """The world at one time. A state must not change once a progressor has seen it."""

    def value(self, feature: str, arguments: tuple[str, ...]) -> Any:  # Any: features have values of any type
        """Give the value of a feature of some objects; None where it is not known."""

    def members(self, sort: str) -> Collection[str]:
        """Give the objects of a sort at this time; an object that is not among them has left, or has not come."""


class DictState:
    """A state out of dictionaries.

    Parameters
    ----------
    values : by feature, or by feature and objects; what is left out is not known.
    sorts : the objects of each sort; a sort that is left out has none.

    Examples
    --------
    >>> state = DictState({"raining": True, ("speed", ("car7",)): 12.5}, {"Car": ["car7"]})
    >>> state.value("raining", ()), state.value("speed", ("car7",)), state.value("speed", ("car8",))
    (True, 12.5, None)
    >>> state.members("Car"), state.members("Road")
    (['car7'], ())
    """

    __slots__ = ("_sorts", "_values")

    def __init__(
        self,
        values: Mapping[Any, Any],  # Any: keys are names or pairs; values have any type
        sorts: Mapping[str, Collection[str]] = {},
    ) -> None:
        self._values = values
        self._sorts = sorts

    def value(self, feature: str, arguments: tuple[str, ...]) -> Any:  # Any: see State
        """Give the value, or None."""
        return self._values.get((feature, arguments) if arguments else feature)

    def members(self, sort: str) -> Collection[str]:
        """Give the objects of a sort."""
        return self._sorts.get(sort, ())


class Verdict(Enum):
    """Answer so far: TRUE and FALSE are final, whatever states may come."""

    TRUE = "true"
    FALSE = "false"
    UNKNOWN = "unknown"
