"""What happened in a clip? All truth events that can be told from the simulator's state."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from data_gen.drawing.occlusion.overlay import Overlay
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import BoolArray, VehicleStates
from data_gen.truth.alone import find_solitary
from data_gen.truth.cut_in import find_cut_ins
from data_gen.truth.event import TruthEvent, in_order
from data_gen.truth.events import find_events
from data_gen.truth.following import find_following
from data_gen.truth.junction_passes import find_junction_passes
from data_gen.truth.motion import Motion, tabulate, truth_tables
from data_gen.truth.near_miss import find_near_misses
from data_gen.truth.queue_jump import find_queue_jumps
from data_gen.truth.reckless import find_reckless
from data_gen.truth.rows import visible_centres
from data_gen.truth.turns import find_turns
from gis.road_network import RoadNetwork


def clip_events(
    states: Sequence[VehicleStates],
    network: RoadNetwork,
    views: Sequence[CameraView] | None,
    overlay: Overlay | None = None,
) -> tuple[TruthEvent, ...]:
    """Find every event of which at least a part is in view.

    Parameters
    ----------
    states : of the clip, in order of time, steps at most 100 ms apart.
    network : the road network.
    views : one a step; None if everything is seen everywhere.
    overlay : the occluders; none without.

    Returns
    -------
    Events by start, vehicles and type.
    """
    motion = tabulate(states, network)
    seen = seen_centres(motion, states, views, overlay)
    tables = truth_tables(states, network, seen, motion)
    certain = find_events(motion, seen)
    overlaps = in_order([*certain, *_not_told_yet(find_junction_passes(tables), certain)])
    return in_order(
        [
            *overlaps,
            *find_reckless(tables, overlaps),
            *find_queue_jumps(tables, overlaps),
            *find_turns(tables),
            *find_following(tables),
            *find_cut_ins(tables),
            *find_solitary(tables),
            *find_near_misses(tables),
        ]
    )


def _not_told_yet(events: Iterable[TruthEvent], certain: Iterable[TruthEvent]) -> Iterator[TruthEvent]:
    """Leave out what overlaps an event of the same type and vehicles."""
    told: dict[tuple[str, tuple[str, ...]], list[TruthEvent]] = {}
    for event in certain:
        told.setdefault((event.type, event.vehicles), []).append(event)
    for event in events:
        same = told.get((event.type, event.vehicles), [])
        if not any(one.start_us < event.end_us and event.start_us < one.end_us for one in same):
            yield event


def seen_centres(
    motion: Motion,
    states: Sequence[VehicleStates],
    views: Sequence[CameraView] | None,
    overlay: Overlay | None = None,
) -> BoolArray:
    """Tell at which steps each vehicle is in view and not hidden.

    Parameters
    ----------
    motion, states : of the same clip.
    views : one a step; None if everything is seen everywhere.
    overlay : the occluders; none without.

    Returns
    -------
    (steps, vehicles), columns as in `motion.ids`; False where a vehicle is absent.
    """
    column = {vehicle_id: place for place, vehicle_id in enumerate(motion.ids)}
    seen = np.zeros(motion.road.shape, dtype=np.bool_)
    for row, step in enumerate(states):
        columns = [column[vehicle_id] for vehicle_id in step.ids]
        seen[row, columns] = True if views is None else visible_centres(step, views[row], overlay)
    return seen
