"""How well did several scenes go together? Their scores, pooled."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.proportions import wilson_interval
from service.questions.scoring.scene_scores import Compared


def merge_evaluations(evaluations: Sequence[Evaluation]) -> Evaluation:
    """Pool the scores of several scenes: counts add up, no mean of means.

    Raises
    ------
    ValueError
        If there is none, or they speak of different event types.
    """
    types = {evaluation.type for evaluation in evaluations}
    if len(types) != 1:
        raise ValueError(f"evaluations: expected one event type, got {sorted(types)!r}")
    return Evaluation(
        type=types.pop(),
        right=tuple(match for one in evaluations for match in one.right),
        border=tuple(match for one in evaluations for match in one.border),
        wrong=tuple(event for one in evaluations for event in one.wrong),
        missed=tuple(event for one in evaluations for event in one.missed),
        unjudged=tuple(event for one in evaluations for event in one.unjudged),
        has_truth=any(one.has_truth for one in evaluations),
    )


def pooled(scenes: Sequence[Compared]) -> Compared:
    """Join several scenes, at least one, into one long one; its levels are those of the first."""
    return {level: join_scenes([scene[level] for scene in scenes]) for level in scenes[0]}


def join_scenes(scenes: Sequence[tuple[ObjectRows, ObjectRows]]) -> tuple[ObjectRows, ObjectRows]:
    """Lay the true and found rows of several scenes one after another, as if they were one long scene.

    Figures of the whole are then figures of all rows, and no mean of means. Frames and names of different scenes are
    kept apart; image boxes are dropped unless all scenes have them.

    Parameters
    ----------
    scenes : (true, found) of each; at least one.
    """
    true, found, first_frame = [], [], 0
    for number, (true_rows, found_rows) in enumerate(scenes):
        true.append(_moved(true_rows, first_frame, f"{number}/"))
        found.append(_moved(found_rows, first_frame, f"{number}/"))
        first_frame = 1 + max((int(rows.frame[-1]) for rows in (true[-1], found[-1]) if len(rows)), default=first_frame)
    return ObjectRows.joined(true), ObjectRows.joined(found)


def _moved(rows: ObjectRows, first_frame: int, prefix: str) -> ObjectRows:
    return replace(rows, frame=rows.frame + first_frame, name=np.char.add(prefix, rows.name.astype(np.str_)))


def share_text(part: int, whole: int) -> str:
    """Write a share with Wilson's interval; "-" where there is nothing to have a part of.

    Examples
    --------
    >>> share_text(3, 4), share_text(0, 0)
    ('0.750 [0.301 to 0.954]', '-')
    """
    low, high = wilson_interval(part, whole)
    return f"{part / whole:.3f} [{low:.3f} to {high:.3f}]" if whole else "-"
