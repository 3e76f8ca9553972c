"""How many points a second does `RoadNetwork.locate` place, and how much faster is it than a loop over all lanes?

Run from the repository: `python -m benchmarks.bench_gis`. The slow loop is the oracle of the tests, so the ratio says
what the index and the arrays bring; both run in one process on the same points.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from tests.gis.support import CROSSING_NET, FloatArray, arc, locate_slowly, two_way_along


def main() -> None:
    networks = {
        "crossing, 16 lanes": read_sumo_net(CROSSING_NET),
        "bend, 40 segments": two_way_along(arc(radius_m=200.0, turn_rad=2.0, segments=40)),
        "bend, 100 segments": two_way_along(arc(radius_m=200.0, turn_rad=2.0, segments=100)),
        "grid, 10 x 10 bends": grid(10),
    }
    print(f"{'network':<22}{'bulk points/s':>15}{'us for 20 points':>18}{'slow points/s':>15}{'ratio':>9}")
    for name, network in networks.items():
        points_m = points_on(network, 100_000)
        bulk_hz = len(points_m) / best_s(partial(network.locate, points_m), 5)
        frame_s = best_s(partial(network.locate, points_m[:20]), 300)
        few_m = points_m[: max(4, 2000 // len(network.lanes))]
        slow_hz = len(few_m) / best_s(partial(locate_each_slowly, network, few_m), 2)
        print(f"{name:<22}{bulk_hz:>15,.0f}{frame_s * 1e6:>18.0f}{slow_hz:>15,.0f}{bulk_hz / slow_hz:>9,.0f}")


def locate_each_slowly(network: RoadNetwork, points_m: FloatArray) -> None:
    for point_m in points_m:
        locate_slowly(network, point_m, 0.0)


def grid(size: int) -> RoadNetwork:
    bends = [
        two_way_along(arc(radius_m=100.0, turn_rad=1.2, segments=12) + 150.0 * np.array([x, y]), f"{x}-{y}")
        for x in range(size)
        for y in range(size)
    ]
    return RoadNetwork([lane for bend in bends for lane in bend.lanes])


def points_on(network: RoadNetwork, count: int) -> FloatArray:
    """Scatter points over lane vertices: most on a road, as cars are, some beside it."""
    rng = np.random.default_rng(1)
    starts_m = np.vstack([lane.centre_line_m[:-1] for lane in network.lanes])
    ends_m = np.vstack([lane.centre_line_m[1:] for lane in network.lanes])
    segment = rng.integers(0, len(starts_m), count)
    on_line_m = starts_m[segment] + rng.random((count, 1)) * (ends_m - starts_m)[segment]
    return np.asarray(on_line_m + rng.normal(0.0, 1.0, (count, 2)))


def best_s(run: Callable[[], object], repeats: int) -> float:
    """Take the least of several times: on a shared machine the others measure the neighbours."""
    times_s = []
    for _ in range(repeats):
        start_s = time.perf_counter()
        run()
        times_s.append(time.perf_counter() - start_s)
    return min(times_s)


if __name__ == "__main__":
    main()
