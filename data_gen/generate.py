"""How is a synthetic scene made? Simulation, truth, video and site file, into one folder."""

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_gen.errors import DataGenError
from data_gen.motion import centres_in_view, tabulate
from data_gen.render import SceneRenderer
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulate import check_seed, simulate
from data_gen.truth import write_truth
from data_gen.truth_events import ROLES, TruthEvent, find_events
from data_gen.video import VideoWriter
from data_gen.view import CameraView, camera_over
from gis.sumo_net import read_sumo_net

_SITE = """\
name = {name}
start_utc = 2026-05-01T08:00:00Z

[frame]
origin_lat_deg = 58.4
origin_lon_deg = 15.6

[network]
sumo = "{network}"

[camera]
# Ground metres (east, north, 1) from pixels (right, down, 1), row by row.
homography = [
{rows}
]
"""


@dataclass(frozen=True, slots=True)
class GeneratedScene:
    """The files of a scene and what happens in it."""

    video: Path
    site: Path
    network: Path
    truth: Path
    truth_events: Path
    frame_count: int
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
    progress: Callable[[int, int], None] | None = None,
) -> GeneratedScene:
    """Make a scene: the same arguments give the same bytes.

    Parameters
    ----------
    scenario : a name of `data_gen.scenarios.catalogue`.
    seed : 0 to 2**31 - 1; fixes traffic, scenery, light and noise. A longer clip begins with the shorter one's traffic.
    duration_us : length of the clip.
    out_dir : made if it is missing; files of an earlier scene in it are replaced.
    width_px, height_px : size of the image, both even, at least 64.
    rate_hz : frames per second, from 10 up, a divisor of 1000, so that a frame lasts whole milliseconds.
    progress : called after each frame with the number of frames done and their total.

    Returns
    -------
    The files written: `video.mp4`, `site.toml`, `network.net.xml`, `truth.csv`, `truth_events.jsonl`.

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
    plan = scenario_named(scenario)
    step_us = _step_us(rate_hz)
    _check_size(width_px, height_px)
    check_seed(seed)
    traffic_rng, scenery_rng = np.random.default_rng(np.random.SeedSequence(seed)).spawn(2)
    states = simulate(plan, seed=seed, rng=traffic_rng, duration_us=duration_us, step_us=step_us)
    network = read_sumo_net(plan.network_file)
    view = camera_over(plan.view, (width_px, height_px))
    motion = tabulate(states, network)
    scene = _scene(out_dir, len(states), find_events(motion, centres_in_view(motion, states, view)))
    out_dir.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(plan.network_file, scene.network)
    write_truth(scene.truth, states, network, view)
    _write_events(scene.truth_events, scene.events)
    renderer = SceneRenderer(network, view.camera, view.size_px, scenery_rng)
    with VideoWriter(scene.video, view.size_px, rate_hz) as video:
        for number, step in enumerate(states, start=1):
            video.write(renderer.frame(step))
            if progress is not None:
                progress(number, len(states))
    # Last: a folder with a site file is complete.
    scene.site.write_text(_site_text(f"{scenario} seed {seed}", scene.network, view), encoding="utf-8")
    return scene


def _step_us(rate_hz: int) -> int:
    if rate_hz < 10 or 1000 % rate_hz:
        raise DataGenError(f"rate: expected a divisor of 1000 from 10 up, in frames per second, got {rate_hz!r}")
    return 1_000_000 // rate_hz


def _check_size(width_px: int, height_px: int) -> None:
    for name, size_px in (("width", width_px), ("height", height_px)):
        if size_px < 64 or size_px % 2:
            raise DataGenError(f"image {name}: expected an even number of pixels from 64 up, got {size_px!r}")


def _scene(out_dir: Path, frame_count: int, events: tuple[TruthEvent, ...]) -> GeneratedScene:
    return GeneratedScene(
        video=out_dir / "video.mp4",
        site=out_dir / "site.toml",
        network=out_dir / "network.net.xml",
        truth=out_dir / "truth.csv",
        truth_events=out_dir / "truth_events.jsonl",
        frame_count=frame_count,
        events=events,
    )


def _write_events(path: Path, events: Sequence[TruthEvent]) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(_event_body(event)) + "\n" for event in events)


def _event_body(event: TruthEvent) -> dict[str, object]:
    return {
        "type": event.type,
        "roles": dict(zip(ROLES[event.type], (event.actor, event.other), strict=True)),
        "start_us": event.start_us,
        "end_us": event.end_us,
        "countable": event.countable,
        "why_not_countable": event.why_not_countable,
        "manoeuvre_start_us": event.manoeuvre_start_us,
        "manoeuvre_end_us": event.manoeuvre_end_us,
    }


def _site_text(name: str, network: Path, view: CameraView) -> str:
    rows = ",\n".join(f"  {row!r}" for row in view.camera.ground_from_pixel.tolist())
    return _SITE.format(name=json.dumps(name), network=network.name, rows=rows)
