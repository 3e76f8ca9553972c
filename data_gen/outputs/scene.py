"""How is a synthetic scene made? Simulation, truth, video and site file, into one folder."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_gen.drawing.cameras import CameraKind, CameraPath, camera_path
from data_gen.drawing.degrade import Degradation, PlannedFrame, plan_frames
from data_gen.drawing.ground.markings import junction_marks, parking_bays, road_markings
from data_gen.drawing.occluders import OccluderKind, occluder_kinds
from data_gen.drawing.render import NOISE_SIGMA, SceneRenderer, World, make_world
from data_gen.drawing.sun import Weather, check_weather
from data_gen.drawing.thermal import ThermalRenderer, thermal_path
from data_gen.drawing.traffic.shown import shown_in
from data_gen.drawing.video import VideoWriter
from data_gen.errors import DataGenError
from data_gen.outputs.site_file import write_site
from data_gen.scenario import Scenario
from data_gen.scenarios.catalogue import NO_OPTIONS, scenario_named
from data_gen.simulation.simulate import check_seed, simulate
from data_gen.simulation.states import VehicleStates
from data_gen.truth.clip import clip_events, visible_masks, write_truth
from data_gen.truth.event import TruthEvent, write_truth_events
from gis.cameras.camera_pose import write_camera_track
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net

Progress = Callable[[int, int], None]

_NO_FAULTS = Degradation()
_LARGEST_PX = 8192  # the ground is painted once in floats, which is gigabytes beyond


@dataclass(frozen=True, slots=True)
class GeneratedScene:
    """The files of a scene and what happens in it."""

    video: Path
    site: Path
    network: Path
    truth: Path
    truth_events: Path
    camera: Path
    """Poses of the camera; there is no such file for the one straight above."""
    thermal: Path
    """Video of the thermal camera; there is no such file without one."""
    frame_count: int
    """Frames of the video."""
    events: tuple[TruthEvent, ...]


def generate(
    scenario: str,
    *,
    seed: int,
    duration_us: int,
    out_dir: Path,
    width_px: int = 1280,
    height_px: int = 720,
    rate_hz: int = 25,
    camera: CameraKind = "vertical",
    poses: bool = False,
    thermal: bool = False,
    weather: Weather = "sunny",
    occluders: Sequence[str] = (),
    degradation: Degradation = _NO_FAULTS,
    options: Mapping[str, str] = NO_OPTIONS,
    progress: Progress | None = None,
) -> GeneratedScene:
    """Make a scene: the same arguments give the same bytes.

    Parameters
    ----------
    scenario : a name of `data_gen.scenarios.catalogue`.
    seed : 0 to 2**31 - 1; fixes traffic, scenery, light and noise. A longer clip begins with the shorter one's traffic.
    duration_us : length of the clip.
    out_dir : made if it is missing; files of an earlier scene in it are replaced.
    width_px, height_px : size of the image, both even, 64 to 8192.
    rate_hz : frames per second, from 10 up, a divisor of 1000, so that a frame lasts whole milliseconds.
    camera : how the scene is filmed; see `data_gen.drawing.cameras.camera_path`.
    poses : tell the site file of the poses of a camera that moves; they are written for every camera that has one.
    thermal : add the video of a thermal camera of half the size.
    weather : "sunny", "clouds" whose shadows drift over the ground, or "overcast" without any shadow.
    occluders : what hides the traffic here and there: "trees", "bridge", "gantry", or "all".
    degradation : faults of the video files.
    options : of the scenario.
    progress : called after each frame with the number of frames done and their total.

    Returns
    -------
    The files written: `video.mp4`, `site.toml`, `network.net.xml`, `truth.csv`, `truth_events.jsonl`; `camera.csv`
    unless the camera looks straight down; `thermal.mp4` if it is asked for.

    Raises
    ------
    DataGenError
        If an argument is out of range or a stage fails; arguments are checked before anything is written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     scene = generate(
    ...         "rural_overtaking", seed=1, duration_us=200_000, out_dir=Path(folder), width_px=320, height_px=180
    ...     )
    ...     sorted(path.name for path in Path(folder).iterdir()), scene.frame_count
    (['network.net.xml', 'site.toml', 'truth.csv', 'truth_events.jsonl', 'video.mp4'], 5)
    """
    plan = scenario_named(scenario, options)
    step_us = _step_us(rate_hz)
    _check_size(width_px, height_px)
    _check_poses(camera, poses=poses)
    check_seed(seed)
    check_weather(weather)
    hung = occluder_kinds(occluders)
    if camera == "mast" and thermal:
        raise DataGenError("camera 'mast': expected no thermal camera, got one")
    # One for each purpose: what one of them draws does not disturb another.
    sources = np.random.default_rng(np.random.SeedSequence(seed)).spawn(6)
    traffic_rng, scenery_rng, camera_rng, picture_rng, thermal_rng, fault_rng = sources
    states = simulate(plan, seed=seed, rng=traffic_rng, duration_us=duration_us, step_us=step_us)
    t_us = np.array([step.t_us for step in states])
    network = read_sumo_net(plan.network_file)
    path = camera_path(camera, plan.view, (width_px, height_px), t_us=t_us, rng=camera_rng, network=network)
    world = plan_world(plan, network, path, scenery_rng, weather=weather, occluders=hung)
    frames = plan_frames(degradation, len(states), step_us=step_us, rng=fault_rng)
    shown = shown_in(states, path, world.overlay, world.standing)
    visible = visible_masks(states, path.views, world.overlay, shown)
    scene = _scene(out_dir, len(frames), clip_events(states, network, visible))
    _begin_folder(scene, plan.network_file)
    write_truth(scene.truth, states, network, path.views, visible, shown=shown)
    write_truth_events(scene.truth_events, scene.events)
    if path.track is not None:
        write_camera_track(scene.camera, path.track)
    side = thermal_path(path, plan.view, (_even(width_px / 2), _even(height_px / 2))) if thermal else None
    noise_sigma = float(np.hypot(NOISE_SIGMA, degradation.noise))
    films: list[tuple[Path, CameraPath, SceneRenderer | ThermalRenderer]] = [
        (scene.video, path, SceneRenderer(world, path, picture_rng, noise_sigma=noise_sigma))
    ]
    if side is not None:
        films.append((scene.thermal, side, ThermalRenderer(world, side, thermal_rng)))
    _film(films, frames, states, rate_hz=rate_hz, crf=degradation.crf, progress=progress)
    # Last: a folder with a site file is complete.
    write_site(
        scene.site,
        name=f"{scenario} seed {seed}",
        network=scene.network,
        path=path,
        poses=scene.camera if poses and path.track is not None else None,
        thermal=None if side is None else (scene.thermal, side),
    )
    return scene


def plan_world(
    plan: Scenario,
    network: RoadNetwork,
    path: CameraPath,
    rng: np.random.Generator,
    *,
    weather: Weather = "sunny",
    occluders: Sequence[OccluderKind] = (),
) -> World:
    """Plan the world of a scenario, marks and parking bays included; the other parameters are those of `make_world`."""
    lanes = {lane.id: lane for lane in network.lanes}
    bays = [parking_bays(lanes[strip.lane], strip) for strip in plan.parking]
    marks = (*road_markings(network), *junction_marks(network, plan.network_file))
    return make_world(network, path, rng, marks=marks, bays=bays, weather=weather, occluders=occluders)


def _begin_folder(scene: GeneratedScene, network_file: Path) -> None:
    scene.video.parent.mkdir(parents=True, exist_ok=True)
    # An earlier scene in the same folder may have had another camera.
    for old in (scene.site, scene.camera, scene.thermal):
        old.unlink(missing_ok=True)
    shutil.copyfile(network_file, scene.network)


def _film(
    films: Sequence[tuple[Path, CameraPath, SceneRenderer | ThermalRenderer]],
    frames: Sequence[PlannedFrame],
    states: Sequence[VehicleStates],
    *,
    rate_hz: int,
    crf: int,
    progress: Progress | None,
) -> None:
    """Film what reaches the files, all of them at once: each with its camera and who draws it."""
    with ExitStack() as stack:
        videos = [
            stack.enter_context(VideoWriter(file, path.views[0].size_px, rate_hz, crf=crf)) for file, path, _ in films
        ]
        for done, frame in enumerate(frames, start=1):
            for (_, _, drawer), video in zip(films, videos, strict=True):
                video.write(drawer.frame(states[frame.shows], frame.shows), frame.number)
            if progress is not None:
                progress(done, len(frames))


def _step_us(rate_hz: int) -> int:
    if rate_hz < 10 or 1000 % rate_hz:
        raise DataGenError(f"rate: expected a divisor of 1000 from 10 up, in frames per second, got {rate_hz!r}")
    return 1_000_000 // rate_hz


def _check_size(width_px: int, height_px: int) -> None:
    for name, size_px in (("width", width_px), ("height", height_px)):
        if not 64 <= size_px <= _LARGEST_PX or size_px % 2:
            expected = f"expected an even number of pixels from 64 to {_LARGEST_PX}"
            raise DataGenError(f"image {name}: {expected}, got {size_px!r}")


def _check_poses(camera: CameraKind, *, poses: bool) -> None:
    if poses and camera != "uav":
        raise DataGenError(f"poses: expected the camera 'uav' for a site file with poses, got {camera!r}")


def _even(value: float) -> int:
    return 2 * round(value / 2)


def _scene(out_dir: Path, frame_count: int, events: tuple[TruthEvent, ...]) -> GeneratedScene:
    return GeneratedScene(
        video=out_dir / "video.mp4",
        site=out_dir / "site.toml",
        network=out_dir / "network.net.xml",
        truth=out_dir / "truth.csv",
        truth_events=out_dir / "truth_events.jsonl",
        camera=out_dir / "camera.csv",
        thermal=out_dir / "thermal.mp4",
        frame_count=frame_count,
        events=events,
    )
