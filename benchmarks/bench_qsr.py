"""How many frames a second do the relations take, change events included?

Cars drive on two-way roads of four lanes at a fixed density, so the near pairs grow with the number of cars. The slow
version of the tests, which looks at every pair on its own, runs on the same frames; it sees a few frames only.

Run from the root of the repository: ``python -m benchmarks.bench_qsr``
"""

import time
from collections.abc import Callable

import numpy as np

from qsr.changes.crossings import RelationChange
from qsr.changes.line_up import Seen
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from tests.qsr.oracle import Oracle

ROADS = 40
LENGTH_M = 1000.0
CARS_PER_ROAD = 40


def traffic(count: int, frames: int, *, rate_hz: float = 25.0, seed: int = 1) -> list[Footprints]:
    """Drive ``count`` cars round and round on as many roads as they need."""
    rng = np.random.default_rng(seed)
    length_m = LENGTH_M * min(count, CARS_PER_ROAD) / CARS_PER_ROAD
    road = (np.arange(count) // CARS_PER_ROAD).astype(np.int32)
    sign = rng.choice([-1.0, 1.0], count)
    across_m = -sign * rng.choice([1.75, 5.25], count)
    speed_mps = rng.normal(22.0, 4.0, count).clip(8.0)
    along_m = rng.uniform(0.0, length_m, count)
    body = rng.uniform(3.8, 5.0, count)
    heading_rad = np.where(sign > 0, 0.0, np.pi)
    ids = tuple(f"car{k}" for k in range(count))
    result = []
    for frame in range(frames):
        along_m = (along_m + sign * speed_mps / rate_hz) % length_m
        noisy_m = along_m + rng.normal(0.0, 0.1, count)
        across = across_m + rng.normal(0.0, 0.1, count)
        result.append(
            Footprints.of(
                t_us=frame * int(1e6 / rate_hz),
                ids=ids,
                centre_m=np.stack([noisy_m, across + 200.0 * road], axis=1),
                heading_rad=heading_rad,
                speed_mps=speed_mps,
                length_m=body,
                width_m=np.full(count, 1.8),
                road=road,
                along_m=noisy_m,
                across_m=across,
                tangent_rad=np.zeros(count),
                junction=np.full(count, -1, dtype=np.int32),
            )
        )
    return result


def frames_per_s(observe: Callable[[Footprints], list[RelationChange]], frames: list[Footprints]) -> tuple[float, int]:
    """Time all frames after the first, which starts every pair; return the rate and the number of changes."""
    observe(frames[0])
    start_s = time.process_time()
    changes = sum(len(observe(frame)) for frame in frames[1:])
    return (len(frames) - 1) / (time.process_time() - start_s), changes


def many_per_s(observer: RelationObserver, frames: list[Footprints]) -> float:
    """Time all frames, observed 250 at once."""
    start_s = time.process_time()
    for start in range(0, len(frames), 250):
        observer.observe_all([Seen(frame) for frame in frames[start : start + 250]])
    return len(frames) / (time.process_time() - start_s)


def main() -> None:
    settings = RelationSettings()
    road_ids = [f"road{k}" for k in range(ROADS)]
    print(
        f"{'cars':>6} {'near pairs':>10} {'changes/frame':>13} {'frames/s':>9} {'ms/frame':>8} {'many at once/s':>14} "
        f"{'slow one/s':>10} ratio"
    )
    for count, fast_frames, slow_frames in ((10, 1500, 60), (20, 1500, 60), (200, 500, 4), (1000, 120, 2)):
        frames = traffic(count, fast_frames)
        rate, changes = frames_per_s(RelationObserver(road_ids, [], settings).observe, frames)
        at_once = many_per_s(RelationObserver(road_ids, [], settings), frames)
        slow_rate, _ = frames_per_s(Oracle(road_ids, [], settings).observe, frames[:slow_frames])
        row = f"{count:6d} {near_pairs(frames[-1], settings):10d} {changes / (fast_frames - 1):13.1f} {rate:9.0f} "
        print(f"{row}{1e3 / rate:8.2f} {at_once:14.0f} {slow_rate:10.2f} {rate / slow_rate:5.0f}x")


def near_pairs(frame: Footprints, settings: RelationSettings) -> int:
    """Count the unordered pairs within the entry radius."""
    x = frame.centre_m[:, 0] + 1j * frame.centre_m[:, 1]
    half_m = frame.length_m / 2
    return int((np.triu(np.abs(x[:, None] - x) - half_m[:, None] - half_m <= settings.enter_radius_m, 1)).sum())


if __name__ == "__main__":
    main()
