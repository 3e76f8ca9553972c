"""What kind of thing is of this size, and can a thing of this size and speed be a vehicle at all?"""

from dataclasses import dataclass

import numpy as np

from anchoring.observations import BoolArray, FloatArray, IntArray
from anchoring.settings import AnchoringSettings


@dataclass(frozen=True, slots=True)
class ObjectClass:
    """Describe one class of vehicles by its norms: mean and spread, as seen from above.

    Attributes
    ----------
    name : one of `CLASS_NAMES`.
    parent : the more general class, "" at the top.
    length_m, width_m : mean and standard deviation.
    top_speed_mps : nothing of the class is faster.
    """

    name: str
    parent: str
    length_m: tuple[float, float]
    width_m: tuple[float, float]
    top_speed_mps: float


# Spreads hold what tracking adds to the spread of real bodies. Trucks and buses overlap in length: width decides.
CAR = ObjectClass("car", "vehicle", (4.5, 0.8), (1.8, 0.3), 70.0)
CLASSES: tuple[ObjectClass, ...] = (
    CAR,
    ObjectClass("truck", "vehicle", (10.0, 4.0), (2.4, 0.4), 45.0),
    ObjectClass("bus", "vehicle", (12.0, 0.8), (2.6, 0.2), 45.0),
    ObjectClass("motorcycle", "vehicle", (2.1, 0.4), (0.8, 0.25), 80.0),
)
# A van is told by a tracker alone: from above, tracking blurs sizes by more than what sets vans and cars apart.
CLASS_NAMES: tuple[str, ...] = (*(each.name for each in CLASSES), "van", "unknown")
UNKNOWN_CLASS = CLASS_NAMES.index("unknown")

# One row a class, as columns.
_LENGTH_M, _LENGTH_SIGMA_M = np.array([each.length_m for each in CLASSES]).T[:, :, None]
_WIDTH_M, _WIDTH_SIGMA_M = np.array([each.width_m for each in CLASSES]).T[:, :, None]
_SCORE_AT_MEAN = np.log(_LENGTH_SIGMA_M * _WIDTH_SIGMA_M)
_TOP_SPEED_MPS = max(each.top_speed_mps for each in CLASSES)


def classify(length_m: FloatArray, width_m: FloatArray, settings: AnchoringSettings) -> IntArray:
    """Find the likeliest class of each size.

    Parameters
    ----------
    length_m, width_m : (n,).
    settings : how far off a size may be.

    Returns
    -------
    (n,) int32 index into ``CLASS_NAMES``.

    Examples
    --------
    >>> sizes_m = np.array([[4.4, 1.8], [9.2, 2.2], [12.0, 2.6], [2.2, 0.7], [40.0, 9.0]])
    >>> [CLASS_NAMES[index] for index in classify(*sizes_m.T, AnchoringSettings())]
    ['car', 'truck', 'bus', 'motorcycle', 'unknown']
    """
    far = ((length_m - _LENGTH_M) / _LENGTH_SIGMA_M) ** 2 + ((width_m - _WIDTH_M) / _WIDTH_SIGMA_M) ** 2
    best = (0.5 * far + _SCORE_AT_MEAN).argmin(axis=0)
    is_known = far[best, np.arange(len(length_m))] <= settings.class_sigmas**2
    return np.where(is_known, best, UNKNOWN_CLASS).astype(np.int32)


def is_plausible_size(length_m: FloatArray, width_m: FloatArray, settings: AnchoringSettings) -> BoolArray:
    """Tell which sizes a vehicle can have, (n,)."""
    is_long = (length_m >= settings.least_length_m) & (length_m <= settings.most_length_m)
    return is_long & (width_m >= settings.least_width_m) & (width_m <= settings.most_width_m)


def is_plausible_speed(speed_mps: FloatArray) -> BoolArray:
    """Tell which speeds a vehicle can have, (n,)."""
    return speed_mps <= _TOP_SPEED_MPS
