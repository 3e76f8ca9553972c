"""What do monitors cost? Five monitors of every car, and one of every pair of cars, over 20 s at 25 frames a second.

Run from the root of the repository: ``python -m benchmarks.bench_monitors``
"""

import time

import numpy as np

from dyknow.monitors.monitors import Monitors
from dyknow.mtl.formula import Monitor
from dyknow.mtl.parser import parse_monitors
from dyknow.mtl.progression.states import DictState

OF_CARS = parse_monitors("""
monitor limit per ?car in Car: always tolerate(speed[?car] < 80 km/h, 1s, 500ms)
monitor on per ?car in Car: always on_road[?car]
monitor goes_on per ?car in Car: always (not moving[?car] implies eventually[0s, 1min] moving[?car])
monitor starts per ?car in Car: eventually[0s, 10s] moving[?car]
monitor settles per ?car in Car:
  always (not moving[?car] implies eventually[0s, 10s] always[0s, 2s] moving[?car])
""")
OF_PAIRS = parse_monitors("""
monitor apart per ?a in Car, ?b in Car: always (beside[?a, ?b] implies eventually[0s, 10s] not beside[?a, ?b])
""")
FRAMES, FRAME_US = 500, 40_000


def states_of(cars: int) -> list[DictState]:
    """Draw cars that change lanes, stop and go now and then; each is near the three that come after it."""
    rng = np.random.default_rng(1)
    names = [f"car{k}" for k in range(cars)]
    values: dict[tuple[str, tuple[str, ...]], object] = {}
    for k, name in enumerate(names):
        values["moving", (name,)] = values["on_road", (name,)] = True
        for other in names[k + 1 : k + 4]:
            values["beside", (name, other)] = values["beside", (other, name)] = False
    turning = [key for key in values if key[0] != "on_road"]
    states = []
    for _ in range(FRAMES):
        speeds_mps = rng.uniform(15, 24, cars).tolist()
        values = values | {("speed", (name,)): speed for name, speed in zip(names, speeds_mps, strict=True)}
        for at in rng.integers(len(turning), size=cars // 10).tolist():
            values[turning[at]] = not values[turning[at]]
        states.append(DictState(values, {"Car": names}))
    return states


def measure(title: str, definitions: tuple[Monitor, ...], cars: int) -> None:
    """Run monitors over all frames and print the time for one."""
    monitors = Monitors(definitions, calm_us=1_000_000)
    costs_ms = []
    for k, state in enumerate(states_of(cars)):
        start_s = time.process_time()
        monitors.update(k * FRAME_US, state)
        costs_ms.append(1000 * (time.process_time() - start_s))
    events = sum(one.violated + one.satisfied for one in monitors.report())
    mean_ms = sum(costs_ms) / len(costs_ms)
    print(f"{title:32} {mean_ms:6.2f} {max(costs_ms):7.2f} {1000 / mean_ms / 25:6.0f}x {events:6}")


def main() -> None:
    """Print milliseconds a frame, mean and worst, how that compares with 25 frames a second, and the events told."""
    print(f"{'':32} {'mean':>6} {'worst':>7} {'live':>7} {'events':>6}")
    measure("5 monitors of each of 20 cars", OF_CARS, 20)
    measure("5 monitors of each of 100 cars", OF_CARS, 100)
    measure("1 monitor of each pair of 20", OF_PAIRS, 20)
    measure("1 monitor of each pair of 100", OF_PAIRS, 100)


if __name__ == "__main__":
    main()
