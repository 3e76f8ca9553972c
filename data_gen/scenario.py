"""What is a scenario? A road network, who drives on it, and what the camera sees. Data only.

A new scenario is a module in `data_gen/scenarios` with one function that returns a `Scenario`, and a network in a
folder beside it; simulation, truth and drawing read nothing else.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from data_gen.errors import DataGenError

_FLAGS: tuple[str, ...] = ("0", "1")

VehicleClass = Literal["car", "van", "truck", "bus", "motorcycle"]
Driver = tuple[tuple[str, str], ...]
_Range = tuple[float, float]
_MODELS: Mapping[VehicleClass, tuple[_Range, _Range, Mapping[str, str]]] = {
    "car": ((3.9, 4.9), (1.7, 1.9), {}),
    "van": ((5.0, 6.4), (1.95, 2.1), {"accel": "2.2"}),
    "truck": ((8.0, 11.5), (2.4, 2.55), {"accel": "1.2", "decel": "4"}),
    "bus": ((11.5, 12.2), (2.5, 2.55), {"accel": "1.2", "decel": "4"}),
    "motorcycle": ((2.0, 2.3), (0.75, 0.9), {"accel": "4"}),
}
"""Length, width and usual driver of each class."""


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
    driver: Driver
    """SUMO `vType` attributes, name and value, such as ("maxSpeed", "11")."""


@dataclass(frozen=True, slots=True)
class Flow:
    """Vehicles that enter on one edge and leave on another, with exponential gaps between them."""

    from_edge: str
    to_edge: str
    rate_hz: float
    """Mean vehicles per second."""
    kinds: tuple[VehicleKind, ...] = ()
    """Who drives here, if not the kinds of the scenario."""
    shortest_gap_s: float = 0.0
    """No two vehicles of the flow depart closer together; what is left of the mean gap is exponential."""
    platoon: int = 1
    """Vehicles that depart together, 2.5 s apart; the flow's first kind leads, so let it be the slow one."""
    depart: Driver = (("departSpeed", "desired"), ("departLane", "best"))
    """SUMO `trip` attributes, name and value."""


@dataclass(frozen=True, slots=True)
class RoadsideStop:
    """One vehicle that pulls up in its lane, stands there, and drives on."""

    edge: str
    kind: VehicleKind
    depart_us: int
    """On the clip's clock: 0 is the first frame, negative is in the warm-up."""
    lane: str
    front_m: float
    """Where the front bumper comes to rest, from the start of the lane."""
    stand_us: int
    right_m: float
    """How far it draws to the right while it stands."""


@dataclass(frozen=True, slots=True)
class ParkingStrip:
    """Places along a kerb in which cars stand all the time, beside the lane and out of everybody's way."""

    lane: str
    first_m: float
    """From the start of the lane to the strip's start and end."""
    last_m: float
    right_m: float
    """From the lane's centre line to that of the parked cars."""
    kind: VehicleKind
    filled: float
    """Part of the places that is taken, 0 to 1."""
    place_m: float = 6.5


@dataclass(frozen=True, slots=True)
class Attempts:
    """Overtakes that drivers begin and give up: SUMO never aborts one, so they are added to what it drives."""

    kind: str
    """Name of the vehicle kind whose drivers try."""
    shift_m: float
    """From the own lane's centre line to the oncoming lane's."""
    pause_us: int
    """No driver tries again sooner."""


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
    stops: tuple[RoadsideStop, ...] = ()
    parking: tuple[ParkingStrip, ...] = ()
    light_programs: tuple[tuple[str, str], ...] = ()
    """Traffic light and the program it runs, of those in the network."""
    solid_line_m: float = 0.0
    """So close to the end of an edge nobody begins a lane change; 0: everywhere allowed."""
    lane_change_rate_hz: float = 0.0
    """How often a driver changes lane for no reason, on average."""
    attempts: Attempts | None = None


def shipped_network(name: str) -> Path:
    """Give the network that ships under a name, made by the `build.sh` beside it."""
    return Path(__file__).parent / "scenarios" / "networks" / name / "network.net.xml"


@dataclass(frozen=True, slots=True)
class ScenarioOption:
    """One knob of a scenario: its values are few and named."""

    name: str
    meaning: str
    values: tuple[str, ...] = _FLAGS
    """Allowed values, the default first; a flag unless said otherwise."""


DEMAND = ScenarioOption("demand", "how much traffic there is", ("normal", "low", "high"))
"""An option of several scenarios."""


# The checked options of one scenario by name, defaults filled in; a flag that is set is "1".
OptionValues = Mapping[str, str]


def read_options(scenario: str, known: Sequence[ScenarioOption], given: Mapping[str, str]) -> OptionValues:
    """Check options and fill in the defaults.

    Parameters
    ----------
    scenario : its name, for messages.
    known : the options that the scenario has.
    given : option names and values, as text.

    Returns
    -------
    A value for each known option.

    Raises
    ------
    DataGenError
        If an option is unknown or has a value that it does not know.

    Examples
    --------
    >>> lights = ScenarioOption("lights", "program of the traffic light", ("fixed", "actuated"))
    >>> read_options("junction", [lights], {})
    {'lights': 'fixed'}
    >>> read_options("junction", [lights], {"light": "off"})
    Traceback (most recent call last):
    ...
    data_gen.errors.DataGenError: scenario 'junction': expected options out of lights=fixed|actuated, got 'light'
    """
    by_name = {option.name: option for option in known}
    for name, value in given.items():
        if name not in by_name:
            raise DataGenError(f"scenario {scenario!r}: expected {_known_text(known)}, got {name!r}")
        if value not in by_name[name].values:
            expected = " or ".join(by_name[name].values)
            raise DataGenError(f"scenario {scenario!r}, option {name!r}: expected {expected}, got {value!r}")
    return {option.name: given.get(option.name, option.values[0]) for option in known}


def _known_text(known: Sequence[ScenarioOption]) -> str:
    if not known:
        return "no options"
    return "options out of " + ", ".join(f"{option.name}={'|'.join(option.values)}" for option in known)


def kind_of(vehicle_class: VehicleClass, share: float, driver: Driver = (), *, name: str | None = None) -> VehicleKind:
    """Describe vehicles of a class.

    Parameters
    ----------
    vehicle_class : gives sizes, those of common European models, and usual driving; buses and trucks are rigid ones.
    share : their part of the traffic.
    driver : SUMO attributes, laid over the usual ones; SUMO takes none twice.
    name : of the kind; that of the class unless told.

    Returns
    -------
    The kind.

    Examples
    --------
    >>> kind_of("van", 0.1, (("maxSpeed", "20"),)).driver
    (('accel', '2.2'), ('maxSpeed', '20'))
    """
    length_m, width_m, usual = _MODELS[vehicle_class]
    return VehicleKind(
        name or vehicle_class, vehicle_class, share, length_m, width_m, tuple({**usual, **dict(driver)}.items())
    )


def mix(shares: Mapping[VehicleClass, float], driver: Driver) -> tuple[VehicleKind, ...]:
    """Describe traffic of several classes that drive alike, by the part of each; see `kind_of`."""
    return tuple(kind_of(vehicle_class, share, driver) for vehicle_class, share in shares.items())
