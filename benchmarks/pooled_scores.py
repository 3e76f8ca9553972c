"""How well did several scenes go together? Their scores, pooled."""

from collections.abc import Sequence

from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.proportions import wilson_interval


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


def share_text(part: int, whole: int) -> str:
    """Write a share with Wilson's interval; "-" where there is nothing to have a part of.

    Examples
    --------
    >>> share_text(3, 4), share_text(0, 0)
    ('0.750 [0.301 to 0.954]', '-')
    """
    low, high = wilson_interval(part, whole)
    return f"{part / whole:.3f} [{low:.3f} to {high:.3f}]" if whole else "-"
