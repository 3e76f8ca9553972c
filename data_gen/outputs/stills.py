"""How are single pictures of a scene made, without a video? Each with its vehicles, and what it shows of them.

For detectors that are trained on synthetic pictures: the traffic is simulated once, and only the times asked for are
drawn. The pictures are those of a video of the same seed, but for the noise of the sensor.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from data_gen.drawing.cameras import CameraKind, camera_path
from data_gen.drawing.occluders import occluder_kinds
from data_gen.drawing.render import SceneRenderer
from data_gen.drawing.sun import Weather
from data_gen.drawing.traffic.shown import Shown, ShownCounter
from data_gen.drawing.view import CameraView
from data_gen.errors import DataGenError
from data_gen.outputs.scene import plan_world
from data_gen.scenarios.catalogue import NO_OPTIONS, scenario_named
from data_gen.simulation.simulate import check_seed, simulate
from data_gen.simulation.states import ByteArray, VehicleStates
from gis.roads.sumo_net import read_sumo_net

_STEP_US = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """One picture and what is on it."""

    picture: ByteArray
    """(h, w, 3), blue, green, red."""
    states: VehicleStates
    """Vehicles at its time, those out of view included."""
    view: CameraView
    shown: Shown | None
    """Boxes and visible shares; None for the camera straight above."""


def draw_stills(
    scenario: str,
    *,
    seed: int,
    count: int,
    every_us: int = 2_000_000,
    camera: CameraKind = "mast",
    size_px: tuple[int, int] = (1280, 720),
    weather: Weather = "sunny",
    occluders: Sequence[str] = (),
    options: Mapping[str, str] = NO_OPTIONS,
) -> Iterator[Still]:
    """Draw some pictures of a scene.

    Parameters
    ----------
    scenario, seed, camera, weather, occluders, options : as `data_gen.outputs.scene.generate` takes them.
    count : pictures, at least one.
    every_us : between two of them, a multiple of 100 ms.
    size_px : width and height, both even.

    Yields
    ------
    The pictures in order of time.

    Raises
    ------
    DataGenError
        If an argument is out of range.

    Examples
    --------
    >>> still = next(draw_stills("rural_overtaking", seed=3, count=1, size_px=(320, 180)))
    >>> still.picture.shape, len(still.shown.rows) == len(still.shown.box_px)
    ((180, 320, 3), True)
    """
    if count < 1 or every_us <= 0 or every_us % _STEP_US:
        expected = f"at least one picture, a multiple of {_STEP_US} us apart"
        raise DataGenError(f"stills: expected {expected}, got {count!r} pictures {every_us!r} us apart")
    check_seed(seed)
    plan = scenario_named(scenario, options)
    traffic_rng, scenery_rng, camera_rng, picture_rng, *_ = np.random.default_rng(np.random.SeedSequence(seed)).spawn(6)
    duration_us = (count - 1) * every_us + _STEP_US
    states = simulate(plan, seed=seed, rng=traffic_rng, duration_us=duration_us, step_us=_STEP_US)[
        :: every_us // _STEP_US
    ]
    network = read_sumo_net(plan.network_file)
    t_us = np.array([step.t_us for step in states])
    path = camera_path(camera, plan.view, size_px, t_us=t_us, rng=camera_rng, network=network)
    world = plan_world(plan, network, path, scenery_rng, weather=weather, occluders=occluder_kinds(occluders))
    renderer = SceneRenderer(world, path, picture_rng)
    counter = None if path.track is None else ShownCounter(path, world.overlay, world.standing)
    for number, step in enumerate(states):
        picture = cv2.cvtColor(renderer.frame(step, number), cv2.COLOR_YUV2BGR_I420)
        view = path.views[number]
        yield Still(
            np.asarray(picture, dtype=np.uint8), step, view, None if counter is None else counter.look(step, view)
        )
