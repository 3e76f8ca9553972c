"""Which relations change among the cars of a network, and how does a change look in the log?"""

from collections.abc import Collection

from chronicles.adapter import value_text
from gis.lane_graph import LaneGraph
from gis.road_network import RoadNetwork
from gis.turns import turns
from qsr.changes.crossings import RelationChange
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from service.records import RelationRecord


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


def relation_record(change: RelationChange, hypotheses: tuple[str, ...] = ()) -> RelationRecord:
    """Write a change as the log has it, with the labels of the links that it rests on."""
    old, new = value_text(change.old), value_text(change.new)
    times_us = change.t_us, change.decided_us
    return RelationRecord(*times_us, change.name, change.args, old, new, hypotheses, change.confidence)
