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
CAR, VAN, TRUCK = Kind(4.5, 0.5, 1.8, 1.5), Kind(5.7, 0.6, 2.0, 2.3), Kind(10.5, 2.0, 2.5, 3.2)
KINDS = (CAR, VAN, TRUCK, Kind(2.1, 0.3, 0.8, 1.5))


def heights_m(length_m: FloatArray) -> FloatArray:
    """Say how high footprints of a length usually are, (n,): from cars over vans to trucks.

    Examples
    --------
    >>> heights_m(np.array([4.5, 5.7, 12.0])).tolist()
    [1.5, 2.3, 3.2]
    """
    lengths_m = (CAR.length_m + CAR.differs_m, VAN.length_m, TRUCK.length_m - TRUCK.differs_m)
    return np.asarray(np.interp(length_m, lengths_m, (CAR.height_m, VAN.height_m, TRUCK.height_m)), np.float64)
