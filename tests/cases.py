"""One test for many cases: pytest's own parameters cost more than a small test does."""

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping

import pytest

Test = Callable[..., None]


def for_each(name: str, values: Iterable[object] | Mapping[str, object]) -> Callable[[Test], Test]:
    """Run a test once for each value of an argument, and name the value at which it fails.

    Parameters
    ----------
    name : of the argument.
    values : what it becomes in turn; a mapping also names its values.
    """
    named = list(values.items()) if isinstance(values, Mapping) else [(repr(value), value) for value in values]

    def decorated(test: Test) -> Test:
        @functools.wraps(test)
        def with_all(**fixtures: object) -> None:
            assert named, f"{name}: expected at least one value, got none"
            for title, value in named:
                try:
                    test(**fixtures, **{name: value})
                except BaseException as error:
                    error.add_note(f"{name} = {title}")
                    raise

        signature = inspect.signature(test)
        others = [one for one in signature.parameters.values() if one.name != name]
        with_all.__signature__ = signature.replace(parameters=others)  # type: ignore[attr-defined]  # what pytest asks for
        return with_all

    return decorated


def first_kept(values: Iterable[object], *, kept: int = 1) -> list[object]:
    """Give parameters of a test, of which `make test` takes the first ones and `make test-long` the others."""
    listed = list(values)
    return [*listed[:kept], *(pytest.param(value, marks=pytest.mark.long) for value in listed[kept:])]


def seeds(every: range, *, kept: int) -> pytest.MarkDecorator:
    """Give a test `seeds` to walk over: the first ones in every run, the others with `make test-slow`."""
    return pytest.mark.parametrize(
        "seeds",
        [
            pytest.param(every[:kept], id="first"),
            pytest.param(every[kept:], id="others", marks=pytest.mark.slow),
        ],
    )
