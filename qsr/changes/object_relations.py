"""Which relations are there of single cars, and of cars and places, and what is measured for them?"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from qsr.changes.crossings import RelationChange
from qsr.changes.places import PlaceTracker
from qsr.changes.travel import MovingTracker, TravelTracker, against_traffic_states, forward_states
from qsr.measuring.footprints import Footprints, LongArray
from qsr.settings import RelationSettings

# (n,) numbers, whole or not: each tracker is given what was measured for it.
Quantity = NDArray[Any]


class ObjectTracker(Protocol):
    """Describe what follows one relation of every object."""

    def forget(self, object_id: str, column: int, t_us: int) -> list[RelationChange]:
        """Make an object that has disappeared unknown; to be called before `keep`."""
        ...

    def keep(self, columns: LongArray, quantity: Quantity, ids: Sequence[str], t_us: int) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`."""
        ...

    def update(self, t_us: int, quantity: Quantity, ids: Sequence[str]) -> list[RelationChange]:
        """Take one frame, objects as at the last `keep`, and return the changes."""
        ...


@dataclass(frozen=True, slots=True)
class ObjectRelation:
    """Hold a tracker and how to measure, from footprints, what it follows."""

    tracker: ObjectTracker
    measure: Callable[[Footprints], Quantity]


def object_relations(
    settings: RelationSettings,
    names: Collection[str],
    *,
    roads: Sequence[str],
    junctions: Sequence[str],
    lanes: Sequence[tuple[str, int]],
) -> tuple[ObjectRelation, ...]:
    """Set up the relations of single cars that are asked for; those to lanes only if there are lanes."""
    dwell_us, backdate_us = settings.place_dwell_us, settings.backdate_us
    least_cosine = math.sqrt(settings.road_alignment)
    lane_directions = np.array([direction for _, direction in lanes], dtype=np.int32)

    def place(relation: str, ids: Sequence[str]) -> PlaceTracker:
        return PlaceTracker(relation, ids, dwell_us=dwell_us, backdate_us=backdate_us)

    def travel(relation: str) -> TravelTracker:
        return TravelTracker(relation, dwell_us=dwell_us, backdate_us=backdate_us)

    known = {
        "on": ObjectRelation(place("on", roads), lambda footprints: footprints.road),
        "in_crossing": ObjectRelation(place("in_crossing", junctions), lambda footprints: footprints.junction),
        "moving": ObjectRelation(MovingTracker(settings), lambda footprints: footprints.speed_mps),
        "forward": ObjectRelation(travel("forward"), lambda footprints: forward_states(footprints, least_cosine)),
    }
    if lanes:
        known["in_lane"] = ObjectRelation(
            place("in_lane", [lane_id for lane_id, _ in lanes]), lambda footprints: footprints.lane
        )
        known["against_traffic"] = ObjectRelation(
            travel("against_traffic"),
            lambda footprints: against_traffic_states(footprints, least_cosine, lane_directions),
        )
    return tuple(relation for name, relation in known.items() if name in names)
