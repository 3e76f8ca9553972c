"""Which scenarios are there?"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from data_gen.errors import DataGenError
from data_gen.scenario import DEMAND, OptionValues, Scenario, ScenarioOption, read_options
from data_gen.scenarios.hard_negatives import (
    following_only,
    lane_change_only,
    meeting_only,
    parked_car,
    queue_passing,
)
from data_gen.scenarios.junctions import JUNCTION_OPTIONS, junction, roundabout
from data_gen.scenarios.motorway import MOTORWAY_OPTIONS, motorway
from data_gen.scenarios.rural_overtaking import RURAL_OPTIONS, rural_overtaking
from data_gen.scenarios.urban_grid import URBAN_OPTIONS, urban_grid


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """A scenario that can be asked for by name."""

    make: Callable[[OptionValues], Scenario]
    options: tuple[ScenarioOption, ...] = ()


SCENARIOS: Mapping[str, CatalogueEntry] = {
    "rural_overtaking": CatalogueEntry(rural_overtaking, RURAL_OPTIONS),
    "junction": CatalogueEntry(junction, JUNCTION_OPTIONS),
    "motorway": CatalogueEntry(motorway, MOTORWAY_OPTIONS),
    "roundabout": CatalogueEntry(roundabout, (DEMAND,)),
    "urban_grid": CatalogueEntry(urban_grid, URBAN_OPTIONS),
    "following_only": CatalogueEntry(following_only),
    "meeting_only": CatalogueEntry(meeting_only),
    "parked_car": CatalogueEntry(parked_car),
    "lane_change_only": CatalogueEntry(lane_change_only),
    "queue_passing": CatalogueEntry(queue_passing),
}
"""Scenarios by name."""

NO_OPTIONS: Mapping[str, str] = {}


def scenario_named(name: str, options: Mapping[str, str] = NO_OPTIONS) -> Scenario:
    """Find a scenario by its name.

    Parameters
    ----------
    name : one of the keys of `SCENARIOS`.
    options : of that scenario, name and value as text; what is left out has its default.

    Returns
    -------
    The scenario.

    Raises
    ------
    DataGenError
        If there is no scenario of that name, or it does not know an option or its value.

    Examples
    --------
    >>> scenario_named("rural_overtaking").view.width_m
    600.0
    >>> scenario_named("junction", {"lights": "actuated"}).light_programs
    (('centre', 'actuated'),)
    >>> scenario_named("junction", {"lights": "blue"})
    Traceback (most recent call last):
    ...
    data_gen.errors.DataGenError: scenario 'junction', option 'lights': expected fixed or actuated, got 'blue'
    """
    if name not in SCENARIOS:
        raise DataGenError(f"scenario: expected one of {', '.join(sorted(SCENARIOS))}, got {name!r}")
    entry = SCENARIOS[name]
    return entry.make(read_options(name, entry.options, options))
