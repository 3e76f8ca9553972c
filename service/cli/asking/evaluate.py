"""`dyknow evaluate`: how good is what was seen, followed and recognised, against the truth of a generated scene?"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, RunName
from service.cli.printing import BELOW_THRESHOLD, format_table, show, tell
from service.errors import TruthError

if TYPE_CHECKING:
    from service.questions.scoring.detection import DetectionScore
    from service.questions.scoring.evaluate import Evaluation
    from service.questions.scoring.evaluate_log import LostViews
    from service.questions.scoring.tracks import TrackScore

DETECTION, TRACKS, EVENTS = "detection", "tracks", "events"
NONE = "-"
PARTS = (DETECTION, TRACKS, EVENTS)


def evaluate(
    log: Annotated[str | None, typer.Argument(metavar="LOG", help="Event log: PATH.db, or a URL.")] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="TRUTH", help="The same as --truth.")] = None,
    truth: Annotated[
        Path | None, typer.Option(help="Folder of the scene, with truth.csv and truth_events.jsonl.")
    ] = None,
    tracks: Annotated[
        Path | None, typer.Option(help="Score a file of tracks instead of a log: CSV, or MOT text (.txt).")
    ] = None,
    what: Annotated[
        str | None, typer.Option(help="Some of detection,tracks,events; default: events, with --tracks the other two.")
    ] = None,
    event_type: Annotated[str, typer.Option("--type", help="Event type to score.")] = "overtake",
    run: RunName = None,
    min_f1: Annotated[float | None, typer.Option(min=0.0, max=1.0, help="Exit with 5 below this F1 of events.")] = None,
    as_json: AsJson = False,
) -> None:
    """Score what a run saw, followed and recognised: precision, recall, HOTA, IDF1, with 95 % intervals."""
    from service.questions.scoring.evaluate_log import evaluate_log, find_lost_views, scene_doubts

    parts = _parts(what, has_log=_is_log(log, tracks))
    if min_f1 is not None and EVENTS not in parts:
        raise typer.BadParameter(f"expected {EVENTS} among --what, got {','.join(parts)}", param_hint="--min-f1")
    scene = _truth_folder(folder, truth)
    found, evaluation = _scene_parts(log, tracks, scene, run, parts), None
    if log is not None and EVENTS in parts:
        evaluation = evaluate_log(log, scene, event_type=event_type, run=run)
        found[EVENTS] = evaluation.as_record(), describe(evaluation)
    record = {part: one for part, (one, _) in found.items()}
    if evaluation is not None and what is None:  # their figures stand at the top where no part was asked for by name
        record = evaluation.as_record()
    texts = [text.rstrip("\n") for _, text in found.values()]
    if log is not None:
        tell("warning", scene_doubts(log, scene, run=run))
        if lost := find_lost_views(log, run=run):
            record |= {"lost_view": lost.as_record()}
            texts.append(describe_lost_views(lost))
    show(record, "\n\n".join(texts), as_json=as_json)
    if min_f1 is not None and evaluation is not None:
        _hold_to(evaluation, min_f1)


def _hold_to(evaluation: "Evaluation", min_f1: float) -> None:
    """Leave with an error if the events are not good enough, or nobody can say how good they are."""
    if not evaluation.has_truth:
        raise TruthError(f"--min-f1: expected a type that the truth tells of, got {evaluation.type!r}")
    f1 = evaluation.f1  # None: nothing to find and nothing claimed
    if f1 is not None and f1 < min_f1:
        print(f"error: {evaluation.type}: expected F1 >= {min_f1}, got {f1:.3f}", file=sys.stderr)
        raise typer.Exit(BELOW_THRESHOLD)


def _is_log(log: str | None, tracks: Path | None) -> bool:
    """Tell whether a log is to be scored, and not a file of tracks."""
    if (log is None) == (tracks is None):
        came = "neither" if log is None else "both"
        raise typer.BadParameter(f"expected either a log or --tracks, got {came}", param_hint="LOG")
    return log is not None


def _truth_folder(folder: Path | None, truth: Path | None) -> Path:
    given = [one for one in (folder, truth) if one is not None]
    if len(given) != 1:
        came = "none" if not given else f"{given[0]} and {given[1]}"
        raise typer.BadParameter(f"expected one folder with the truth, got {came}", param_hint="--truth")
    return given[0]


def _parts(what: str | None, *, has_log: bool) -> tuple[str, ...]:
    """Read which parts to score, in the order in which they are printed."""
    if what is None:
        return (EVENTS,) if has_log else (DETECTION, TRACKS)
    names = [name.strip() for name in what.split(",")]
    known = PARTS if has_log else (DETECTION, TRACKS)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise typer.BadParameter(f"expected some of {','.join(known)}, got {unknown[0]!r}", param_hint="--what")
    return tuple(part for part in PARTS if part in names)


def _scene_parts(
    log: str | None, tracks: Path | None, scene: Path, run: str | None, parts: Sequence[str]
) -> dict[str, tuple[object, str]]:
    """Score what was seen and followed: the record and the table of each part that was asked for."""
    from service.questions.scoring.scene_scores import compare_log, compare_tracks, score_scene

    if not {DETECTION, TRACKS} & set(parts):
        return {}
    if tracks is not None:
        scores = score_scene(compare_tracks(tracks, scene))
    else:
        assert log is not None
        scores = score_scene(compare_log(log, scene, run=run))
    tables = {DETECTION: detection_table(scores.detection, scores.seen_by), TRACKS: tracks_table(scores.tracks)}
    return {part: (one, tables[part]) for part, one in scores.as_record().items() if part in parts}


def describe(evaluation: "Evaluation") -> str:
    """Write a score for people."""
    if not evaluation.has_truth:
        return f"{evaluation.type}: {len(evaluation.unjudged)} recognised; the truth does not tell of this type"
    right, wrong, missed = len(evaluation.right), len(evaluation.wrong), len(evaluation.missed)
    counts = f"{right} right, {wrong} wrong, {missed} missed, {len(evaluation.border)} at the border"
    none = "" if evaluation.in_truth else "0 in the truth, "
    lines = [
        f"{evaluation.type}: {none}{counts}",
        f"precision {_share(right, right + wrong)}",
        f"recall    {_share(right, right + missed)}",
    ]
    if right:
        lines.append(
            f"mean absolute time error: start {evaluation.mean_start_error_s:.3f} s, "
            f"end {evaluation.mean_end_error_s:.3f} s"
        )
    return "\n".join(lines)


def describe_lost_views(lost: "LostViews") -> str:
    """Write for people what was told of times in which the view was lost."""
    losses = f"{len(lost.losses_us)} {'loss' if len(lost.losses_us) == 1 else 'losses'}, {lost.lost_s:.2f} s"
    return f"lost view ({losses}): {len(lost.told)} of {lost.events} events told of that time; there should be none"


def detection_table(score: "DetectionScore", seen_by: str) -> str:
    """Lay out how well vehicles are seen; a row of the counts is one vehicle in one frame.

    Parameters
    ----------
    score : the figures. seen_by : what was compared with the truth, such as "vision objects".
    """
    from service.questions.scoring.detection import REACH_M

    counts = {
        "precision": (score.right, score.wrong),
        "recall": (score.right, score.missed),
        "standing recall": (score.standing_right, score.standing_missed),
        **{f"recall of {kind}": one for kind, one in score.by_kind.items() if kind},
    }
    rows = [_share_row(name, right, right + others) for name, (right, others) in counts.items()]
    error = f"mean {score.mean_error_m:.3f} m, 95 % below {score.most_error_m:.3f} m" if score.right else NONE
    return (
        format_table([f"detection: {seen_by}", "share", "95 %", "rows"], rows)
        + f"found within {REACH_M:g} m; centre error: {error}; {score.border} found rows at the border\n"
    )


def tracks_table(scores: Mapping[str, "TrackScore"]) -> str:
    """Lay out how well vehicles are followed, a line for each level at which names are given."""
    titles = ["tracks", "HOTA", "DetA", "AssA", "LocA", "IDF1", "IDP", "IDR", "MOTA"]
    counts = ["switches", "fragmentations", "found", "true"]
    rows = []
    for level, one in scores.items():
        shares = (one.hota, one.det_a, one.ass_a, one.loc_a, one.idf1, one.idp, one.idr, one.mota)
        numbers = (one.id_switches, one.fragmentations, one.found_tracks, one.true_tracks)
        rows.append([level, *(f"{share:.3f}" for share in shares), *map(str, numbers)])
    return format_table([*titles, *counts], rows)


def _share(part: int, whole: int) -> str:
    _, value, interval, _ = _share_row("", part, whole)
    return f"{value}  (95 %: {interval})" if whole else NONE


def _share_row(name: str, part: int, whole: int) -> list[str]:
    from service.questions.scoring.proportions import wilson_interval

    if not whole:
        return [name, NONE, NONE, NONE]
    low, high = wilson_interval(part, whole)
    return [name, f"{part / whole:.3f}", f"{low:.3f} to {high:.3f}", f"{part} of {whole}"]
