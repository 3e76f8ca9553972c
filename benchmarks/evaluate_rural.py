"""How good are recognised overtakes over several synthetic scenes?

``python -m benchmarks.evaluate_rural --seeds 1 2 3 4 5 --seconds 300`` makes the scenes that are not there yet,
processes each video and prints one row a seed and the pooled score, with 95 % intervals, as Markdown.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from data_gen.generate import generate
from service.evaluate import Evaluation, merge_evaluations
from service.evaluate_log import evaluate_log
from service.proportions import wilson_interval
from service.runs import RunRequest, RunSummary, process

SCENARIO = "rural_overtaking"
TYPE = "overtake"


def main(arguments: Sequence[str] | None = None) -> None:
    options = _parse(arguments)
    print("| seed | right | wrong | missed | border | precision | recall | start error s | end error s | x real time |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    evaluations = []
    for seed in options.seeds:
        evaluation, summary = _evaluate_seed(seed, options.seconds, options.folder)
        evaluations.append(evaluation)
        print(_row(str(seed), evaluation, f"{summary.progress.real_time_factor:.1f}"), flush=True)
    print(_row("all", merge_evaluations(evaluations), ""))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--folder", type=Path, default=Path("out/evaluation"))
    return parser.parse_args(arguments)


def _evaluate_seed(seed: int, seconds: int, folder: Path) -> tuple[Evaluation, RunSummary]:
    scene = folder / f"seed{seed}_{seconds}s"
    if not (scene / "truth_events.jsonl").exists():
        generate(SCENARIO, seed=seed, duration_us=seconds * 1_000_000, out_dir=scene)
    log = f"sqlite:///{folder / scene.name}.db"
    summary = process(RunRequest(scene / "video.mp4", scene / "site.toml", log))
    return evaluate_log(log, scene, event_type=TYPE, run=summary.run), summary


def _row(name: str, evaluation: Evaluation, speed: str) -> str:
    right, wrong, missed = len(evaluation.right), len(evaluation.wrong), len(evaluation.missed)
    cells = [
        name,
        *(str(count) for count in (right, wrong, missed, len(evaluation.border))),
        _share(evaluation.precision, right, right + wrong),
        _share(evaluation.recall, right, right + missed),
        f"{evaluation.mean_start_error_s:.3f}",
        f"{evaluation.mean_end_error_s:.3f}",
        speed,
    ]
    return f"| {' | '.join(cells)} |"


def _share(value: float, successes: int, trials: int) -> str:
    low, high = wilson_interval(successes, trials)
    return f"{value:.3f} ({low:.3f} to {high:.3f})"


if __name__ == "__main__":
    main()
