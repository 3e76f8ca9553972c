"""Is who drives behind told to be behind, and who comes to be oncoming, also where cars turn? Told against driven.

Truth: a will drive over the place where b is now, going the same way there, within 33 m of its own path (that of the
simulation, no map is asked), and their lengths do not overlap along it. `following`: b is also the first one there, and
less than 3 s away. For each relation and kind of pair, by headings and with the lane graph in one run:

* *told*: the part of true pairs for which the relation holds, twice a second, changes dated back as they are told.
* *opposite*: the part of true pairs that are told to be the other way round.
* *false*: the part of what is told where a does not come within 2.5 m of the place on its next 78 m. Cars on
  neighbouring lanes count here for `behind`, which they are by its meaning: it is to be compared, not read alone.

`oncoming` is true of two that will meet (`benchmarks.true_meetings`) in 3 s as fast as they are now, and untrue of two
that will not; by the margins of the relation nobody is asked about those who will meet in 2.6 to 3.4 s, nor about those
of whom the truth ends too soon to know. Who is neither on a road nor in a junction is parked. *Agreement* is the
harmonic mean of the part of true pairs that is told and of the part of told pairs that is not false.

Run with ``python -m benchmarks.evaluate_routes [--scenarios junction] [--seeds 1,2] [--seconds 60] [--noise-m 0.1]``.
"""

import argparse
import tempfile
import time
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

import numpy as np
import shapely
import shapely.ops
from numpy.typing import NDArray

from benchmarks.true_meetings import TrueMeetings
from data_gen.outputs.track_scene import make_track_scene
from data_gen.outputs.trajectories import TrackFaults, disturb
from gis.roads.lane_graph import LaneGraph
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from qsr.measuring.footprints import Footprints, on_roads
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
# (relation, a, b): times and values, as told.
Told = dict[tuple[str, str, str], tuple[list[int], list[bool]]]

SCENARIOS = ("junction", "roundabout", "urban_grid")
SEEDS = "1,2,3,4,5"
NAMES = ("behind", "following", "oncoming")
KINDS = ("one road", "road and junction", "two roads", "both in junction")
BY = ("headings", "routes")
EVERY, RATE_HZ = 5, 10
FARTHEST_M, CLEAR_M = 33.0, 1.0
DRIVES_OVER_M, PASSES_BY_M = 1.5, 2.5
SAME_WAY_RAD = np.pi / 4
SETTINGS = RelationSettings()
FOLLOWING_S = SETTINGS.following_s - 2 * SETTINGS.time_gap_margin_s
ONCOMING_S, NOT_ONCOMING_S = (SETTINGS.oncoming_s + sign * 2 * SETTINGS.oncoming_margin_s for sign in (-1, 1))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenarios", default=",".join(SCENARIOS))
    parser.add_argument("--seeds", default=SEEDS)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--noise-m", type=float, default=0.0)
    arguments = parser.parse_args()
    seeds = [int(seed) for seed in arguments.seeds.split(",")]
    print(f"seeds {arguments.seeds}, {arguments.seconds} s each, noise {arguments.noise_m:g} m")
    print(f"{'':<48}   told by headings, routes   opposite          false")
    for scenario in arguments.scenarios.split(","):
        counts: Counter[tuple[str, ...]] = Counter()
        ratios = []
        for seed in seeds:
            network, frames, truth = traffic(scenario, seed, arguments.seconds, arguments.noise_m)
            told, ratio = observe(network, frames)
            ratios.append(ratio)
            for by, values in zip(BY, told, strict=True):
                counts += score(values, truth, by)
        for name in NAMES:
            for kind in KINDS:
                print(line(counts, scenario, name, kind))
        print(f"{scenario:<12} oncoming, all pairs: {agreement(counts)}")
        print(f"{scenario:<12} frames cost {median(ratios):.2f} times as much with routes", flush=True)


def traffic(
    scenario: str, seed: int, seconds: int, noise_m: float
) -> tuple[RoadNetwork, list[Footprints], list[Footprints]]:
    """Simulate; give the frames that are observed and the true ones."""
    with tempfile.TemporaryDirectory(prefix="routes_") as folder:
        scene = make_track_scene(
            scenario, seed=seed, duration_us=seconds * 1_000_000, out_dir=Path(folder), rate_hz=RATE_HZ
        )
        network = read_sumo_net(scene.folder / "network.net.xml")
    faults = TrackFaults(position_sigma_m=noise_m, heading_sigma_rad=noise_m / 10.0, speed_sigma_mps=noise_m)
    noisy = disturb(scene.rows, faults, seed=seed).rows
    frames, truth = (list(frames_of(network, rows.t_us, rows.vehicles, rows.values)) for rows in (noisy, scene.rows))
    return network, frames, truth


def frames_of(
    network: RoadNetwork, t_us: NDArray[np.int64], vehicles: Sequence[str], values: FloatArray
) -> Iterator[Footprints]:
    for start, end in zip(*_runs(t_us), strict=True):
        x_m, y_m, heading_rad, speed_mps, length_m, width_m = values[start:end].T
        centre_m = np.column_stack((x_m, y_m))
        at = network.locate(centre_m)
        yield Footprints.of(
            t_us=int(t_us[start]),
            ids=tuple(vehicles[start:end]),
            centre_m=centre_m,
            heading_rad=heading_rad,
            speed_mps=speed_mps,
            length_m=length_m,
            width_m=width_m,
            **on_roads(at),
        )


def _runs(t_us: NDArray[np.int64]) -> tuple[list[int], list[int]]:
    starts = np.flatnonzero(np.diff(t_us, prepend=t_us[0] - 1)).tolist()
    return starts, [*starts[1:], len(t_us)]


def observe(network: RoadNetwork, frames: Sequence[Footprints]) -> tuple[list[Told], float]:
    """Run the relations both ways, frame by frame in turn; give what each tells, and the ratio of the median costs."""
    roads, junctions = [road.id for road in network.roads], [one.id for one in network.junctions]
    graphs = None, LaneGraph(network, keep_lanes=True)
    observers = [RelationObserver(roads, junctions, graph=graph) for graph in graphs]
    costs_s: list[list[float]] = [[], []]
    told: list[Told] = [defaultdict(lambda: ([], [])) for _ in BY]
    for frame in frames:
        for observer, spent_s, values in zip(observers, costs_s, told, strict=True):
            start_s = time.thread_time()
            changes = observer.observe(frame)
            spent_s.append(time.thread_time() - start_s)
            for change in changes:
                if change.name in NAMES:
                    told_us, told_values = values[change.name, change.args[0], change.args[1]]
                    told_us.append(change.t_us)
                    told_values.append(change.new is True)
    return told, median(costs_s[1]) / median(costs_s[0])


def score(told: Told, truth: Sequence[Footprints], by: str) -> Counter[tuple[str, ...]]:
    """Count true pairs, those that are told, those told the other way round, and false ones."""
    counts: Counter[tuple[str, ...]] = Counter()
    paths, meetings = _paths(truth), TrueMeetings(truth)
    for frame in truth[::EVERY]:
        for name, asked, is_true, is_untrue in [*_behind(frame, paths), _oncoming(frame, meetings)]:
            for row, column in np.argwhere(asked).tolist():
                one, other = frame.ids[row], frame.ids[column]
                is_told, is_right = _holds(told, (name, one, other), frame.t_us), bool(is_true[row, column])
                is_opposite = name != "oncoming" and is_right and _holds(told, (name, other, one), frame.t_us)
                is_false = is_told and bool(is_untrue[row, column])
                for what, holds in (
                    ("true", is_right),
                    ("right", is_right and is_told),
                    ("opposite", is_opposite),
                    ("told", is_told),
                    ("false", is_false),
                ):
                    counts[by, name, _kind(frame, row, column), what] += holds
    return counts


# Of a relation: (n, n) which pairs to ask about, for which it is true, and for which untrue.
Truth = tuple[str, BoolArray, BoolArray, BoolArray]


def _behind(frame: Footprints, paths: dict[str, tuple[list[int], FloatArray]]) -> Iterator[Truth]:
    along_m, off_m, is_over = _ways(frame, paths)
    half_m = (frame.length_m[:, None] + frame.length_m) / 2
    behind = is_over & (along_m > half_m + CLEAR_M) & (along_m <= FARTHEST_M)
    gap_s = (along_m - half_m) / np.maximum(frame.speed_mps, 0.1)[:, None]
    is_first = along_m == np.where(is_over, along_m, np.inf).min(axis=1, keepdims=True, initial=np.inf)
    is_soon = (gap_s < FOLLOWING_S) & (frame.speed_mps > SETTINGS.moving_mps + SETTINGS.moving_margin_mps)[:, None]
    asked = (_apart_m(frame) < SETTINGS.enter_radius_m) & ~np.eye(len(frame.ids), dtype=bool)
    for name, is_true in (("behind", behind), ("following", behind & is_first & is_soon)):
        yield name, asked, is_true, off_m > PASSES_BY_M


def _oncoming(frame: Footprints, meetings: TrueMeetings) -> Truth:
    to_drive_m, left_m = meetings.distances_m(frame)
    closing_mps = frame.speed_mps[:, None] + frame.speed_mps
    is_true = (to_drive_m > CLEAR_M) & (to_drive_m < ONCOMING_S * closing_mps)
    late_m = NOT_ONCOMING_S * closing_mps + CLEAR_M
    is_untrue = (to_drive_m > late_m) & (left_m >= late_m)
    is_driver = (frame.road >= 0) | (frame.junction >= 0)
    asked = np.triu((is_true | is_untrue) & is_driver[:, None] & is_driver, 1)
    return "oncoming", asked & (_apart_m(frame) < SETTINGS.oncoming_enter_m), is_true, is_untrue


def _apart_m(frame: Footprints) -> FloatArray:
    apart_m: FloatArray = np.hypot(*(frame.centre_m[:, None] - frame.centre_m).T)
    return apart_m


def _paths(truth: Sequence[Footprints]) -> dict[str, tuple[list[int], FloatArray]]:
    points: dict[str, tuple[list[int], list[FloatArray]]] = defaultdict(lambda: ([], []))
    for frame in truth:
        for row, one in enumerate(frame.ids):
            points[one][0].append(frame.t_us)
            points[one][1].append(frame.centre_m[row])
    return {one: (times_us, np.array(at_m)) for one, (times_us, at_m) in points.items()}


def _ways(
    frame: Footprints, paths: dict[str, tuple[list[int], FloatArray]]
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Measure along each car's path to each car's place, how far off it that is (nan where nobody knows); is it met?"""
    count = len(frame.ids)
    along_m, off_m = np.full((count, count), np.nan), np.full((count, count), np.nan)
    is_met = np.zeros((count, count), dtype=bool)
    points = shapely.points(frame.centre_m)
    for row, one in enumerate(frame.ids):
        times_us, at_m = paths[one]
        path = shapely.LineString(np.vstack([at_m[times_us.index(frame.t_us) :], at_m[-1:]]))
        near = shapely.ops.substring(path, 0.0, FARTHEST_M + SETTINGS.leave_radius_m)
        if not path.length:
            continue
        along_m[row] = shapely.line_locate_point(near, points)
        off_m[row] = shapely.distance(near, points)
        behind, before = (
            shapely.get_coordinates(shapely.line_interpolate_point(near, along_m[row] + step_m))
            for step_m in (-1.0, 1.0)
        )
        way_rad = np.arctan2(*(before - behind).T[::-1])
        turned_rad = np.abs(np.angle(np.exp(1j * (way_rad - frame.heading_rad))))
        is_met[row] = (off_m[row] <= DRIVES_OVER_M) & (turned_rad < SAME_WAY_RAD) & (along_m[row] > 0.0)
        if path.length < FARTHEST_M + SETTINGS.leave_radius_m:
            off_m[row] = np.nan
    return along_m, off_m, is_met


def _kind(frame: Footprints, row: int, column: int) -> str:
    one, other = int(frame.road[row]), int(frame.road[column])
    if one < 0 or other < 0:
        return "both in junction" if one == other else "road and junction"
    return "one road" if one == other else "two roads"


def _holds(told: Told, key: tuple[str, str, str], t_us: int) -> bool:
    times_us, values = told.get(key, ((), ()))
    place = bisect_right(times_us, t_us)
    return place > 0 and values[place - 1]


def line(counts: Counter[tuple[str, ...]], scenario: str, name: str, kind: str) -> str:
    """Write one row of the table."""
    shares = [
        (counts[by, name, kind, what], counts[by, name, kind, of])
        for what, of in (("right", "true"), ("opposite", "true"), ("false", "told"))
        for by in BY
    ]
    text = " ".join(f"{part / whole:8.3f}" if whole else f"{'-':>8}" for part, whole in shares)
    return f"{scenario:<11} {name:<10} {kind:<18} {counts[BY[0], name, kind, 'true']:>6} {text}"


def agreement(counts: Counter[tuple[str, ...]]) -> str:
    """Say how far `oncoming` and its truth agree, by headings and with routes."""
    texts = []
    for by in BY:
        true, right, told, false = (
            sum(counts[by, "oncoming", kind, what] for kind in KINDS) for what in ("true", "right", "told", "false")
        )
        texts.append(
            f"{by} {right / true:.3f} of {true} told, {false / told:.3f} of {told} false, "
            f"agreement {2 * right / (true + told):.3f}"
        )
    return "; ".join(texts)


if __name__ == "__main__":
    main()
