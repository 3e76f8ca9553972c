"""Where was every vehicle in view, exactly? Writes `truth.csv`."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from data_gen.states import VehicleStates
from data_gen.view import CameraView
from gis.road_network import RoadNetwork

COLUMNS = (
    *("t_us", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"),
    *("road", "lane", "visible"),
)


def write_truth(path: Path, states: Sequence[VehicleStates], network: RoadNetwork, view: CameraView) -> None:
    """Write one row for each vehicle in view at each step.

    Parameters
    ----------
    path : the file; columns as in `COLUMNS`. x, y is the centre of the body, road and lane are those under it (empty
        off the road), `visible` is 1 if the centre is in the image and 0 if only some of the body is.
    states : in order of time.
    network : gives road and lane.
    view : decides what is in view.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for step in states:
            writer.writerows(_rows(step, network, view))


def _rows(step: VehicleStates, network: RoadNetwork, view: CameraView) -> Iterator[tuple[object, ...]]:
    positions = network.locate(step.centre_m)
    visible = view.contains(step.centre_m)
    for row in np.flatnonzero(view.touches(step)):
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
