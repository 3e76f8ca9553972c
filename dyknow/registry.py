"""Which sources and computational units does the host offer, and what do they take and give?

A declaration in text names its sources and units; the registry binds these names to host code. Units are registered as
factories: every process gets a unit of its own, whose state nobody shares.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from dyknow.errors import RegistryError

# Any: a unit takes `update(sample)` or `update(index, sample)`, depending on how many inputs it was registered with.
UnitFactory = Callable[[], Any]
_Factory = TypeVar("_Factory", bound=UnitFactory)


@dataclass(frozen=True, slots=True)
class SourceSignature:
    """Name a source and the type of its samples' values."""

    name: str
    output: str


@dataclass(frozen=True, slots=True)
class UnitSignature:
    """Name a computational unit, the types of its inputs and of its output, and what makes one."""

    name: str
    inputs: tuple[str, ...]
    output: str
    factory: UnitFactory


@dataclass(frozen=True, slots=True)
class ConfigurationSignature:
    """Name code that creates and removes processes, the type of its input, and what makes one."""

    name: str
    input: str
    factory: UnitFactory


class Registry:
    """Hold the sources, units and configurations of a host by name, in the order in which they were registered.

    Examples
    --------
    >>> registry = Registry()
    >>> registry.source("pos", output="Point")
    >>> @registry.unit("on_road", inputs=("Point",), output="Truth")
    ... class OnRoad:
    ...     def update(self, sample):
    ...         return ()
    ...     def finish(self):
    ...         return ()
    >>> registry.unit_named("on_road").inputs, registry.sources["pos"].output
    (('Point',), 'Point')
    >>> type(registry.create("on_road")).__name__
    'OnRoad'
    """

    def __init__(self) -> None:
        self.sources: dict[str, SourceSignature] = {}
        self.units: dict[str, UnitSignature] = {}
        self.configurations: dict[str, ConfigurationSignature] = {}

    def source(self, name: str, *, output: str) -> None:
        """Register a source: the host publishes values of type ``output`` to streams made of it.

        Raises
        ------
        RegistryError
            If a source or unit has this name.
        """
        self._refuse_taken(name)
        self.sources[name] = SourceSignature(name, output)

    def unit(self, name: str, *, inputs: tuple[str, ...], output: str) -> Callable[[_Factory], _Factory]:
        """Register what makes units of this name: call the answer with it, or use it as a decorator of the class.

        Raises
        ------
        RegistryError
            If a source or unit has this name, or if there is no input.
        """
        self._refuse_taken(name)
        if not inputs:
            raise RegistryError(f"unit {name!r}: expected the types of one input or more, got {inputs!r}")

        def register(factory: _Factory) -> _Factory:
            """Bind the factory, and give it back as it is."""
            self._refuse_taken(name)
            self.units[name] = UnitSignature(name, inputs, output, factory)
            return factory

        return register

    def configuration(self, name: str, *, input: str) -> Callable[[_Factory], _Factory]:  # noqa: A002 - as in KPL
        """Register what makes configurations of this name: objects with ``wanted(value)`` and ``build(node, key)``.

        Both are as `Node.add_configuration` takes them; ``input`` is the type of the values.

        Raises
        ------
        RegistryError
            If a source, unit or configuration has this name.

        Examples
        --------
        >>> registry = Registry()
        >>> @registry.configuration("followed", input="set(string)")
        ... class Followed:
        ...     def wanted(self, value):
        ...         return sorted(value)
        ...     def build(self, node, key):
        ...         node.add_source(f"pos[{key}]")
        >>> registry.configurations["followed"].input
        'set(string)'
        """
        self._refuse_taken(name)

        def register(factory: _Factory) -> _Factory:
            """Bind the factory, and give it back as it is."""
            self._refuse_taken(name)
            self.configurations[name] = ConfigurationSignature(name, input, factory)
            return factory

        return register

    def unit_named(self, name: str) -> UnitSignature:
        """Give the signature of a unit.

        Raises
        ------
        RegistryError
            If there is none of this name.
        """
        if name not in self.units:
            known = ", ".join(sorted(self.units)) or "none"
            raise RegistryError(f"unit {name!r}: expected one of the registered ones ({known})")
        return self.units[name]

    def create(self, name: str) -> Any:  # Any: see UnitFactory
        """Make a new unit.

        Raises
        ------
        RegistryError
            If there is none of this name.
        """
        return self.unit_named(name).factory()

    def _refuse_taken(self, name: str) -> None:
        if name in self.sources or name in self.units or name in self.configurations:
            raise RegistryError(f"{name!r}: expected a new name for host code, got one that is in use")
