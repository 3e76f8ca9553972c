"""Are detections as exact as they claim? One factor for all of them, learned from how far they lie from predictions.

If claims are right, half of all squared Mahalanobis distances lie below the median of their distribution. A step down
for each that does, and up for each that does not, leads to the factor for which that holds; like every median, it does
not care how far off the odd false one is. Too much trust tears tracks apart: sightings fall outside the gate and
become twins of what they belong to.
"""

import numpy as np
from numpy.typing import NDArray

from vision.tracking.settings import TrackingSettings

# Of the chi-squared distribution with two degrees of freedom: 2 ln 2.
MEDIAN_SQUARED = 2 * np.log(2)


class NoiseLevel:
    """By how much the variance that detections claim has to be multiplied."""

    def __init__(self, settings: TrackingSettings) -> None:
        self._settings = settings
        self._log_factor = 0.0

    @property
    def factor(self) -> float:
        """The factor on covariances, from 1 to `most_noise` of the settings."""
        return float(np.exp(self._log_factor))

    def learn(self, squared: NDArray[np.float64], seen_us: int) -> None:
        """Take new sightings into account.

        Parameters
        ----------
        squared : (n,) squared Mahalanobis distances from predictions, with the present factor in them.
        seen_us : the time that each of them stands for.
        """
        balance = np.count_nonzero(squared > MEDIAN_SQUARED) * 2 - len(squared)
        log_factor = self._log_factor + self._settings.noise_rate * seen_us / 1_000_000 * balance
        self._log_factor = min(max(log_factor, 0.0), float(np.log(self._settings.most_noise)))
