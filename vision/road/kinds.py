"""How large are vehicles of the usual kinds, and how high is one of a known length?"""

from dataclasses import dataclass

import numpy as np

from vision.objects import FloatArray


@dataclass(frozen=True, slots=True)
class Kind:
    """What vehicles of one kind usually measure, and by how much their length differs; metres."""

    length_m: float
    differs_m: float
    width_m: float
    height_m: float


# Cars, vans, trucks and buses, motorcycles, as they are on European roads.
TRUCK = Kind(10.5, 2.0, 2.5, 3.2)
KINDS = (Kind(4.5, 0.5, 1.8, 1.5), Kind(5.7, 0.6, 2.0, 2.3), TRUCK, Kind(2.1, 0.3, 0.8, 1.5))


def heights_m(length_m: FloatArray) -> FloatArray:
    """Say how high footprints of a length usually are, (n,): from cars over vans to trucks.

    Examples
    --------
    >>> heights_m(np.array([4.5, 5.7, 12.0])).tolist()
    [1.5, 2.3, 3.2]
    """
    car, van, truck = KINDS[:3]
    lengths_m = (car.length_m + car.differs_m, van.length_m, truck.length_m - truck.differs_m)
    return np.asarray(np.interp(length_m, lengths_m, (car.height_m, van.height_m, truck.height_m)), np.float64)
