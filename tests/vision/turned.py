"""Twice and half of a number, for tests that every number of a room matters."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

SMALL = 5


# Any: `replace` and `fields` take any dataclass, for which there is no type.
def turned(settings: Any, name: str) -> Iterator[Any]:
    """Give the settings with a number doubled and halved; small whole ones with one more and one less."""
    value = getattr(settings, name)
    is_small = isinstance(value, int) and value <= SMALL
    for other in (value + 1, value - 1) if is_small else (2 * value, value / 2):
        yield replace(settings, **{name: type(value)(other)})


def unnoticed(settings: Any, scenes: Mapping[Callable[[Any], object], Sequence[str]]) -> list[str]:
    """List the numbers whose turning changes nothing in the scene made for them, and those without a scene."""
    found = []
    for scene, names in scenes.items():
        usual = scene(settings)
        found += [name for name in names if all(scene(other) == usual for other in turned(settings, name))]
    told = {name for names in scenes.values() for name in names}
    numbers = [one.name for one in fields(settings) if not is_dataclass(getattr(settings, one.name))]
    return found + [name for name in numbers if name not in told]
