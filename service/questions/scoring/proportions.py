"""How large is a share, and how sure? A proportion, and Wilson's score interval for it."""

import math

Z_95 = 1.959963984540054


def share(part: int, whole: int) -> float | None:
    """Divide; None where there is nothing to have a part of.

    Examples
    --------
    >>> share(3, 4), share(0, 0)
    (0.75, None)
    """
    return part / whole if whole else None


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Bound a proportion at 95 % confidence.

    Parameters
    ----------
    successes, trials : 0 <= successes <= trials.

    Returns
    -------
    (low, high) in [0, 1]; (0, 1) without a trial, since nothing is known then. E. B. Wilson (1927), "Probable
    inference, the law of succession, and statistical inference".

    Examples
    --------
    >>> [round(bound, 2) for bound in wilson_interval(10, 10)]
    [0.72, 1.0]
    >>> wilson_interval(0, 0)
    (0.0, 1.0)
    """
    if trials == 0:
        return 0.0, 1.0
    share = successes / trials
    scale = 1 + Z_95**2 / trials
    middle = (share + Z_95**2 / (2 * trials)) / scale
    reach = Z_95 * math.sqrt(share * (1 - share) / trials + Z_95**2 / (4 * trials**2)) / scale
    return max(0.0, middle - reach), min(1.0, middle + reach)
