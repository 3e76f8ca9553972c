"""How do cars, changes and occurrences look as rows, the form in which the log and the monitors take them?"""

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from math import isnan

from anchoring.observations import DECIMALS, Cars
from chronicles.adapter import value_text
from chronicles.events import Occurrence
from gis.roads.road_network import RoadNetwork
from qsr.changes.crossings import RelationChange
from service.records.events import ChronicleRef, EventDraft, EventStatus, Place, SubEvent
from service.records.seen import CarState, RelationRecord

STALE_US = 500_000
"""So long a car is where it was: where cars were while they were hidden is known for some frames only."""


class CarRows:
    """Turns cars into rows, with the names of roads and lanes in place of their numbers."""

    def __init__(self, network: RoadNetwork | None) -> None:
        self._roads = [road.id for road in network.roads] if network else []
        self._lanes = [lane.id for lane in network.lanes] if network else []

    def road(self, index: int) -> str:
        """Name a road; "" for -1, which is none."""
        return self._roads[index] if index >= 0 else ""

    def of(self, cars: Cars) -> Iterator[CarState]:
        """Give the rows of a frame, in the order of the cars."""
        positions = cars.positions
        columns = zip(
            cars.ids,
            cars.centre_m.tolist(),
            cars.heading_rad.tolist(),
            cars.speed_mps.tolist(),
            cars.length_m.tolist(),
            cars.width_m.tolist(),
            cars.classes,
            positions.road.tolist(),
            positions.along_m.round(DECIMALS).tolist(),
            positions.lane.tolist(),
            cars.linked.tolist(),
            cars.vision_ids,
            [None if isnan(one) else one for one in cars.sigma_m.tolist()],
            cars.has_moved.tolist(),
            cars.confidence.tolist(),
            strict=True,
        )
        for car, (x_m, y_m), heading, speed, length, width, kind, road, along, lane, linked, vision, *sure in columns:
            yield CarState(
                *(cars.t_us, car, x_m, y_m, heading, speed, length, width, kind),
                *(self.road(road), along if road >= 0 else None, self._lanes[lane] if lane >= 0 else ""),
                *(linked, vision, *sure),
            )


def relation_record(change: RelationChange, hypotheses: tuple[str, ...] = ()) -> RelationRecord:
    """Write a change as the log has it, with the labels of the links that it rests on."""
    old, new = value_text(change.old), value_text(change.new)
    times_us = change.t_us, change.decided_us
    return RelationRecord(*times_us, change.name, change.args, old, new, hypotheses, change.confidence)


def event_drafts(
    occurrence: Occurrence,
    place: Place | None,
    *,
    least: float | None = None,
    told: Sequence[str] = (),
    now_us: int = 0,
) -> list[EventDraft]:
    """Make the events of an occurrence: one for each message that it emits, or one of its own name.

    Parameters
    ----------
    place : where it began.
    least : how sure it must be, or it is doubtful; None for what its chronicle asks for.
    told : identifiers of the events that were made of it before; each is revised by the one in the same place, which is
        decided at `now_us`.
    """
    names = [event.name for event in occurrence.given]
    is_doubtful = occurrence.confidence < (occurrence.floor if least is None else least)
    status: EventStatus = "doubtful" if is_doubtful and occurrence.status != "retracted" else occurrence.status
    return [
        EventDraft(
            type=name,
            chronicle=ChronicleRef(occurrence.chronicle, occurrence.version),
            start_us=occurrence.start_us,
            end_us=occurrence.end_us,
            roles=dict(occurrence.roles),
            recognised_us=occurrence.recognised_us if revised is None else now_us,
            status=status,
            confidence=round(occurrence.confidence, 3),
            revises=revised,
            hypotheses=tuple(occurrence.hypotheses),
            sub_events=tuple(SubEvent(label, t_us) for label, t_us in occurrence.sub_events),
            place=place,
        )
        for name, revised in zip_longest(names, told)
    ]
