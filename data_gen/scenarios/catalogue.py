"""Which scenarios are there?"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from data_gen.errors import DataGenError
from data_gen.scenario import Scenario
from data_gen.scenarios.rural_overtaking.scenario import rural_overtaking

SCENARIOS: Mapping[str, Callable[[], Scenario]] = MappingProxyType({"rural_overtaking": rural_overtaking})
"""Scenario makers by name."""


def scenario_named(name: str) -> Scenario:
    """Find a scenario by its name.

    Parameters
    ----------
    name : one of the keys of `SCENARIOS`.

    Returns
    -------
    The scenario.

    Raises
    ------
    DataGenError
        If there is no scenario of that name.

    Examples
    --------
    >>> scenario_named("rural_overtaking").view.width_m
    600.0
    >>> scenario_named("moon")
    Traceback (most recent call last):
    ...
    data_gen.errors.DataGenError: scenario: expected one of rural_overtaking, got 'moon'
    """
    if name not in SCENARIOS:
        raise DataGenError(f"scenario: expected one of {', '.join(sorted(SCENARIOS))}, got {name!r}")
    return SCENARIOS[name]()
