"""How good is everything behind a low camera, by what its pictures show?

``python -m benchmarks.evaluate_mast --seeds 1 2 --seconds 40`` makes the scenes that are not there yet, processes each
video and prints one table as Markdown. Of a vehicle counts what can be seen: rows whose box is 15 px wide or high and
of which half or more shows, in a stretch of 2 s or more. A symbol may be 1.5 m plus 5 % of its distance from the camera
away from its vehicle: so much a pixel is worth far away. At each frame symbols and vehicles are assigned one to one: a
pair of earlier frames is kept while it is near enough (CLEAR MOT, Bernardin and Stiefelhagen 2008), then those that
count go before the others.

* found: vehicles that have a symbol in most of the rows that count.
* precision: symbols' rows on a vehicle that counts, out of these and the rows on none at all. Those on a vehicle too
  small or too hidden to count are neither right nor wrong.
* switches: how often the symbol on a vehicle is another than the one before, for 20 vehicles.
* passes: as ``dyknow evaluate`` has it; those of vehicles that do not count all through it are border.
* false near misses: without truth, in 10 minutes.

``--detector truth`` gives the boxes of the truth, of which .3 and 10 px show, to the chain: what it makes of perfect
eyes. With ``--edge-noise 0.06 --missed 0.1`` their edges are off by that part of their size, and so many are left out.
"""

from __future__ import annotations

import argparse
import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.whole_runs import process_whole
from data_gen.outputs.scene import generate
from gis.cameras.camera_pose import read_camera_track
from service.questions.scoring.evaluate import Evaluation, TrueEvent, evaluate_events, load_truth, positions_from_rows
from service.questions.scoring.evaluate_log import load_events
from service.questions.scoring.pairs import (
    BoolArray,
    FloatArray,
    IntArray,
    Pairs,
    StrArray,
    assign,
    ground_pairs,
    groups_of,
)
from service.questions.scoring.truth_rows import nearest_times
from service.records.seen import CarState
from service.runs.processing import RunRequest
from service.store.log import open_log

SCENARIOS: Mapping[str, Mapping[str, str]] = {"motorway": {"demand": "high"}, "rural_overtaking": {}, "junction": {}}
SMALLEST_PX, LEAST_SHARE, LEAST_US = 15.0, 0.5, 2_000_000
DRAWN_PX, DRAWN_SHARE = 10.0, 0.3
EDGES = ("left_px", "top_px", "right_px", "bottom_px")
REACH_M, REACH_PER_M = 1.5, 0.05
TITLES = (
    "scenes",
    "vehicles",
    "found",
    "precision",
    "switches in 20",
    "passes P",
    "passes R",
    "false near misses in 10 min",
)


@dataclass(frozen=True, slots=True, eq=False)
class ShownTruth:
    """Hold the true rows of a scene, ordered by time.

    Attributes
    ----------
    t_us : (n,). name : (n,). centre_m : (n, 2). counts : (n,) whether the picture shows enough of the vehicle.
    """

    t_us: IntArray
    name: StrArray
    centre_m: FloatArray
    counts: BoolArray


@dataclass(frozen=True, slots=True)
class Measured:
    """Hold what is counted over one or more scenes; rows are those of symbols."""

    vehicles: int
    found: int
    rows_right: int
    rows_wrong: int
    switches: int
    passes: tuple[int, int, int]
    """Right, wrong, missed."""
    false_near_misses: int
    seconds: float


def main(arguments: Sequence[str] | None = None) -> None:
    options = _parse(arguments)
    lines = [f"| {' | '.join(TITLES)} |", f"|{'---|' * len(TITLES)}"]
    everything: list[Measured] = []
    for scenario in options.only or SCENARIOS:
        scenes = [_measure(scenario, seed, options) for seed in options.seeds]
        lines.append(_row(scenario, pooled(scenes)))
        everything += scenes
        print(f"{scenario}: done", flush=True)
    print("\n".join(["", *lines, _row("all", pooled(everything))]))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--only", nargs="+", choices=tuple(SCENARIOS), help="scenarios; default: all")
    parser.add_argument("--folder", type=Path, default=Path("out/evaluation"))
    parser.add_argument("--detector", default="auto", help="as of dyknow process, or truth")
    parser.add_argument("--rate", type=float, help="frames looked at in a second, inf for all; default: as usual")
    parser.add_argument("--edge-noise", type=float, default=0.0)
    parser.add_argument("--missed", type=float, default=0.0)
    return parser.parse_args(arguments)


def _measure(scenario: str, seed: int, options: argparse.Namespace) -> Measured:
    chosen, seconds = SCENARIOS[scenario], options.seconds
    told = ",".join(f"{name}={value}" for name, value in chosen.items())
    scene = options.folder / f"{scenario}-mast-{told}-s{seed}-{seconds}"
    if not (scene / "site.toml").exists():  # written last, so a scene that was cut short is made anew
        generate(scenario, seed=seed, duration_us=seconds * 1_000_000, out_dir=scene, camera="mast", options=chosen)
    log = scene / f"{re.sub(r'[^a-z]+', '-', options.detector)}.db"
    detector = options.detector
    if detector == "truth":
        boxes = scene / "truth_boxes.csv"
        write_boxes(scene / "truth.csv", boxes, edge_noise=options.edge_noise, missed=options.missed)
        detector = f"file:{boxes}"
    video, site = scene / "video.mp4", scene / "site.toml"
    request = RunRequest(video, site, str(log), again=True, detector=detector, rate_hz=options.rate)
    run = process_whole(request).run
    return measure_log(str(log), scene, run=run, seconds=seconds)


def write_boxes(truth: Path, out: Path, *, edge_noise: float, missed: float) -> None:
    """Write a file of detections with the boxes that a `truth.csv` tells of, somewhat spoilt."""
    rng = np.random.default_rng(1)
    with truth.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["visible"] == "1" and row[EDGES[0]]]
    edges_px = np.array([[float(row[edge]) for edge in EDGES] for row in rows])
    size_px = edges_px[:, 2:] - edges_px[:, :2]
    share = np.array([float(row["visible_share"]) for row in rows])
    is_drawn = (share >= DRAWN_SHARE) & (size_px.max(axis=1) >= DRAWN_PX) & (rng.random(len(rows)) >= missed)
    edges_px += rng.normal(0.0, edge_noise, edges_px.shape) * np.hstack([size_px, size_px])
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["t_us", "left_px", "top_px", "width_px", "height_px", "score", "class"])
        for row in np.flatnonzero(is_drawn & (edges_px[:, 2:] > edges_px[:, :2]).all(axis=1)).tolist():
            left, top, right, bottom = edges_px[row].round(2).tolist()
            writer.writerow([rows[row]["t_us"], left, top, right - left, bottom - top, 1, rows[row]["class"]])


def measure_log(url: str, scene: Path, *, run: str, seconds: float) -> Measured:
    """Count in one run what the table tells of."""
    truth, eye_m = load_shown(scene / "truth.csv"), read_camera_track(scene / "camera.csv").poses[0].place_m[:2]
    with open_log(url) as log:
        states = [state for state in log.states(run) if state.linked]
        told = {event_type: load_events(log, run, event_type) for event_type in ("pass", "near_miss")}
        frame_us = np.array([t_us for _, t_us in log.frames(run)])
    cars = positions_from_rows(
        (state.t_us for state in states), (state.car for state in states), [(state.x_m, state.y_m) for state in states]
    )
    events, vehicles = load_truth(scene)
    judged = [_judged(event, truth) for event in events]
    scores = {name: evaluate_events(rows, cars, judged, vehicles, event_type=name) for name, rows in told.items()}
    return compare_shown(_looked_at(truth, frame_us), states, eye_m, scores, seconds=seconds)


def _looked_at(truth: ShownTruth, frame_us: IntArray) -> ShownTruth:
    """Keep the rows of the frames that were looked at: of the others nothing is told."""
    times_us = np.unique(truth.t_us)
    places = nearest_times(frame_us, times_us)
    kept = np.isin(truth.t_us, times_us[places[places >= 0]])
    return ShownTruth(truth.t_us[kept], truth.name[kept], truth.centre_m[kept], truth.counts[kept])


def load_shown(path: Path) -> ShownTruth:
    """Read the rows of a `truth.csv` with boxes and visible shares, and which of them count."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    boxes_px = np.array([[float(row[edge] or "nan") for edge in EDGES] for row in rows])
    size_px = np.nan_to_num((boxes_px[:, 2:] - boxes_px[:, :2]).max(axis=1))
    share = np.array([float(row["visible_share"]) for row in rows])
    is_inside = np.array([row["visible"] == "1" for row in rows])
    t_us, name = np.array([int(row["t_us"]) for row in rows]), np.array([row["id"] for row in rows])
    centre_m = np.array([(float(row["x_m"]), float(row["y_m"])) for row in rows])
    counts = is_inside & (size_px >= SMALLEST_PX) & (share >= LEAST_SHARE)
    return ShownTruth(t_us, name, centre_m, counts & _in_long_stretches(t_us, name, counts))


def _in_long_stretches(t_us: IntArray, name: StrArray, counts: BoolArray) -> BoolArray:
    """Tell which rows lie in a stretch of a vehicle that counts without a break for long enough."""
    kept = np.zeros(len(t_us), dtype=np.bool_)
    for rows in _rows_by_name(name).values():
        bounds = np.flatnonzero(np.diff(counts[rows], prepend=False, append=False))
        for first, last in bounds.reshape(-1, 2).tolist():
            if t_us[rows[last - 1]] - t_us[rows[first]] >= LEAST_US:
                kept[rows[first:last]] = True
    return kept


def _rows_by_name(name: StrArray) -> dict[str, IntArray]:
    names, place = np.unique(name, return_inverse=True)
    return {str(one): np.flatnonzero(place == number) for number, one in enumerate(names)}


def compare_shown(
    truth: ShownTruth,
    states: Sequence[CarState],
    eye_m: FloatArray,
    scores: Mapping[str, Evaluation],
    *,
    seconds: float,
) -> Measured:
    """Lay symbols beside the vehicles that pictures show.

    Parameters
    ----------
    truth : of the scene.
    states : of the symbols, where they are linked.
    eye_m : (2,), the camera's foot.
    scores : of the events `pass` and `near_miss`.
    seconds : length of the clip.
    """
    times_us = np.unique(truth.t_us)
    cars = np.array([state.car for state in states])
    frame = nearest_times(np.array([state.t_us for state in states], dtype=np.int64), times_us)
    found_m = np.array([(state.x_m, state.y_m) for state in states]).reshape(-1, 2)
    near = _near(truth, np.searchsorted(times_us, truth.t_us), frame, found_m, eye_m)
    pairs = _assigned(near, truth, cars, np.searchsorted(times_us, truth.t_us))
    symbol = np.full(len(truth.t_us), "", dtype=object)
    symbol[pairs.true_row] = cars[pairs.found_row]
    of_vehicle = {name: symbol[rows[truth.counts[rows]]] for name, rows in _rows_by_name(truth.name).items()}
    of_vehicle = {name: symbols for name, symbols in of_vehicle.items() if len(symbols)}
    passes = scores["pass"]
    return Measured(
        vehicles=len(of_vehicle),
        found=sum(bool((symbols != "").mean() > 0.5) for symbols in of_vehicle.values()),
        rows_right=int(truth.counts[pairs.true_row].sum()),
        rows_wrong=int((frame >= 0).sum()) - len(pairs),
        switches=sum(_switches(symbols) for symbols in of_vehicle.values()),
        passes=(len(passes.right), len(passes.wrong), len(passes.missed)),
        false_near_misses=len(scores["near_miss"].wrong),
        seconds=seconds,
    )


def _near(truth: ShownTruth, true_frame: IntArray, frame: IntArray, found_m: FloatArray, eye_m: FloatArray) -> Pairs:
    """List the true and found rows that are near enough to each other."""
    away_m = np.hypot(*(truth.centre_m - eye_m).T)
    reach_m = REACH_M + REACH_PER_M * away_m
    widest_m = float(reach_m.max())
    known = np.flatnonzero(frame >= 0)
    near = ground_pairs(true_frame, truth.centre_m, frame[known], found_m[known], reach_m=widest_m)
    apart = (1 - near.similarity) * widest_m / reach_m[near.true_row]
    close = np.flatnonzero(apart < 1)
    return Pairs(near.true_row[close], known[near.found_row[close]], 1 - apart[close])


def _assigned(near: Pairs, truth: ShownTruth, cars: StrArray, true_frame: IntArray) -> Pairs:
    """Pair rows one to one, frame by frame: those that were a pair before first, then those that count."""
    chosen, last = np.zeros(len(near), np.bool_), dict[str, str]()
    for group in groups_of(true_frame[near.true_row]):
        pairs = near.select(group)
        names, symbols = truth.name[pairs.true_row].tolist(), cars[pairs.found_row].tolist()
        was_pair = np.array([last.get(name) == symbol for name, symbol in zip(names, symbols, strict=True)])
        # A pair that goes before weighs more than any two others.
        score = pairs.similarity + 1e-3 + 3.0 * truth.counts[pairs.true_row] + 12.0 * was_pair
        chosen[group] = is_chosen = assign(pairs, np.zeros(len(pairs), np.int64), score)
        last |= {names[nth]: symbols[nth] for nth in np.flatnonzero(is_chosen)}
    return near.select(chosen)


def _switches(symbols: Iterable[str]) -> int:
    return sum(before != after for before, after in pairwise(symbol for symbol in symbols if symbol))


def _judged(event: TrueEvent, truth: ShownTruth) -> TrueEvent:
    """Let an event count only if the pictures show enough of its vehicles all through it."""
    inside = (truth.t_us >= event.start_us) & (truth.t_us <= event.end_us)
    seen = all(_counts_in(truth, inside & (truth.name == name)) for name in event.roles.values())
    return replace(event, countable=event.countable and seen)


def _counts_in(truth: ShownTruth, rows: BoolArray) -> bool:
    return bool(rows.any() and truth.counts[rows].all())


def pooled(scenes: Sequence[Measured]) -> Measured:
    """Add up what was counted."""
    right, wrong, missed = (sum(scene.passes[place] for scene in scenes) for place in range(3))
    return Measured(
        vehicles=sum(scene.vehicles for scene in scenes),
        found=sum(scene.found for scene in scenes),
        rows_right=sum(scene.rows_right for scene in scenes),
        rows_wrong=sum(scene.rows_wrong for scene in scenes),
        switches=sum(scene.switches for scene in scenes),
        passes=(right, wrong, missed),
        false_near_misses=sum(scene.false_near_misses for scene in scenes),
        seconds=sum(scene.seconds for scene in scenes),
    )


def _row(name: str, measured: Measured) -> str:
    right, wrong, missed = measured.passes
    cells = (
        name,
        str(measured.vehicles),
        _share(measured.found, measured.vehicles),
        _share(measured.rows_right, measured.rows_right + measured.rows_wrong),
        f"{20 * measured.switches / max(1, measured.vehicles):.1f}",
        _share(right, right + wrong),
        _share(right, right + missed),
        f"{600 * measured.false_near_misses / measured.seconds:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def _share(part: int, whole: int) -> str:
    return f"{part / whole:.3f} ({part} of {whole})" if whole else "-"


if __name__ == "__main__":
    main()
