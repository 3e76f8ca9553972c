"""How fast are scenes drawn, and how does that compare with encoding alone?

Run from the repository: `python -m benchmarks.bench_render`. A short clip of each camera is drawn and encoded as
`dyknow generate` does it. On a busy machine read the last column: the same pictures, already drawn, are encoded in
between, so a neighbour slows both down.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.cameras import CameraKind, camera_path
from data_gen.drawing.render import SceneRenderer
from data_gen.drawing.video import VideoWriter
from data_gen.outputs.scene import plan_world
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.simulate import simulate
from data_gen.simulation.states import VehicleStates
from gis.roads.sumo_net import read_sumo_net

SIZE_PX = (1280, 720)
FRAMES = 50
ROUNDS = 3
STEP_US = 40_000
CASES: tuple[tuple[str, CameraKind], ...] = (
    ("rural_overtaking", "vertical"),
    ("junction", "vertical"),
    ("rural_overtaking", "uav"),
    ("junction", "oblique"),
)


def main() -> None:
    print(f"{'720p':<30}{'frames/s':>10}{'encoding alone':>16}{'ratio':>8}")
    for scenario, camera in CASES:
        drawn_s, encoded_s = case(scenario, camera)
        drawn_hz, encoded_hz = FRAMES / drawn_s, FRAMES / encoded_s
        print(f"{scenario + ', ' + camera:<30}{drawn_hz:>10.0f}{encoded_hz:>16.0f}{drawn_hz / encoded_hz:>8.2f}")


def case(scenario: str, camera: CameraKind) -> tuple[float, float]:
    """Take the median over rounds of drawing with encoding, and of encoding alone, in seconds for all frames."""
    states, renderer = prepare(scenario, camera)
    pictures = [renderer.frame(step, number) for number, step in enumerate(states)]
    drawn_s, encoded_s = [], []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(ROUNDS):
            path = Path(folder) / f"{number}.mp4"
            drawn_s.append(seconds(path, lambda place: renderer.frame(states[place], place)))
            encoded_s.append(seconds(path, lambda place: pictures[place]))
    return float(np.median(drawn_s)), float(np.median(encoded_s))


def prepare(scenario: str, camera: CameraKind) -> tuple[tuple[VehicleStates, ...], SceneRenderer]:
    plan = scenario_named(scenario)
    rngs = np.random.default_rng(1).spawn(4)
    states = simulate(plan, seed=1, rng=rngs[0], duration_us=FRAMES * STEP_US, step_us=STEP_US)
    t_us = np.array([step.t_us for step in states])
    path = camera_path(camera, plan.view, SIZE_PX, t_us=t_us, rng=rngs[1])
    world = plan_world(plan, read_sumo_net(plan.network_file), path, rngs[2])
    return states, SceneRenderer(world, path, rngs[3])


def seconds(path: Path, picture: Callable[[int], NDArray[np.uint8]]) -> float:
    start_s = time.perf_counter()
    with VideoWriter(path, SIZE_PX, 1_000_000 // STEP_US) as video:
        for place in range(FRAMES):
            video.write(picture(place))
    return time.perf_counter() - start_s


if __name__ == "__main__":
    main()
