"""How sure is an occurrence? As its weakest event, and less if its times are nearly out of their bounds.

The weakest decides, and not the product: the events of an occurrence are about the same two or three things, so what
makes one of them doubtful makes the others doubtful too, and a product would count that doubt again and again.
Events that say nothing of themselves are sure, and so is what is made of them alone.
"""

import math
from collections.abc import Sequence

from chronicles.events import Event

# Odds are finite.
_LEAST = 1e-3


# What is fitted: see `benchmarks/evaluate_confidence.py` and the reliability table in docs/evaluation.md.
TIME_SIGMA_US = 60_000
"""Standard deviation of the time of an event that is not sure; the start and end errors of overtakes in
docs/evaluation.md are as large."""
OFFSET_NATS, SLOPE = 0.43, 2.52
"""Of the logistic curve over the log odds of what the parts say: maximum likelihood, 1030 events of seeds 1 to 5."""


def confidence_of(events: Sequence[Event], times_us: Sequence[int], distance_us: Sequence[Sequence[int]]) -> float:
    """Combine the confidences of matched events with the slack that is left of their bounds.

    Parameters
    ----------
    events : all that were matched.
    times_us : of each position.
    distance_us : bounds between positions, as in `chronicles.compilation.plan.Plan`.

    Returns
    -------
    0 to 1, not calibrated; 1 if all events are sure.

    Examples
    --------
    >>> enter, leave = Event("enter", ("a",), 0, confidence=0.9), Event("leave", ("a",), 200_000, confidence=0.99)
    >>> confidence_of([enter, leave], [0, 5_000_000], [[0, 9_000_000], [0, 0]])
    0.9
    >>> round(confidence_of([enter, leave], [0, 200_000], [[0, 9_000_000], [-200_000, 0]]), 3)    # 0.2 s at least
    0.45
    """
    weakest = min([event.confidence for event in events])
    if weakest == 1.0:
        return 1.0
    slack_us = min(
        [
            distance_us[one][other] - (times_us[other] - times_us[one])
            for one in range(len(times_us))
            for other in range(len(times_us))
            if distance_us[one][other] + distance_us[other][one] > TIME_SIGMA_US  # else nothing is left free
        ],
        default=math.inf,
    )
    return weakest * 0.5 * math.erfc(-slack_us / (2.0 * TIME_SIGMA_US))  # of a difference of two times


def calibrated(confidence: float) -> float:
    """Say how often what has a confidence like this is right.

    Examples
    --------
    >>> calibrated(1.0), 0.0 < calibrated(0.2) < calibrated(0.8) < 1.0
    (1.0, True)
    """
    if confidence == 1.0:
        return 1.0
    odds = min(max(confidence, _LEAST), 1.0 - _LEAST)
    nats = OFFSET_NATS + SLOPE * math.log(odds / (1.0 - odds))
    return 1.0 / (1.0 + math.exp(-nats))
