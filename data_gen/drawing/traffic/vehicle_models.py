"""What shape and colours does a vehicle have? A stack of parts, each with a base, a top and its paint.

Both ways of drawing read the same parts: the sprite from straight above and the solid from a camera with a pose.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from data_gen.drawing.ground.paint import Colour, scaled
from data_gen.scenario import VehicleClass
from data_gen.simulation.states import FloatArray

PAINTS: tuple[tuple[float, Colour], ...] = (  # share; blue, green, red
    (0.22, (222, 224, 224)),
    (0.16, (172, 176, 177)),
    (0.14, (128, 128, 126)),
    (0.06, (106, 106, 104)),  # as grey as the asphalt: such cars exist, and are hard to see
    (0.13, (84, 83, 82)),
    (0.11, (46, 44, 43)),
    (0.07, (42, 44, 150)),
    (0.08, (128, 78, 44)),
    (0.03, (62, 88, 54)),
)
TARPAULINS: tuple[Colour, ...] = ((214, 216, 216), (180, 150, 120), (120, 140, 90), (90, 100, 180), (150, 155, 158))
LIVERIES: tuple[Colour, ...] = ((60, 70, 190), (200, 205, 205), (150, 95, 50), (70, 140, 90), (60, 180, 215))
GLASS: Colour = (52, 46, 42)
CHASSIS: Colour = (40, 40, 40)
RIDER: Colour = (48, 46, 58)
_HEIGHTS_M: dict[VehicleClass, float] = {"car": 1.45, "van": 2.3, "truck": 3.4, "bus": 3.0, "motorcycle": 1.5}
_CLEARANCE_M = 0.2
_CAR_BONNET_M, _VAN_BONNET_M = 0.95, 1.25
_CAB_M = 2.2


@dataclass(frozen=True, slots=True)
class VehicleLooks:
    """What a vehicle's picture depends on besides light and camera."""

    vehicle_class: VehicleClass
    length_m: float
    width_m: float
    appearance: int
    """Seed of paint and tint."""


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A flat, convex piece of a part's outside, such as a window, a lamp or a wheel."""

    outline_m: FloatArray
    """(n, 3), in the vehicle's frame, counter-clockwise as seen from outside."""
    colour: Colour
    is_lamp: bool = False
    """Shines alike in sun and shade, and shows however small it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A convex block with sloping sides; outlines in the vehicle's frame, x forward from the centre, y to the left."""

    base_m: FloatArray
    """(n, 2), counter-clockwise."""
    base_height_m: float
    top_m: FloatArray
    """(n, 2), corner by corner over the base."""
    top_height_m: float
    side: Colour
    top: Colour
    level: int = 0
    """Parts of a higher level stand on those of lower ones."""
    block_x_m: float = 0.0
    """Where the middle of the block is to which the part belongs; parts of one block stand on each other in order."""
    block_y_m: float = 0.0
    panels: tuple[Panel, ...] = ()
    """Drawn over the part's own sides, in order."""


def height_m(vehicle_class: VehicleClass) -> float:
    """Tell how high a vehicle of a class reaches, in metres."""
    return _HEIGHTS_M[vehicle_class]


def vehicle_parts(looks: VehicleLooks) -> tuple[Part, ...]:
    """Build a vehicle.

    Parameters
    ----------
    looks : class, size and appearance; the same looks give the same parts.

    Returns
    -------
    Parts from the bottom up; where one stands on another it comes later.
    """
    rng = np.random.default_rng(looks.appearance)
    build = {"car": _car, "van": _van, "truck": _truck, "bus": _bus, "motorcycle": _motorcycle}
    return tuple(build[looks.vehicle_class](looks, rng))


def _car(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    paint = draw_paint(rng)
    length_m, width_m = looks.length_m, looks.width_m
    # An estate's roof runs to the back, a saloon has a boot.
    roof_rear = float(rng.choice((-0.40, -0.24)))
    whole = _rounded(length_m, width_m, 0.28)
    yield Part(whole, _CLEARANCE_M, whole, _CAR_BONNET_M, scaled(paint, 0.9), scaled(paint, 0.98))
    bonnet = trapezoid(0.24 * length_m, 0.44 * length_m, 0.36 * width_m, 0.30 * width_m)
    yield Part(bonnet, _CAR_BONNET_M, bonnet, _CAR_BONNET_M, paint, scaled(paint, 1.03))
    glass = trapezoid((roof_rear - 0.08) * length_m, 0.20 * length_m, 0.40 * width_m, 0.43 * width_m)
    roof = trapezoid(roof_rear * length_m, 0.08 * length_m, 0.36 * width_m, 0.37 * width_m)
    yield Part(glass, _CAR_BONNET_M, roof, height_m("car"), GLASS, scaled(paint, 1.06))


def _van(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    paint = (222.0, 224.0, 224.0) if rng.random() < 0.5 else draw_paint(rng)
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    whole = _rounded(looks.length_m, looks.width_m, 0.2)
    yield Part(whole, _CLEARANCE_M, whole, _VAN_BONNET_M, scaled(paint, 0.9), scaled(paint, 0.98))
    screen_m, roof_m = 0.30 * looks.length_m, 0.14 * looks.length_m
    hold = trapezoid(-half_m, roof_m, side_m, side_m)
    hold_roof = trapezoid(-half_m + 0.05, roof_m, side_m * 0.9, side_m * 0.9)
    yield Part(hold, _VAN_BONNET_M, hold_roof, height_m("van"), scaled(paint, 0.92), scaled(paint, 1.05), 1, -1.0)
    cab = trapezoid(roof_m, screen_m, side_m, side_m * 0.94)
    cab_roof = trapezoid(roof_m, roof_m + 0.3, side_m * 0.9, side_m * 0.86)
    front_m = (roof_m + screen_m) / 2
    yield Part(cab, _VAN_BONNET_M, cab_roof, height_m("van"), GLASS, scaled(paint, 1.05), 1, front_m)


def _truck(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    tarpaulin = scaled(TARPAULINS[rng.integers(len(TARPAULINS))], float(rng.uniform(0.85, 1.1)))
    paint = draw_paint(rng)
    whole = trapezoid(-half_m, half_m, side_m, side_m)
    yield Part(whole, 0.5, whole, 0.9, CHASSIS, CHASSIS)
    box = trapezoid(-half_m, half_m - _CAB_M - 0.3, side_m, side_m)
    cab = trapezoid(half_m - _CAB_M, half_m, side_m * 0.98, side_m * 0.94)
    roof = trapezoid(half_m - _CAB_M, half_m - 0.15, side_m * 0.96, side_m * 0.9)
    front_m, rear_m = half_m - _CAB_M / 2, -_CAB_M / 2
    yield Part(cab, 0.9, roof, 2.9, paint, paint, 1, front_m)
    pane = trapezoid(half_m - 0.65, half_m - 0.15, side_m * 0.85, side_m * 0.8)
    yield Part(pane, 2.9, pane, 2.9, GLASS, GLASS, 1, front_m)
    yield Part(box, 0.9, box, height_m("truck"), scaled(tarpaulin, 0.95), tarpaulin, 1, rear_m)
    middle = trapezoid(-half_m + 0.3, half_m - _CAB_M - 0.6, side_m * 0.8, side_m * 0.8)
    top_m = height_m("truck")
    yield Part(middle, top_m, middle, top_m, tarpaulin, scaled(tarpaulin, 1.06), 1, rear_m)


def _bus(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    livery = scaled(LIVERIES[rng.integers(len(LIVERIES))], float(rng.uniform(0.85, 1.1)))
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    whole = trapezoid(-half_m, half_m, side_m, side_m)
    yield Part(whole, 0.3, whole, 1.2, livery, livery)
    yield Part(whole, 1.2, whole, 2.5, GLASS, GLASS)
    roof = trapezoid(-half_m, half_m - 0.1, side_m, side_m)
    top_m = height_m("bus")
    yield Part(whole, 2.5, roof, top_m, livery, scaled(livery, 1.04))
    hatch = trapezoid(-0.1 * looks.length_m, 0.12 * looks.length_m, side_m * 0.5, side_m * 0.5)
    yield Part(hatch, top_m, hatch, top_m, livery, scaled(livery, 0.8))


def _motorcycle(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    frame = trapezoid(-half_m, half_m, 0.18, 0.18)
    yield Part(frame, 0.1, frame, 0.8, CHASSIS, draw_paint(rng))
    bars = trapezoid(0.18 * looks.length_m, 0.26 * looks.length_m, side_m, side_m)
    yield Part(bars, 0.9, bars, 1.0, CHASSIS, CHASSIS, 1, 0.22 * looks.length_m)
    rider = trapezoid(-0.22 * looks.length_m, 0.12 * looks.length_m, side_m * 0.7, side_m * 0.85)
    shoulders = trapezoid(-0.15 * looks.length_m, 0.1 * looks.length_m, 0.2, 0.25)
    yield Part(rider, 0.8, shoulders, 1.4, RIDER, RIDER, 1)
    helmet = _rounded(0.3, 0.28, 0.08) + np.array((0.05 * looks.length_m, 0.0))
    yield Part(helmet, 1.3, helmet, height_m("motorcycle"), draw_paint(rng), draw_paint(rng), 1)


def draw_paint(rng: np.random.Generator) -> Colour:
    """Draw the colour of a vehicle, as often as it is seen on roads."""
    shares = np.array([share for share, _ in PAINTS])
    _, colour = PAINTS[rng.choice(len(PAINTS), p=shares / shares.sum())]
    return scaled(colour, float(rng.uniform(0.8, 1.2)))


def trapezoid(rear_m: float, front_m: float, half_rear_m: float, half_front_m: float) -> FloatArray:
    """Outline a block that may narrow to the front, (4, 2) from rear right on."""
    return np.array([[rear_m, -half_rear_m], [front_m, -half_front_m], [front_m, half_front_m], [rear_m, half_rear_m]])


def _rounded(length_m: float, width_m: float, radius_m: float) -> FloatArray:
    """Outline a rectangle with cut-off corners, (8, 2)."""
    x_m, y_m = length_m / 2, width_m / 2
    quarter = np.array([[x_m, y_m - radius_m], [x_m - radius_m, y_m]])
    mirrored = quarter[::-1] * (-1, 1)
    return np.vstack((quarter, mirrored, -quarter, -mirrored))
