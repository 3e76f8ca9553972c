"""How are tracks made straight from a scenario, or from a scene? Simulation and truth, and no picture."""

import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_gen.drawing.view import camera_over
from data_gen.errors import DataGenError
from data_gen.outputs.site_file import write_site
from data_gen.outputs.trajectories import (
    NoisyTracks,
    TrackFaults,
    TrueRows,
    disturb,
    read_truth_rows,
    rows_of_states,
    write_tracks,
)
from data_gen.scenarios.catalogue import NO_OPTIONS, scenario_named
from data_gen.simulation.simulate import check_seed, simulate
from data_gen.truth.clip import clip_events, visible_masks, write_truth
from data_gen.truth.event import TruthEvent, write_truth_events
from gis.roads.sumo_net import read_sumo_net

_PERFECT = TrackFaults()
_LONGEST_STEP_US = 100_000
_VIEW_SIZE_PX = (1280, 720)
_FAULT_SEED = 0x7AC5
"""Tells the faults' source of randomness from those of traffic and picture."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackScene:
    """Simulated traffic with its truth, ready to be disturbed again and again."""

    name: str
    seed: int
    rows: TrueRows
    events: tuple[TruthEvent, ...]
    folder: Path
    """Holds `site.toml`, `network.net.xml`, `truth.csv` and `truth_events.jsonl`."""


def make_track_scene(
    scenario: str,
    *,
    seed: int,
    duration_us: int,
    out_dir: Path,
    rate_hz: int = 10,
    in_view: bool = False,
    options: Mapping[str, str] = NO_OPTIONS,
) -> TrackScene:
    """Simulate a scenario and write its truth.

    SUMO is stepped at the rate, or at a whole part of its period of 100 ms at most; `generate` steps it at the frame
    rate, so the same seed gives other traffic there.

    Parameters
    ----------
    scenario : a name of `data_gen.scenarios.catalogue`.
    seed : 0 to 2**31 - 1.
    duration_us : length of the clip.
    out_dir : made if it is missing.
    rate_hz : rows a second of each vehicle, a divisor of 1000.
    in_view : only what the scenario's camera straight above sees, instead of the whole network.
    options : of the scenario.

    Returns
    -------
    The scene.

    Raises
    ------
    DataGenError
        If an argument is out of range, the folder has a scene with a video, or SUMO fails; nothing is written then.
    """
    plan = scenario_named(scenario, options)
    _check_folder(out_dir)
    check_seed(seed)
    step_us, every = _steps(rate_hz)
    # The first of the sources of `generate`, so that equal steps give equal traffic.
    traffic_rng = np.random.default_rng(np.random.SeedSequence(seed)).spawn(1)[0]
    states = simulate(plan, seed=seed, rng=traffic_rng, duration_us=duration_us, step_us=step_us)
    network = read_sumo_net(plan.network_file)
    views = (camera_over(plan.view, _VIEW_SIZE_PX),) * len(states) if in_view else None
    visible = visible_masks(states, views)
    rows = rows_of_states(states, visible, every=every)
    events = clip_events(states, network, visible)
    out_dir.mkdir(parents=True, exist_ok=True)
    network_file = out_dir / "network.net.xml"
    shutil.copyfile(plan.network_file, network_file)
    write_truth(out_dir / "truth.csv", states, network, views, visible)
    write_truth_events(out_dir / "truth_events.jsonl", events)
    # Last: a folder with a site file is complete.
    write_site(out_dir / "site.toml", name=f"{scenario} seed {seed}", network=network_file)
    return TrackScene(scenario, seed, rows, events, out_dir)


def write_scenario_tracks(scene: TrackScene, file: Path, faults: TrackFaults = _PERFECT) -> NoisyTracks:
    """Disturb a scene's truth and write the tracks.

    Parameters
    ----------
    scene : of `make_track_scene`.
    file : to write.
    faults : what goes wrong; the scene's seed draws them.

    Returns
    -------
    What was written.
    """
    tracks = disturb(scene.rows, faults, seed=scene.seed ^ _FAULT_SEED)
    write_tracks(file, tracks)
    return tracks


def write_folder_tracks(
    folder: Path, file: Path, *, seed: int, rate_hz: int | None, faults: TrackFaults = _PERFECT
) -> NoisyTracks:
    """Make tracks of a generated scene's truth; site, network and truth are copied beside them.

    Parameters
    ----------
    folder : with the files of a scene.
    file : to write.
    seed : draws the faults.
    rate_hz : times a second at most; those of the truth if None.
    faults : what goes wrong.

    Returns
    -------
    What was written.

    Raises
    ------
    DataGenError
        If a file is missing or cannot be read, or the new folder has a scene with a video.
    """
    names = ("truth.csv", "truth_events.jsonl", "network.net.xml", "site.toml")
    for name in names:
        if not (folder / name).is_file():
            raise DataGenError(f"{folder}: expected the folder of a scene with {name}, got none there")
    tracks = disturb(read_truth_rows(folder / "truth.csv", rate_hz=rate_hz), faults, seed=seed ^ _FAULT_SEED)
    if file.parent.resolve() != folder.resolve():
        _check_folder(file.parent)
        file.parent.mkdir(parents=True, exist_ok=True)
        for name in names[:3]:
            shutil.copyfile(folder / name, file.parent / name)
        network = file.parent / "network.net.xml"
        write_site(file.parent / "site.toml", name=f"tracks of {folder.name}", network=network)
    write_tracks(file, tracks)
    return tracks


def _check_folder(folder: Path) -> None:
    """Refuse to put another truth beside a video: the two would no longer belong together."""
    if (folder / "video.mp4").exists():
        raise DataGenError(f"{folder}: expected a folder without a scene's video, got one with video.mp4")


def _steps(rate_hz: int) -> tuple[int, int]:
    """Give the step of the simulation, and how many of them lie between two rows."""
    if rate_hz < 1 or 1000 % rate_hz:
        raise DataGenError(f"rate: expected a divisor of 1000, in rows per second, got {rate_hz!r}")
    period_ms = 1000 // rate_hz
    every = next(
        parts for parts in range(math.ceil(period_ms * 1000 / _LONGEST_STEP_US), 1001) if not period_ms % parts
    )
    return period_ms * 1000 // every, every
