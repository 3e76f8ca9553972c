"""Where was every vehicle in view, exactly? Writes `truth.csv`."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from data_gen.drawing.occlusion.overlay import Overlay, hidden_shares
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import BoolArray, VehicleStates
from gis.road_network import RoadNetwork

COLUMNS = (
    *("t_us", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"),
    *("road", "lane", "visible"),
)

HIDDEN_SHARE = 0.5
"""A vehicle of which occluders hide more than this is not visible."""


def write_truth(
    path: Path,
    states: Sequence[VehicleStates],
    network: RoadNetwork,
    views: Sequence[CameraView] | None,
    overlay: Overlay | None = None,
) -> None:
    """Write one row for each vehicle in view at each step.

    Parameters
    ----------
    path : the file; columns as in `COLUMNS`. x, y is the centre of the body, road and lane are those under it (empty
        off the road), `visible` is 1 if the centre is in the image and at most half of the body is hidden by an
        occluder, else 0.
    states : in order of time.
    network : gives road and lane.
    views : one a step, decide what is in view; None if everything is seen everywhere.
    overlay : the occluders; none without.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for number, step in enumerate(states):
            view = None if views is None else views[number]
            writer.writerows(_rows(step, network, view, overlay))


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
    step: VehicleStates, network: RoadNetwork, view: CameraView | None, overlay: Overlay | None
) -> Iterator[tuple[object, ...]]:
    positions = network.locate(step.centre_m)
    everybody = np.ones(len(step.ids), dtype=np.bool_)
    visible = everybody if view is None else visible_centres(step, view, overlay)
    for row in np.flatnonzero(everybody if view is None else view.touches(step)):
        road, lane = positions.road[row], positions.lane[row]
        yield (
            step.t_us,
            step.ids[row],
            step.classes[row],
            f"{step.centre_m[row, 0]:.3f}",
            f"{step.centre_m[row, 1]:.3f}",
            f"{step.heading_rad[row]:.5f}",
            f"{step.speed_mps[row]:.3f}",
            f"{step.length_m[row]:.2f}",
            f"{step.width_m[row]:.2f}",
            network.roads[road].id if road >= 0 else "",
            network.lanes[lane].id if lane >= 0 else "",
            int(visible[row]),
        )
