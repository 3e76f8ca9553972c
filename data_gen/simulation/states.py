"""Where is every vehicle at one instant? The state that simulation hands to truth and drawing."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from data_gen.scenario import VehicleClass
from data_gen.simulation.demand import Departure

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ByteArray = NDArray[np.uint8]
Picture = NDArray[np.float32]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.int32]

_Cell = TypeVar("_Cell", bound=np.generic)
_POSE_FORMATS = (".3f", ".3f", ".5f", ".3f", ".2f", ".2f")


@dataclass(frozen=True, slots=True)
class VehicleStates:
    """All vehicles on the network at one step, as a struct of arrays of equal length n."""

    t_us: int
    """On the clip's clock: the first frame is 0."""
    ids: tuple[str, ...]
    classes: tuple[VehicleClass, ...]
    lanes: tuple[str, ...]
    """SUMO lane of the front bumper."""
    centre_m: FloatArray
    """(n, 2) x, y of the body's centre, local east/north frame."""
    heading_rad: FloatArray
    speed_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    appearance: IntArray
    """Seed of each vehicle's looks."""

    def poses(self) -> FloatArray:
        """Give (n, 6): x and y of the centre, heading, speed, length, width."""
        return np.column_stack((self.centre_m, self.heading_rad, self.speed_mps, self.length_m, self.width_m))

    def joined(self, others: "VehicleStates") -> "VehicleStates":
        """Give the states with those of others behind them, at the same time."""
        joined: dict[str, Any] = {}  # tuples and arrays
        for name in (field.name for field in fields(self) if field.name != "t_us"):
            own, other = getattr(self, name), getattr(others, name)
            joined[name] = own + other if isinstance(own, tuple) else np.concatenate((own, other))
        return replace(self, **joined)


def written(pose: Iterable[float]) -> list[str]:
    """Write one of `VehicleStates.poses` for a file: millimetres, mm/s and 1e-5 rad, sizes to the centimetre."""
    return [format(value, form) for value, form in zip(pose, _POSE_FORMATS, strict=True)]


@dataclass(frozen=True, slots=True, eq=False)
class FrontStates:
    """The front bumpers of all n vehicles at one step, as SUMO moves them."""

    t_us: int
    ids: tuple[str, ...]
    lanes: tuple[str, ...]
    front_m: FloatArray
    """(n, 2)."""
    lane_heading_rad: FloatArray
    """SUMO's own angle; it jumps where a lane change starts."""
    speed_mps: FloatArray


def states_of(
    vehicles: Sequence[Departure], *, t_us: int, lanes: tuple[str, ...], poses: FloatArray, speed_mps: FloatArray
) -> VehicleStates:
    """Give the states of vehicles at one instant.

    Parameters
    ----------
    vehicles : n, with their sizes and looks.
    t_us, lanes, speed_mps : as in `VehicleStates`.
    poses : (n, 3), x and y of the centre, and heading.

    Returns
    -------
    The states.
    """
    return VehicleStates(
        t_us=t_us,
        ids=tuple(item.id for item in vehicles),
        classes=tuple(item.kind.vehicle_class for item in vehicles),
        lanes=lanes,
        centre_m=poses[:, :2],
        heading_rad=poses[:, 2],
        speed_mps=speed_mps,
        length_m=np.array([item.length_m for item in vehicles], dtype=np.float64),
        width_m=np.array([item.width_m for item in vehicles], dtype=np.float64),
        appearance=np.array([item.appearance for item in vehicles], dtype=np.int64),
    )


class Cells:
    """The cells of a table of (steps, vehicles) in which somebody is, in the order of the states.

    Parameters
    ----------
    states : in order of time.
    ids : of all vehicles, in the order of the columns.
    """

    def __init__(self, states: Sequence[VehicleStates | FrontStates], ids: Sequence[str]) -> None:
        column = {vehicle_id: place for place, vehicle_id in enumerate(ids)}
        self._shape = len(states), len(ids)
        self._rows = np.concatenate([np.full(len(step.ids), number) for number, step in enumerate(states)])
        self._columns = np.array([column[vehicle_id] for step in states for vehicle_id in step.ids], dtype=np.int64)

    def spread(self, values: NDArray[_Cell], empty: float) -> NDArray[_Cell]:
        """Fill a table with values, (cells, ...), and with `empty` where nobody is."""
        filled = np.full((*self._shape, *values.shape[1:]), empty, dtype=values.dtype)
        filled[self._rows, self._columns] = values
        return filled

    def numbers(self, values: FloatArray) -> FloatArray:
        """Fill a table that is nan where nobody is."""
        return self.spread(values, np.nan)

    def indices(self, values: IndexArray) -> IndexArray:
        """Fill a table that is -1 where nobody is."""
        return self.spread(values, -1)

    def by_vehicle(self, values: FloatArray) -> FloatArray:
        """Give one value a vehicle, the last one that it had."""
        filled = np.zeros(self._shape[1])
        filled[self._columns] = values
        return filled
