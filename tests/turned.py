"""Twice and half of a number, for tests that every number of a room matters."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from operator import ne
from typing import Any


# Any: `replace` and `fields` take any dataclass, for which there is no type.
def turned(settings: Any, name: str, *, small: int = 0, refused: type[Exception] | tuple[()] = ()) -> Iterator[Any]:
    """Give the settings with a number doubled and halved; whole ones up to `small` with one more and one less.

    What raises `refused` may not be and is left out.
    """
    value = getattr(settings, name)
    is_small = isinstance(value, int) and value <= small
    for other in (value + 1, value - 1) if is_small else (2 * value, value / 2):
        with suppress(refused):
            yield replace(settings, **{name: type(value)(other)})


def unnoticed(
    settings: Any,
    scenes: Mapping[Callable[[Any], Any], Sequence[str]],
    *,
    small: int = 0,
    refused: type[Exception] | tuple[()] = (),
    differs: Callable[[Any, Any], bool] = ne,
) -> list[str]:
    """List the numbers whose turning changes nothing in the scene made for them, and those without a scene.

    A scene may give its parts one by one; `differs` then gets a list of them, as usual, and those of the turned number.
    """
    found = []
    for scene, names in scenes.items():
        usual = scene(settings)
        usual = list(usual) if isinstance(usual, Iterator) else usual
        assert not differs(usual, scene(settings)), f"{scene} tells something else each time"
        for name in names:
            if not any(differs(usual, scene(other)) for other in turned(settings, name, small=small, refused=refused)):
                found.append(name)
    return found + without_scene(settings, scenes.values())


def without_scene(settings: Any, scenes: Iterable[Sequence[str]]) -> list[str]:
    """List the numbers that no scene is there for, and names in scenes that are no numbers."""
    told = {name for names in scenes for name in names}
    numbers = {one.name for one in fields(settings) if not is_dataclass(getattr(settings, one.name))}
    return sorted(numbers ^ told)
