"""How do the cars of one frame look as rows, the form in which the log and the monitors take them?"""

from collections.abc import Iterator
from math import isnan

from anchoring.observations import DECIMALS, Cars
from gis.road_network import RoadNetwork
from service.records.seen import CarState


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
