"""Has a value changed? By ``==``, and for arrays, whose ``==`` is no answer, by all their elements."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from dyknow.errors import PolicyError


def is_same(before: Any, after: Any) -> bool:  # Any: a stream may carry any value
    """Tell whether two values of a stream are the same, as `any change` has it.

    What ``==`` calls equal is the same, so NaN never is. Arrays are the same if their shapes and all their elements
    are; so are they inside tuples, lists, mappings and dataclasses.

    Raises
    ------
    PolicyError
        If ``==`` gives neither true nor false, and the values are nothing of the above.

    Examples
    --------
    >>> import numpy as np
    >>> is_same(np.array([1, 2]), np.array([1, 2])), is_same(np.array([1, 2]), np.array([1, 2, 3]))
    (True, False)
    >>> is_same(("car1", np.array([1, 2])), ("car1", np.array([1, 3])))
    False
    """
    try:
        equal = before == after
        if equal is True or equal is False:
            return equal
        if _shape(equal) in (None, ()):  # a single answer, such as that of numbers out of arrays
            return bool(equal)
        return _shape(before) == _shape(after) and bool(equal.all())
    except (ValueError, TypeError) as error:  # arrays of different shapes, or something with arrays in it
        return _are_parts_same(before, after, error)


def _shape(value: Any) -> Any:  # Any: see above
    return getattr(value, "shape", None)


def _are_parts_same(before: Any, after: Any, error: Exception) -> bool:  # Any: see above
    if _shape(before) != _shape(after) or type(before) is not type(after):
        return False
    if isinstance(before, tuple | list):
        return len(before) == len(after) and all(map(is_same, before, after))
    if isinstance(before, Mapping):
        return before.keys() == after.keys() and all(is_same(before[key], after[key]) for key in before)
    if is_dataclass(before):
        compared = [field.name for field in fields(before) if field.compare]
        return all(is_same(getattr(before, name), getattr(after, name)) for name in compared)
    kind = type(before).__name__
    raise PolicyError(f"policy: 'any change' expected values that == compares, got {kind!r} and {error}") from error
