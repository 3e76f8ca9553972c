"""How long does it take to say why an overtake was not recognised?

Ten minutes of a hundred cars that drive round a ring and pass each other: relation changes of near pairs, as the
relation stage would give them. `why_not` is timed for one pair of cars and for all of them, `why` for one occurrence.
Prints seconds; the goal is 2 s for `why_not`.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from chronicles import library
from chronicles.events import Event
from chronicles.explanation.why import why
from chronicles.explanation.why_not import why_not
from chronicles.recogniser import recognise

STEP_US = 100_000
RING_M = 2_500.0
NEAR_M = 40.0
HALF_LENGTHS_M = 4.5
RELATIONS = ("behind", "beside", "ahead")


def stream(*, cars: int, minutes: float, seed: int = 1) -> list[Event]:
    """Make the changes of all relations that the overtake looks at."""
    rng = np.random.default_rng(seed)
    names = [f"car{index}" for index in range(cars)]
    events = [Event("on", (name, "ring"), 0, "unknown", "true") for name in names]
    events += [Event("moving", (name,), 0, "unknown", "true") for name in names]
    start_m = rng.uniform(0, RING_M, cars)
    speed_mps = rng.uniform(12, 18, cars)
    before = np.zeros((cars, cars), dtype=int)  # 0 not near, else 1 + the index of the relation that holds
    for step in range(1, round(minutes * 60 * 1_000_000 / STEP_US) + 1):
        t_us = step * STEP_US
        position_m = start_m + speed_mps * t_us / 1e6
        now = _relation(position_m)
        for a, b in zip(*np.nonzero(now != before), strict=True):
            events += _changes(names[a], names[b], t_us, int(before[a, b]), int(now[a, b]))
        before = now
        for index in np.flatnonzero(rng.random(cars) < 0.002):
            events += _stop_and_go(names[index], t_us)
    return sorted(events, key=lambda event: event.t_us)


def _relation(
    position_m: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, int], np.dtype[np.int_]]:
    gap_m = (position_m[:, None] - position_m[None, :] + RING_M / 2) % RING_M - RING_M / 2
    relation = np.select([gap_m < -HALF_LENGTHS_M, gap_m <= HALF_LENGTHS_M], [1, 2], 3)
    relation[np.abs(gap_m) > NEAR_M] = 0
    np.fill_diagonal(relation, 0)
    return relation


def _changes(a: str, b: str, t_us: int, before: int, now: int) -> list[Event]:
    values = [
        (name, *("unknown" if state == 0 else "true" if state == index else "false" for state in (before, now)))
        for index, name in enumerate(RELATIONS, 1)
    ]
    return [Event(name, (a, b), t_us, old, new) for name, old, new in values if old != new]


def _stop_and_go(car: str, t_us: int) -> list[Event]:
    return [
        Event("moving", (car,), t_us, "true", "false"),
        Event("moving", (car,), t_us + 40_000, "false", "true"),
    ]


def seconds(run: Callable[[], object]) -> float:
    """Give the best time of three runs."""
    best = float("inf")
    for _ in range(3):
        start = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - start)
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cars", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=10.0)
    options = parser.parse_args()
    events = stream(cars=options.cars, minutes=options.minutes)
    chronicles = library.load_library(["overtake"])
    found = recognise(chronicles, events)
    missed = why_not(chronicles, "overtake", events)
    roles = {role.name: role.value for role in missed.near_misses[0].roles if role.name != "road"}
    print(f"{len(events):,} changes, {len(events) / options.minutes:,.0f} a minute, {len(found):,} overtakes")
    rows = [
        ("why_not, one pair", lambda: why_not(chronicles, "overtake", events, roles=roles)),
        ("why_not, any cars", lambda: why_not(chronicles, "overtake", events)),
        ("why, one overtake", lambda: why(chronicles, found[0], events)),
        ("recognise, for scale", lambda: recognise(chronicles, events)),
    ]
    for name, run in rows:
        print(f"{name:22} {seconds(run):7.3f} s", flush=True)


if __name__ == "__main__":
    main()
