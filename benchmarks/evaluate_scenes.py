"""How good is everything, video in and log out, over synthetic scenes of every kind, beside what we aim for?

``python -m benchmarks.evaluate_scenes --seeds 1 2 3 4 5 --seconds 120`` makes the scenes that are not there yet,
processes each video and prints two tables as Markdown: how well vehicles are seen and followed, and how well overtakes
are recognised. Rows of all seeds are pooled; ``--by-seed`` adds one line a seed, ``--only NAME ...`` leaves out the
other kinds. A measured figure that misses its aim is marked with ``!``.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.pooled_scores import merge_evaluations, pooled
from benchmarks.whole_runs import process_whole
from data_gen.outputs.scene import generate
from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.evaluate_log import evaluate_log
from service.questions.scoring.proportions import wilson_interval
from service.questions.scoring.scene_scores import CARS, OBJECTS, Compared, compare_log, score_scene
from service.runs.processing import RunRequest

TYPE = "overtake"


@dataclass(frozen=True, slots=True)
class SceneKind:
    """Say how scenes of one kind are made and processed, and what we aim for.

    Attributes
    ----------
    camera, weather, options, poses, occluders, size_px : as `data_gen.outputs.scene.generate` takes them.
    rate_hz : frames that are looked at in a second; None for the usual.
    aims : the least figure by column, of `error_m` the greatest.
    """

    scenario: str
    camera: str = "vertical"
    weather: str = "sunny"
    options: Mapping[str, str] = field(default_factory=dict)
    poses: bool = False
    occluders: tuple[str, ...] = ()
    size_px: tuple[int, int] = (1280, 720)
    rate_hz: float | None = None
    aims: Mapping[str, float] = field(default_factory=dict)


STATIC = {"precision": 0.99, "recall": 0.99, "error_m": 0.35, "standing": 0.97, "idf1": 0.98, "speed": 8.0}
MOVING = {"precision": 0.97, "recall": 0.98, "standing": 0.97, "idf1": 0.95, "speed": 4.0}
JUNCTION = {"precision": 0.95, "recall": 0.95, "error_m": 0.35, "standing": 0.97, "idf1": 0.90, "speed": 4.0}
SLANTING = {"precision": 0.97, "recall": 0.97, "error_m": 0.60}
HIDDEN = {"cars_idf1": 0.98, "overtake_precision": 0.98, "overtake_recall": 0.97}
LARGE_PX = (1920, 1080)

KINDS: Mapping[str, SceneKind] = {
    "rural": SceneKind("rural_overtaking", aims=STATIC),
    "rural 1080p": SceneKind("rural_overtaking", size_px=LARGE_PX, aims=STATIC | {"speed": 5.0}),
    "rural 5 fps": SceneKind("rural_overtaking", rate_hz=5.0, aims={"overtake_recall": 0.90}),
    "rural clouds": SceneKind("rural_overtaking", weather="clouds"),
    "rural trees": SceneKind("rural_overtaking", occluders=("trees",), aims=HIDDEN),
    "rural bridge": SceneKind("rural_overtaking", occluders=("bridge",), aims=HIDDEN),
    "rural gantry": SceneKind("rural_overtaking", occluders=("gantry",), aims=HIDDEN),
    "rural oblique": SceneKind("rural_overtaking", camera="oblique", aims=SLANTING),
    "rural uav": SceneKind("rural_overtaking", camera="uav", aims=MOVING),
    "rural uav 1080p": SceneKind("rural_overtaking", camera="uav", size_px=LARGE_PX, aims=MOVING | {"speed": 2.5}),
    "rural uav poses": SceneKind("rural_overtaking", camera="uav", poses=True, aims=MOVING),
    "motorway": SceneKind("motorway"),
    "motorway trees": SceneKind("motorway", occluders=("trees",), aims=HIDDEN),
    "motorway bridge": SceneKind("motorway", occluders=("bridge",), aims=HIDDEN),
    "motorway gantry": SceneKind("motorway", occluders=("gantry",), aims=HIDDEN),
    "junction": SceneKind("junction", aims=JUNCTION),
    "junction oblique": SceneKind("junction", camera="oblique", aims=SLANTING),
    "roundabout": SceneKind("roundabout"),
    "urban grid": SceneKind("urban_grid"),
    "following only": SceneKind("following_only"),
    "meeting only": SceneKind("meeting_only"),
    "parked car": SceneKind("parked_car"),
    "lane change only": SceneKind("lane_change_only"),
    "queue passing": SceneKind("queue_passing"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Hold what came of one or more scenes of one kind."""

    compared: tuple[Compared, ...]
    overtakes: Evaluation
    real_time_factors: tuple[float, ...]


def main(arguments: Sequence[str] | None = None) -> None:
    options = _parse(arguments)
    seen, recognised = [_header(SEEN_TITLES)], [_header(OVERTAKE_TITLES)]
    for name in options.only or KINDS:
        scenes = [_measure(name, seed, options) for seed in options.seeds]
        named = list(zip((f"{name}, seed {seed}" for seed in options.seeds), scenes, strict=True))
        named = [*(named if options.by_seed else ()), (name, _pool(scenes))]
        seen += [_seen_row(title, one, KINDS[name].aims) for title, one in named]
        recognised += [_overtake_row(title, one, KINDS[name].aims) for title, one in named]
        print(f"{name}: done", flush=True)
    print("\n".join(["", *seen, "", *recognised]))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--only", nargs="+", choices=tuple(KINDS), help="kinds of scenes; default: all")
    parser.add_argument("--by-seed", action="store_true")
    parser.add_argument("--rate", type=float, help="frames looked at in a second, inf for all; default: as usual")
    parser.add_argument("--folder", type=Path, default=Path("out/evaluation"))
    return parser.parse_args(arguments)


def _measure(name: str, seed: int, options: argparse.Namespace) -> Measured:
    kind = KINDS[name]
    scene = made_scene(kind, options.folder, seed=seed, seconds=options.seconds)
    log = options.folder / f"{name.replace(' ', '_')}_seed{seed}_{options.seconds}s.db"
    rate_hz = kind.rate_hz or options.rate
    request = RunRequest(scene / "video.mp4", scene / "site.toml", str(log), again=True, rate_hz=rate_hz)
    summary = process_whole(request)
    return Measured(
        (compare_log(str(log), scene, run=summary.run),),
        evaluate_log(str(log), scene, event_type=TYPE, run=summary.run),
        (summary.progress.real_time_factor,),
    )


def _scene_name(kind: SceneKind) -> str:
    """Name the scene alone: kinds that differ in how it is processed share it."""
    parts = (kind.scenario, kind.camera, kind.weather, *kind.occluders, "poses" if kind.poses else "")
    options = (f"{name}={value}" for name, value in kind.options.items())
    return "_".join(part for part in (*parts, *options, f"{kind.size_px[1]}p") if part)


def made_scene(kind: SceneKind, folder: Path, *, seed: int, seconds: int) -> Path:
    """Make a scene of a kind, unless the folder has it; return where it is."""
    scene = folder / f"{_scene_name(kind)}_seed{seed}_{seconds}s"
    if (scene / "site.toml").exists():  # written last, so a scene that was cut short is made anew
        return scene
    generate(
        kind.scenario,
        seed=seed,
        duration_us=seconds * 1_000_000,
        out_dir=scene,
        width_px=kind.size_px[0],
        height_px=kind.size_px[1],
        camera=kind.camera,  # type: ignore[arg-type]  # a text of `KINDS`
        poses=kind.poses,
        weather=kind.weather,  # type: ignore[arg-type]
        occluders=kind.occluders,
        options=kind.options,
    )
    return scene


def _pool(scenes: Sequence[Measured]) -> Measured:
    return Measured(
        tuple(compared for one in scenes for compared in one.compared),
        merge_evaluations([one.overtakes for one in scenes]),
        tuple(factor for one in scenes for factor in one.real_time_factors),
    )


SEEN_TITLES = (
    *("scenes", "precision", "recall", "centre error m", "95 % below m", "standing recall"),
    *("IDF1 before anchoring", "IDF1 of cars", "HOTA", "identity switches", "x real time"),
)
OVERTAKE_TITLES = (
    *("scenes", "right", "wrong", "missed", "border", "precision", "recall"),
    *("start error s", "end error s"),
)


def _header(titles: Sequence[str]) -> str:
    return f"| {' | '.join(titles)} |\n|{'---|' * len(titles)}"


def _seen_row(name: str, measured: Measured, aims: Mapping[str, float]) -> str:
    score = score_scene(pooled(measured.compared))
    seen, objects = score.detection, score.tracks[OBJECTS]
    factors = measured.real_time_factors
    cells = (
        name,
        _figure(seen.precision, aims.get("precision")),
        _figure(seen.recall, aims.get("recall")),
        _figure(seen.mean_error_m, aims.get("error_m"), is_least=False),
        _figure(seen.most_error_m),
        _figure(seen.standing_recall, aims.get("standing")),
        _figure(objects.idf1, aims.get("idf1")),
        _figure(score.tracks[CARS].idf1, aims.get("cars_idf1")),
        _figure(objects.hota),
        str(objects.id_switches),
        _figure(sum(factors) / len(factors), aims.get("speed"), digits=1),
    )
    return f"| {' | '.join(cells)} |"


def _overtake_row(name: str, measured: Measured, aims: Mapping[str, float]) -> str:
    one = measured.overtakes
    right, wrong, missed = len(one.right), len(one.wrong), len(one.missed)
    cells = (
        name,
        *(str(count) for count in (right, wrong, missed, len(one.border))),
        _share(right, right + wrong, aims.get("overtake_precision")),
        _share(right, right + missed, aims.get("overtake_recall")),
        _figure(one.mean_start_error_s),
        _figure(one.mean_end_error_s),
    )
    return f"| {' | '.join(cells)} |"


def _share(part: int, whole: int, aim: float | None = None) -> str:
    low, high = wilson_interval(part, whole)
    return f"{_figure(part / whole, aim)} [{low:.3f} to {high:.3f}]" if whole else "-"


def _figure(value: float | None, aim: float | None = None, *, is_least: bool = True, digits: int = 3) -> str:
    """Write a figure, and in parentheses what we aim for; ``!`` where it falls short."""
    if value is None or math.isnan(value):
        return "-"
    if aim is None:
        return f"{value:.{digits}f}"
    is_met = value >= aim if is_least else value <= aim
    return f"{value:.{digits}f}{'' if is_met else '!'} ({'>=' if is_least else '<='} {aim:g})"


if __name__ == "__main__":
    main()
