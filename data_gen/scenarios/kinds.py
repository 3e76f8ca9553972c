"""Which road users do scenarios mix? Sizes and driving of cars, vans, trucks, buses and motorcycles.

Sizes are those of common European models; buses and trucks are rigid ones.
"""

from data_gen.scenario import VehicleKind

Driver = tuple[tuple[str, str], ...]

_NO_ATTRIBUTES: Driver = ()
_HEAVY: Driver = (("accel", "1.2"), ("decel", "4"))


def car(share: float, driver: Driver = _NO_ATTRIBUTES, *, name: str = "car") -> VehicleKind:
    """Describe passenger cars, from a small one to an estate; `share` is their part of the traffic."""
    return VehicleKind(name, "car", share, (3.9, 4.9), (1.7, 1.9), driver)


def van(share: float, driver: Driver = _NO_ATTRIBUTES, *, name: str = "van") -> VehicleKind:
    """Describe delivery vans."""
    return VehicleKind(name, "van", share, (5.0, 6.4), (1.95, 2.1), _over((("accel", "2.2"),), driver))


def truck(share: float, driver: Driver = _NO_ATTRIBUTES, *, name: str = "truck") -> VehicleKind:
    """Describe rigid trucks."""
    return VehicleKind(name, "truck", share, (8.0, 11.5), (2.4, 2.55), _over(_HEAVY, driver))


def bus(share: float, driver: Driver = _NO_ATTRIBUTES, *, name: str = "bus") -> VehicleKind:
    """Describe town buses."""
    return VehicleKind(name, "bus", share, (11.5, 12.2), (2.5, 2.55), _over(_HEAVY, driver))


def motorcycle(share: float, driver: Driver = _NO_ATTRIBUTES, *, name: str = "motorcycle") -> VehicleKind:
    """Describe motorcycles with a rider."""
    return VehicleKind(name, "motorcycle", share, (2.0, 2.3), (0.75, 0.9), _over((("accel", "4"),), driver))


def _over(usual: Driver, driver: Driver) -> Driver:
    """Lay a scenario's attributes over the usual ones; SUMO takes none twice."""
    return tuple({**dict(usual), **dict(driver)}.items())
