"""What is a scenario? A road network, who drives on it, and what the camera sees. Data only.

A new scenario is a folder under `data_gen/scenarios` with a network and one function that returns a `Scenario`;
simulation, truth and drawing read nothing else.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

VehicleClass = Literal["car", "truck"]


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """One kind of road user in the mix: its share, its size range and how SUMO drives it."""

    name: str
    vehicle_class: VehicleClass
    share: float
    """Part of the traffic, 0 to 1; the shares of a scenario sum to 1."""
    length_m: tuple[float, float]
    """Smallest and largest; drawn uniformly for each vehicle."""
    width_m: tuple[float, float]
    driver: tuple[tuple[str, str], ...]
    """SUMO `vType` attributes, name and value, such as ("maxSpeed", "11")."""


@dataclass(frozen=True, slots=True)
class Flow:
    """Vehicles that enter on one edge and leave on another, with exponential gaps between them."""

    from_edge: str
    to_edge: str
    rate_hz: float
    """Mean vehicles per second."""


@dataclass(frozen=True, slots=True)
class View:
    """The ground a fixed camera looking straight down covers; north is up."""

    centre_m: tuple[float, float]
    width_m: float
    """Ground covered by the image width; the height follows from the image shape."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """Everything that tells one scenario from another."""

    name: str
    network_file: Path
    """A SUMO `.net.xml` whose coordinates are the local east/north frame."""
    kinds: tuple[VehicleKind, ...]
    flows: tuple[Flow, ...]
    view: View
    warm_up_us: int
    """Simulated before the clip starts, so that traffic already fills the road."""
    simulator_options: tuple[str, ...] = ()
    """Further SUMO command-line options, name and value alternating."""
