"""What kind of thing is of this size, and can a thing of this size and speed be a vehicle at all?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anchoring.observations import BoolArray, FloatArray, IntArray
from anchoring.settings import AnchoringSettings

CLASS_NAMES: tuple[str, ...] = ("car", "truck", "bus", "motorcycle", "van", "unknown")
UNKNOWN_CLASS = CLASS_NAMES.index("unknown")
VEHICLE = "vehicle"  # the class that all of these are of


@dataclass(frozen=True, slots=True)
class ObjectClass:
    """Describe one class by its norms, as the linkage text gives them.

    Attributes
    ----------
    parent : the more general class, "" at the top.
    length_m, width_m : mean and standard deviation, as seen from above; None if a size does not tell the class.
    top_speed_mps : nothing of the class is faster; None for that of the parent.
    is_per_sensor : an object has a vision object of each sensor that sees it; else one in all.
    """

    name: str
    parent: str = ""
    length_m: tuple[float, float] | None = None
    width_m: tuple[float, float] | None = None
    top_speed_mps: float | None = None
    is_per_sensor: bool = False


class Norms:
    """Tell what things are by their sizes, and which speeds their class allows.

    Parameters
    ----------
    classes : the hierarchy, parents first; some of those in `CLASS_NAMES` must have a size. The first of these is
        the usual one.

    Attributes
    ----------
    usual_m : mean and standard deviation of the length and of the width of the usual class, (2, 2).

    Examples
    --------
    >>> vehicle = ObjectClass("vehicle", "", top_speed_mps=80.0)
    >>> norms = Norms([vehicle, ObjectClass("car", "vehicle", (4.5, 0.8), (1.8, 0.3)), ObjectClass("bus", "vehicle",
    ...                (12.0, 0.8), (2.6, 0.2), 30.0)])
    >>> numbers = norms.classify(np.array([4.4, 12.3, 40.0]), np.array([1.8, 2.6, 9.0]), AnchoringSettings())
    >>> [CLASS_NAMES[number] for number in numbers], norms.is_plausible_speed(np.full(3, 50.0), numbers).tolist()
    (['car', 'bus', 'unknown'], [True, False, True])
    """

    def __init__(self, classes: Sequence[ObjectClass]) -> None:
        sized = [
            (CLASS_NAMES.index(each.name), each.length_m, each.width_m)
            for each in classes
            if each.name in CLASS_NAMES and each.length_m and each.width_m
        ]
        self._numbers = np.array([number for number, _, _ in sized], dtype=np.int32)
        # One row a class, as columns.
        self._length_m = np.array([length_m for _, length_m, _ in sized]).T[:, :, None]
        self._width_m = np.array([width_m for _, _, width_m in sized]).T[:, :, None]
        self._score_at_mean = np.log(self._length_m[1] * self._width_m[1])
        self.usual_m = np.array(sized[0][1:])
        top_mps = {"": np.inf}
        for each in classes:
            top_mps[each.name] = top_mps[each.parent] if each.top_speed_mps is None else each.top_speed_mps
        # What is of no class that is known may be any vehicle.
        self._top_speed_mps = np.array([top_mps.get(name, top_mps.get(VEHICLE, np.inf)) for name in CLASS_NAMES])

    def classify(self, length_m: FloatArray, width_m: FloatArray, settings: AnchoringSettings) -> IntArray:
        """Find the likeliest class of each size.

        Parameters
        ----------
        length_m, width_m : (n,).
        settings : how far off a size may be.

        Returns
        -------
        (n,) int32 index into ``CLASS_NAMES``.
        """
        (long_m, longer_m), (wide_m, wider_m) = self._length_m, self._width_m
        far = ((length_m - long_m) / longer_m) ** 2 + ((width_m - wide_m) / wider_m) ** 2
        best = (0.5 * far + self._score_at_mean).argmin(axis=0)
        is_known = far[best, np.arange(len(length_m))] <= settings.class_sigmas**2
        return np.where(is_known, self._numbers[best], UNKNOWN_CLASS).astype(np.int32)

    def is_plausible_speed(self, speed_mps: FloatArray, classes: IntArray) -> BoolArray:
        """Tell which speeds, (n,), things of their classes, (n,) index into ``CLASS_NAMES``, can have."""
        plausible: BoolArray = speed_mps <= self._top_speed_mps[classes]
        return plausible


def is_plausible_size(length_m: FloatArray, width_m: FloatArray, settings: AnchoringSettings) -> BoolArray:
    """Tell which sizes a vehicle can have, (n,)."""
    is_long = (length_m >= settings.least_length_m) & (length_m <= settings.most_length_m)
    return is_long & (width_m >= settings.least_width_m) & (width_m <= settings.most_width_m)
