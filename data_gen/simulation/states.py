"""Where is every vehicle at one instant? The state that simulation hands to truth and drawing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_gen.scenario import VehicleClass

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ByteArray = NDArray[np.uint8]
Picture = NDArray[np.float32]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.int32]


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
