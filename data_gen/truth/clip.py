"""What happened in a clip, and where was everybody in view? All events, and the rows of `truth.csv`."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from data_gen.drawing.overlay import Overlay, hidden_shares
from data_gen.drawing.traffic.shown import Shown
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import BoolArray, Cells, VehicleStates, written
from data_gen.truth.alone import find_solitary
from data_gen.truth.cut_in import find_cut_ins
from data_gen.truth.event import TruthEvent, in_order
from data_gen.truth.events import find_events, find_junction_passes
from data_gen.truth.following import find_following
from data_gen.truth.motion import tabulate, truth_tables
from data_gen.truth.near_miss import find_near_misses
from data_gen.truth.queue_jump import find_queue_jumps
from data_gen.truth.reckless import find_reckless
from data_gen.truth.turns import find_turns
from gis.roads.road_network import RoadNetwork

COLUMNS = (
    *("t_us", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"),
    *("road", "lane", "visible"),
)
SHOWN_COLUMNS = ("visible_share", "left_px", "top_px", "right_px", "bottom_px")
"""Further columns where the camera has a pose."""

HIDDEN_SHARE = 0.5
"""A vehicle of which occluders hide more than this is not visible."""


def clip_events(
    states: Sequence[VehicleStates], network: RoadNetwork, visible: Sequence[BoolArray]
) -> tuple[TruthEvent, ...]:
    """Find every event of which at least a part is in view.

    Parameters
    ----------
    states : of the clip, in order of time, steps at most 100 ms apart.
    network : the road network.
    visible : of each step, as `visible_masks` gives it.

    Returns
    -------
    Events by start, vehicles and type.
    """
    motion = tabulate(states, network)
    seen = Cells(states, motion.ids).spread(np.concatenate(visible), False)
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


def visible_masks(
    states: Sequence[VehicleStates],
    views: Sequence[CameraView] | None,
    overlay: Overlay | None = None,
    shown: Sequence[Shown] | None = None,
) -> list[BoolArray]:
    """Tell for each step which of its vehicles are in view and not hidden.

    Parameters
    ----------
    states : of the clip, in order of time.
    views : one a step; None if everything is seen everywhere.
    overlay : the occluders; none without.
    shown : what each picture shows, where that was counted.
    """
    if views is None:
        return [np.ones(len(step.ids), dtype=np.bool_) for step in states]
    if shown is not None:
        return [_shown_centres(*one) for one in zip(states, views, shown, strict=True)]
    return [visible_centres(step, view, overlay) for step, view in zip(states, views, strict=True)]


def _shown_centres(step: VehicleStates, view: CameraView, shown: Shown) -> BoolArray:
    visible = np.zeros(len(step.ids), dtype=np.bool_)
    visible[shown.rows] = shown.share >= 1 - HIDDEN_SHARE
    return visible & view.contains(step.centre_m)


def write_truth(
    path: Path,
    states: Sequence[VehicleStates],
    network: RoadNetwork,
    views: Sequence[CameraView] | None,
    visible: Sequence[BoolArray],
    *,
    shown: Sequence[Shown] | None = None,
) -> None:
    """Write one row for each vehicle in view at each step.

    Parameters
    ----------
    path : the file; columns as in `COLUMNS`. x, y is the centre of the body, road and lane are those under it (empty
        off the road), `visible` is 1 if the centre is in the image and at most half of the body is hidden, else 0.
    states : in order of time.
    network : gives road and lane.
    views : one a step, decide what is in view; None if everything is seen everywhere.
    visible : of each step, as `visible_masks` gives it.
    shown : what each picture shows, for the columns `SHOWN_COLUMNS`; they are left out without.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS if shown is None else (*COLUMNS, *SHOWN_COLUMNS))
        for number, step in enumerate(states):
            view = None if views is None else views[number]
            writer.writerows(_rows(step, network, view, visible[number], None if shown is None else shown[number]))


def visible_centres(step: VehicleStates, view: CameraView, overlay: Overlay | None = None) -> BoolArray:
    """Tell which vehicles have their centre in the image and at most half of the body hidden.

    Parameters
    ----------
    step : n vehicles.
    view : the camera.
    overlay : the occluders; none without.

    Returns
    -------
    (n,).
    """
    visible = view.contains(step.centre_m)
    if overlay is not None and not overlay.is_empty:
        visible[visible] = hidden_shares(step, np.flatnonzero(visible), view, overlay) <= HIDDEN_SHARE
    return visible


def _rows(
    step: VehicleStates, network: RoadNetwork, view: CameraView | None, visible: BoolArray, shown: Shown | None
) -> Iterator[tuple[object, ...]]:
    positions, poses = network.locate(step.centre_m), step.poses()
    told = {} if shown is None else _told(shown)
    rows = range(len(step.ids)) if view is None else np.flatnonzero(view.touches(step)).tolist()
    nothing = () if shown is None else ("0", *("",) * 4)
    for row in sorted({*rows, *told}):
        road, lane = positions.road[row], positions.lane[row]
        yield (
            step.t_us,
            step.ids[row],
            step.classes[row],
            *written(poses[row]),
            network.roads[road].id if road >= 0 else "",
            network.lanes[lane].id if lane >= 0 else "",
            int(visible[row]),
            *told.get(row, nothing),
        )


def _told(shown: Shown) -> dict[int, tuple[str, ...]]:
    return {
        row: (f"{share:.3f}", *(f"{edge:.1f}" for edge in box_px))
        for row, share, box_px in zip(shown.rows.tolist(), shown.share.tolist(), shown.box_px.tolist(), strict=True)
    }
