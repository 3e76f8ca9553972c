"""Registries: host code by name."""

import pytest

from dyknow.errors import RegistryError
from dyknow.registry import Registry
from tests.dyknow.units import Doubling


def registry() -> Registry:
    known = Registry()
    known.source("pos", output="Point")
    known.unit("double", inputs=("Number",), output="Number")(Doubling)
    return known


def test_each_process_gets_a_unit_of_its_own() -> None:
    known = registry()
    assert known.create("double") is not known.create("double")


def test_signatures_are_listed_by_name() -> None:
    known = registry()
    assert {name: one.output for name, one in known.sources.items()} == {"pos": "Point"}
    assert {name: (one.inputs, one.output) for name, one in known.units.items()} == {"double": (("Number",), "Number")}


@pytest.mark.parametrize("name", ["pos", "double"])
def test_name_in_use_is_refused(name: str) -> None:
    known = registry()
    with pytest.raises(RegistryError, match=f"'{name}': expected a new name"):
        known.source(name, output="Point")
    with pytest.raises(RegistryError, match=f"'{name}': expected a new name"):
        known.unit(name, inputs=("Point",), output="Point")


def test_unit_without_inputs_is_refused() -> None:
    with pytest.raises(RegistryError, match=r"unit 'clock': expected the types of one input or more, got \(\)"):
        Registry().unit("clock", inputs=(), output="Time")


def test_unknown_name_lists_the_known_ones() -> None:
    known = registry()
    with pytest.raises(RegistryError, match=r"unit 'pos': expected one of the registered ones \(double\)"):
        known.unit_named("pos")
