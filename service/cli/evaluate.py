"""`dyknow evaluate`: how good are the recognised events, against the truth of a generated scene?"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import exit_codes

if TYPE_CHECKING:
    from service.evaluate import Evaluation


def evaluate(
    log: Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")],
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="Folder with truth.csv and truth_events.jsonl.")],
    event_type: Annotated[str, typer.Option("--type", help="Event type to score.")] = "overtake",
    run: Annotated[str | None, typer.Option("--run", help="Run to score, if the log holds several.")] = None,
    min_f1: Annotated[
        float | None, typer.Option("--min-f1", min=0.0, max=1.0, help="Exit with 5 below this F1.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Score recognised events: precision, recall and time errors, with 95 % intervals."""
    import msgspec

    from service.evaluate_log import evaluate_log

    evaluation = evaluate_log(log, truth, event_type=event_type, run=run)
    print(msgspec.json.encode(evaluation.as_record()).decode() if as_json else describe(evaluation))
    if min_f1 is not None and evaluation.f1 < min_f1:
        print(f"error: {event_type}: expected F1 >= {min_f1}, got {evaluation.f1:.3f}", file=sys.stderr)
        raise typer.Exit(exit_codes.BELOW_THRESHOLD)


def describe(evaluation: "Evaluation") -> str:
    """Write a score for people."""
    from service.proportions import wilson_interval

    right, wrong, missed = len(evaluation.right), len(evaluation.wrong), len(evaluation.missed)
    precision_low, precision_high = wilson_interval(right, right + wrong)
    recall_low, recall_high = wilson_interval(right, right + missed)
    lines = [
        f"{evaluation.type}: {right} right, {wrong} wrong, {missed} missed, {len(evaluation.border)} at the border",
        f"precision {evaluation.precision:.3f}  (95 %: {precision_low:.3f} to {precision_high:.3f})",
        f"recall    {evaluation.recall:.3f}  (95 %: {recall_low:.3f} to {recall_high:.3f})",
    ]
    if right:
        lines.append(
            f"mean absolute time error: start {evaluation.mean_start_error_s:.3f} s, "
            f"end {evaluation.mean_end_error_s:.3f} s"
        )
    return "\n".join(lines)
