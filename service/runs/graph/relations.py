"""Which relations are looked for among the cars of a network, and by which settings?"""

from collections.abc import Collection
from dataclasses import fields, replace

from gis.roads.lane_graph import LaneGraph
from gis.roads.road_network import RoadNetwork
from gis.roads.turns import turns
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from service.records.runs import RunRecord

SETTINGS = "relations."


def relation_observer(
    network: RoadNetwork | None, settings: RelationSettings, only: Collection[str]
) -> RelationObserver:
    """Make the observer of the relations with some names; None for a network is open ground."""
    if network is None:
        return RelationObserver((), (), settings, only=only)
    return RelationObserver(
        [road.id for road in network.roads],
        [junction.id for junction in network.junctions],
        settings,
        only=only,
        lanes=[(lane.id, lane.direction) for lane in network.lanes],
        turns=turns(network) if "turn" in only else (),
        graph=LaneGraph.of(network, keep_lanes=True),
    )


def changed_settings(settings: RelationSettings) -> dict[str, str]:
    """Give the settings that are not the shipped ones, as a run keeps them for who asks about it."""
    values = [(one, getattr(settings, one.name)) for one in fields(settings)]
    return {f"{SETTINGS}{one.name}": repr(value) for one, value in values if value != one.default}


def stored_settings(run: RunRecord) -> RelationSettings:
    """Read the settings of a run; those not kept with it are the shipped ones.

    Examples
    --------
    >>> kept = changed_settings(RelationSettings(close_m=9.0, backdate_us=0))
    >>> found = stored_settings(RunRecord(id="a", source="a.mp4", start_utc_us=0, settings=kept))
    >>> found.close_m, found.backdate_us, found.beside_lateral_m
    (9.0, 0, 12.0)
    """
    usual = RelationSettings()
    kept = {name.removeprefix(SETTINGS): text for name, text in run.settings.items() if name.startswith(SETTINGS)}
    return replace(usual, **{name: type(getattr(usual, name))(text) for name, text in kept.items()})
