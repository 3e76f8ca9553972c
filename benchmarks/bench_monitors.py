"""What do monitors cost? Of every car, of every pair of cars, and nested ones of values that flicker; 20 s at 25 Hz.

Run from the root of the repository: ``python -m benchmarks.bench_monitors``
"""

import time
from collections.abc import Sequence

import numpy as np

from dyknow.mtl.formula import Monitor
from dyknow.mtl.monitors import Monitors
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
NESTED = parse_monitors("""
monitor back per ?car in Car: always (not moving[?car] implies eventually[0s, 1s] always[0s, 1s] moving[?car])
monitor settles per ?car in Car: always (not moving[?car] implies eventually[0s, 10s] always[0s, 2s] moving[?car])
monitor yields per ?car in Car:
  always (near[?car] implies eventually[0s, 3s] (not moving[?car] or always[0s, 1s] not near[?car]))
monitor waits per ?car in Car:
  always (on_road[?car] implies (moving[?car] until[0s, 20s] always[0s, 1s] near[?car]))
monitor keeps per ?car in Car:
  always (near[?car] implies always[1s, 2s] (near[?car] implies eventually[0s, 1s] moving[?car]))
monitor steady per ?car in Car: always tolerate(moving[?car], 2s, 500ms)
monitor both per ?car in Car:
  always (eventually[0s, 5s] always[0s, 1s] moving[?car] and eventually[0s, 5s] always[0s, 1s] not near[?car])
monitor meets per ?car in Car: always (moving[?car] implies eventually[2s, 5s] near[?car])
monitor rests per ?car in Car:
  always (moving[?car] implies eventually[1s, 10s] always[0s, 500ms] (near[?car] or moving[?car]))
monitor returns per ?car in Car:
  always (not on_road[?car] implies
    eventually[0s, 2s] always[0s, 1s] (on_road[?car] and eventually[0s, 1s] moving[?car]))
""")
FRAMES, FRAME_US, UNEVEN_US = 500, 40_000, 2_000


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


def flickering_states(cars: int, flipped: float) -> list[DictState]:
    """Draw cars of which each value is flipped with a probability in each frame."""
    rng = np.random.default_rng(1)
    names = [f"car{k}" for k in range(cars)]
    values = {name: rng.random(cars) < 0.5 for name in ("moving", "on_road", "near")}
    states = []
    for _ in range(FRAMES):
        values = {name: old ^ (rng.random(cars) < flipped) for name, old in values.items()}
        rows = {
            (name, (car,)): one for name, row in values.items() for car, one in zip(names, row.tolist(), strict=True)
        }
        states.append(DictState(rows, {"Car": names}))
    return states


def measure(title: str, definitions: tuple[Monitor, ...], states: Sequence[DictState]) -> None:
    """Run monitors over all frames, which come a little unevenly as those of a video do, and print the time for one."""
    monitors = Monitors(definitions, calm_us=1_000_000)
    times_us = np.arange(len(states)) * FRAME_US + np.random.default_rng(2).integers(UNEVEN_US, size=len(states))
    costs_ms = []
    for t_us, state in zip(times_us.tolist(), states, strict=True):
        start_s = time.process_time()
        monitors.update(t_us, state)
        costs_ms.append(1000 * (time.process_time() - start_s))
    events = sum(one.violated + one.satisfied for one in monitors.report())
    mean_ms = sum(costs_ms) / len(costs_ms)
    print(f"{title:34} {mean_ms:6.2f} {max(costs_ms):7.2f} {1000 / mean_ms / 25:6.0f}x {events:6}")


def main() -> None:
    """Print milliseconds a frame, mean and worst, how that compares with 25 frames a second, and the events told."""
    print(f"{'':34} {'mean':>6} {'worst':>7} {'live':>7} {'events':>6}")
    measure("5 monitors of each of 20 cars", OF_CARS, states_of(20))
    measure("5 monitors of each of 100 cars", OF_CARS, states_of(100))
    measure("1 monitor of each pair of 20", OF_PAIRS, states_of(20))
    measure("1 monitor of each pair of 100", OF_PAIRS, states_of(100))
    for flipped in (0.0, 0.01, 0.1):
        title = f"10 nested of each of 100, {flipped:.0%} flip"
        measure(title, NESTED, flickering_states(100, flipped))


if __name__ == "__main__":
    main()
