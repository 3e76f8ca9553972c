"""What does a vehicle look like from the side, from behind and from the front? Bodies with windows, lamps and wheels.

The parts are those of `vehicle_models`, more of them and with panels: a stack of rounded slabs whose sides lean. All
slabs have eight sides, in the same order, so that a panel names the side on which it lies.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from data_gen.drawing.ground.paint import Colour, scaled
from data_gen.drawing.traffic.vehicle_models import (
    CHASSIS,
    GLASS,
    LIVERIES,
    RIDER,
    TARPAULINS,
    Panel,
    Part,
    VehicleLooks,
    draw_paint,
)
from data_gen.simulation.states import FloatArray

LEFT, REAR, RIGHT, FRONT = 1, 3, 5, 7
_FRONT_CORNERS, _REAR_CORNERS = (0, 6), (2, 4)
_TYRE: Colour = (30, 29, 29)
_GRILLE: Colour = (34, 34, 34)
_PLATE: Colour = (214, 222, 222)
_TAIL_LAMP: Colour = (34, 30, 150)
_BRAKE_LAMP: Colour = (60, 50, 245)
_HEAD_LAMP: Colour = (214, 210, 204)
_LIT_LAMP: Colour = (250, 253, 255)
_REFLECTOR: Colour = (40, 130, 220)
_STEEL: Colour = (176, 176, 174)


def vehicle_body(looks: VehicleLooks) -> tuple[Part, ...]:
    """Build a vehicle in detail.

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


@dataclass(frozen=True, slots=True, eq=False)
class _Slab:
    """A block between two rounded outlines, each given by rear end, front end and half its width."""

    low: tuple[float, float, float]
    low_m: float
    high: tuple[float, float, float]
    high_m: float
    corner_m: float = 0.08
    panels: list[Panel] = field(default_factory=list)

    def outline(self, ends: tuple[float, float, float]) -> FloatArray:
        """Give the corners, (8, 2): side k runs from corner k to the next one."""
        rear_m, front_m, half_m = ends
        cut_m = min(self.corner_m, 0.4 * half_m, 0.4 * (front_m - rear_m))
        left = [
            (front_m, half_m - cut_m),
            (front_m - cut_m, half_m),
            (rear_m + cut_m, half_m),
            (rear_m, half_m - cut_m),
        ]
        return np.array(left + [(x_m, -y_m) for x_m, y_m in reversed(left)])

    def put(
        self, side: int, across: tuple[float, float], up: tuple[float, float], colour: Colour, *, is_lamp: bool = False
    ) -> "_Slab":
        """Put a panel on a side.

        Parameters
        ----------
        side : its number; LEFT and RIGHT are measured from the rear, FRONT and REAR from the left.
        across, up : where it begins and ends, 0 to 1 of the side.
        colour, is_lamp : of the panel.

        Returns
        -------
        The slab itself.
        """
        low, high = self.outline(self.low), self.outline(self.high)
        after = (side + 1) % 8
        if side in (LEFT, FRONT):
            across = 1 - across[1], 1 - across[0]
        foot, head = (
            np.column_stack((outline[[side, after]], np.full(2, up_m)))
            for outline, up_m in ((low, self.low_m), (high, self.high_m))
        )
        corners = [(across[0], up[0]), (across[1], up[0]), (across[1], up[1]), (across[0], up[1])]
        points = [
            (1 - v) * ((1 - u) * foot[0] + u * foot[1]) + v * ((1 - u) * head[0] + u * head[1]) for u, v in corners
        ]
        self.panels.append(Panel(np.array(points), colour, is_lamp))
        return self

    def put_pair(
        self, side: int, across: tuple[float, float], up: tuple[float, float], colour: Colour, *, is_lamp: bool = True
    ) -> None:
        """Put a panel on a side, and its mirror image."""
        self.put(side, across, up, colour, is_lamp=is_lamp)
        self.put(side, (1 - across[1], 1 - across[0]), up, colour, is_lamp=is_lamp)

    def part(self, side: Colour, top: Colour, level: int, *, block_x_m: float = 0.0) -> Part:
        """Paint the slab."""
        outlines = self.outline(self.low), self.low_m, self.outline(self.high), self.high_m
        return Part(*outlines, side, top, level, block_x_m, panels=tuple(self.panels))


def _straight(
    rear_m: float, front_m: float, half_m: float, *, up_m: tuple[float, float], corner_m: float = 0.08
) -> _Slab:
    ends = (rear_m, front_m, half_m)
    return _Slab(ends, up_m[0], ends, up_m[1], corner_m)


def _moved(part: Part, by_m: tuple[float, float], block_m: tuple[float, float]) -> Part:
    """Move a part, into the block about a place."""
    base_m, top_m = part.base_m + np.array(by_m), part.top_m + np.array(by_m)
    return replace(part, base_m=base_m, top_m=top_m, block_x_m=block_m[0], block_y_m=block_m[1])


def _wheels(
    axles_m: Sequence[float], half_m: float, radius_m: float, rim: Colour, arch: Colour | None
) -> tuple[list[Part], list[Panel]]:
    """Build wheels: what shows of them under the body, and the discs at its sides with their arches."""
    blocks, discs = [], []
    for x_m in axles_m:
        for sign in (-1.0, 1.0):
            tread_m = sign * (half_m - 0.12)
            block = _straight(
                x_m - 0.8 * radius_m, x_m + 0.8 * radius_m, 0.1, up_m=(0.0, 1.2 * radius_m), corner_m=0.02
            )
            blocks.append(_moved(block.part(_TYRE, _TYRE, 0), (0.0, tread_m), (x_m, tread_m)))
            for size, colour in ((1.18, arch), (1.0, _TYRE), (0.62, rim), (0.2, _GRILLE)):
                if colour is not None:
                    discs.append(Panel(_disc(x_m, sign * (half_m + 0.01), radius_m, size * radius_m, sign), colour))
    return blocks, discs


def _disc(x_m: float, y_m: float, up_m: float, radius_m: float, sign: float) -> FloatArray:
    """Outline an upright disc that looks to the left (sign 1) or right (-1)."""
    angle = -sign * np.linspace(0, math.tau, 12, endpoint=False)
    return np.column_stack(
        (x_m + radius_m * np.cos(angle), np.full(12, y_m), np.maximum(0, up_m + radius_m * np.sin(angle)))
    )


def _paint_of(rng: np.random.Generator) -> Colour:
    """Draw a paint: mostly the usual ones, now and then any colour at all."""
    if rng.random() > 0.12:
        return draw_paint(rng)
    blue, green, red = rng.uniform(20, 225, 3)
    return float(blue), float(green), float(red)


_CAR_SHAPES = {  # share; ends of roof and glass: roof rear, glass rear, glass front, roof front; height; belt (part)
    "hatchback": (0.34, (-0.36, -0.46, 0.22, 0.05), (1.42, 1.52), 0.62),
    "saloon": (0.22, (-0.20, -0.35, 0.20, 0.04), (1.38, 1.48), 0.62),
    "estate": (0.18, (-0.43, -0.475, 0.20, 0.04), (1.42, 1.52), 0.62),
    "suv": (0.20, (-0.40, -0.47, 0.22, 0.06), (1.58, 1.75), 0.63),
    "people carrier": (0.06, (-0.42, -0.475, 0.30, 0.10), (1.6, 1.75), 0.58),
}


def _car(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    shares = np.array([shape[0] for shape in _CAR_SHAPES.values()])
    _, ends, heights_m, belt = list(_CAR_SHAPES.values())[rng.choice(len(shares), p=shares)]
    length_m, half_m = looks.length_m, looks.width_m / 2
    roof_rear, screen_rear, screen_front, roof_front = (
        length_m * (share + float(rng.uniform(-0.012, 0.012))) for share in ends
    )
    top_m = float(rng.uniform(*heights_m))
    belt_m, sill_m, waist_m = belt * top_m, 0.17 * top_m, 0.43 * top_m
    paint, trim = _paint_of(rng), (46.0, 46.0, 46.0)
    rim = scaled((150, 150, 148), float(rng.uniform(0.5, 1.25)))
    radius_m = 0.218 * top_m
    tyres, discs = _wheels((-0.29 * length_m, 0.31 * length_m), half_m, radius_m, rim, scaled(paint, 0.35))
    yield from tyres
    rear_m, front_m = -length_m / 2, length_m / 2
    yield _straight(rear_m + 0.25, front_m - 0.25, half_m - 0.15, up_m=(0.14, sill_m + 0.05)).part(CHASSIS, CHASSIS, 0)
    lower = _Slab((rear_m + 0.06, front_m - 0.06, half_m - 0.03), sill_m, (rear_m, front_m, half_m), waist_m, 0.24)
    dark = trim if rng.random() < 0.5 else scaled(paint, 0.75)
    for side in range(8):
        lower.put(side, (0.0, 1.0), (0.0, 0.3), dark)
    lower.put(FRONT, (0.2, 0.8), (0.35, 0.8), _GRILLE)
    head = _LIT_LAMP if rng.random() < 0.45 else _HEAD_LAMP
    inner, low = float(rng.uniform(0.18, 0.3)), float(rng.uniform(0.58, 0.7))
    lower.put_pair(FRONT, (0.0, inner), (low, 0.98), head)
    for side in _FRONT_CORNERS:
        lower.put(side, (0.0, 1.0), (low, 0.98), head, is_lamp=True)
    lower.put(FRONT, (0.36, 0.64), (0.4, 0.7), _PLATE)
    lower.put_pair(REAR, (0.03, 0.12), (0.35, 0.5), _TAIL_LAMP)
    lower.panels.extend(discs)
    yield lower.part(scaled(paint, 0.92), paint, 1)
    yield _shoulder(looks, rng, paint, up_m=(waist_m, belt_m), screen_m=screen_front)
    foot, head_ends = (screen_rear, screen_front, half_m * 0.93), (roof_rear, roof_front, half_m * 0.74)
    cabin = _Slab(foot, belt_m, head_ends, top_m, 0.06)
    _glaze_car(cabin, rng)
    yield cabin.part(scaled(paint, 0.95), scaled(paint, 1.05), 3)
    for sign in (-1.0, 1.0):
        ear = _straight(0.0, 0.1, 0.09, up_m=(belt_m, belt_m + 0.15), corner_m=0.02).part(scaled(paint, 0.9), paint, 3)
        shift_m = screen_front - 0.28, sign * (half_m + 0.05)
        yield _moved(ear, shift_m, shift_m)


def _shoulder(
    looks: VehicleLooks,
    rng: np.random.Generator,
    paint: Colour,
    *,
    up_m: tuple[float, float],
    screen_m: float,
) -> Part:
    """Build a car between lamps and windows: the bonnet slopes down to the front."""
    rear_m, front_m, half_m = -looks.length_m / 2, looks.length_m / 2, looks.width_m / 2
    slab = _Slab((rear_m, front_m, half_m), up_m[0], (rear_m + 0.07, screen_m, half_m * 0.95), up_m[1], 0.2)
    tail = _BRAKE_LAMP if rng.random() < 0.2 else _TAIL_LAMP
    wide, high = float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.65, 1.0))
    slab.put_pair(REAR, (0.0, wide), (0.3, high), tail)
    for side in _REAR_CORNERS:
        slab.put(side, (0.0, 1.0), (0.3, high), tail, is_lamp=True)
    slab.put(REAR, (0.34, 0.66), (0.25, 0.75) if rng.random() < 0.7 else (0.0, 0.3), _PLATE)
    for share in (0.28, 0.52):
        for side in (LEFT, RIGHT):
            slab.put(side, (share, share + 0.006), (0.0, 1.0), scaled(paint, 0.5))
    return slab.part(scaled(paint, 0.97), scaled(paint, 1.02), 2)


def _glaze_car(cabin: _Slab, rng: np.random.Generator) -> None:
    glass = scaled(GLASS, float(rng.uniform(0.7, 1.4)))
    cabin.put(FRONT, (0.04, 0.96), (0.06, 0.95), scaled(glass, 1.35))
    cabin.put(REAR, (0.08, 0.92), (0.15, 0.88), glass)
    pillar = float(rng.uniform(0.5, 0.6))
    for side in (LEFT, RIGHT):
        for across in ((0.13, 0.3), (0.325, pillar), (pillar + 0.03, 0.93)):
            cabin.put(side, across, (0.06, 0.88), glass)


def _van(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    paint = (222.0, 224.0, 224.0) if rng.random() < 0.5 else _paint_of(rng)
    length_m, half_m = looks.length_m, looks.width_m / 2
    rear_m, front_m = -length_m / 2, length_m / 2
    top_m = float(rng.uniform(1.95, 2.6))
    has_windows = rng.random() < 0.35
    rim = scaled((140, 140, 140), float(rng.uniform(0.6, 1.2)))
    tyres, discs = _wheels((-0.28 * length_m, 0.31 * length_m), half_m, 0.34, rim, scaled(paint, 0.3))
    yield from tyres
    yield _straight(rear_m + 0.2, front_m - 0.3, half_m - 0.15, up_m=(0.18, 0.5)).part(CHASSIS, CHASSIS, 0)
    lower = _Slab((rear_m, front_m - 0.03, half_m), 0.32, (rear_m, front_m, half_m), 0.78, 0.16)
    for side in (FRONT, REAR, *_FRONT_CORNERS, *_REAR_CORNERS):
        lower.put(side, (0.0, 1.0), (0.0, 0.5), (48.0, 48.0, 48.0))
    lower.put(FRONT, (0.36, 0.64), (0.15, 0.42), _PLATE)
    lower.put(FRONT, (0.22, 0.78), (0.55, 0.95), _GRILLE)
    lower.put_pair(FRONT, (0.0, 0.2), (0.62, 0.98), _LIT_LAMP if rng.random() < 0.45 else _HEAD_LAMP)
    lower.panels.extend(discs)
    yield lower.part(scaled(paint, 0.92), paint, 1)
    screen_m = front_m - 0.16 * length_m
    nose = _Slab((rear_m, front_m, half_m), 0.78, (rear_m, screen_m, half_m * 0.98), 1.18, 0.14)
    nose.put_pair(REAR, (0.0, 0.07), (0.2, 1.0), _TAIL_LAMP)
    nose.put(REAR, (0.12, 0.36), (0.2, 0.45), _PLATE)
    yield nose.part(scaled(paint, 0.95), scaled(paint, 1.02), 2)
    low, high = (rear_m, screen_m, half_m * 0.98), (rear_m + 0.06, screen_m - 0.32 * top_m, half_m * 0.86)
    hold = _Slab(low, 1.18, high, top_m, 0.08)
    hold.put(FRONT, (0.04, 0.96), (0.04, 0.72), scaled(GLASS, 1.4))
    hold.put_pair(REAR, (0.1, 0.46), (0.2, 0.72), GLASS, is_lamp=False)
    hold.put(REAR, (0.49, 0.51), (0.0, 1.0), scaled(paint, 0.6))
    for side in (LEFT, RIGHT):
        hold.put(side, (0.76, 0.95), (0.05, 0.6), GLASS)
        hold.put(side, (0.73, 0.735), (0.0, 1.0), scaled(paint, 0.6))
        if has_windows:
            hold.put(side, (0.06, 0.36), (0.1, 0.62), GLASS)
            hold.put(side, (0.4, 0.7), (0.1, 0.62), GLASS)
    yield hold.part(scaled(paint, 0.96), scaled(paint, 1.05), 3)


def _truck(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    rear_m, front_m, half_m = -looks.length_m / 2, looks.length_m / 2, looks.width_m / 2
    paint = _paint_of(rng)
    load = TARPAULINS[rng.integers(len(TARPAULINS))] if rng.random() < 0.7 else _paint_of(rng)
    tarpaulin = scaled(load, float(rng.uniform(0.85, 1.1)))
    cab_m, top_m = float(rng.uniform(1.9, 2.4)), float(rng.uniform(3.2, 3.9))
    axles_m = (front_m - 1.3, rear_m + 1.6, *((rear_m + 2.9,) if looks.length_m > 9.5 else ()))
    tyres, discs = _wheels(axles_m, half_m - 0.04, 0.5, (130.0, 130.0, 130.0), None)
    yield from tyres
    frame = _straight(rear_m, front_m - 0.4, half_m - 0.12, up_m=(0.5, 1.05))
    frame.put_pair(REAR, (0.02, 0.16), (0.35, 0.65), _TAIL_LAMP)
    frame.put(REAR, (0.4, 0.6), (0.2, 0.6), _PLATE)
    for side in (LEFT, RIGHT):
        frame.put(side, (0.34, 0.72), (0.0, 0.75), (92.0, 94.0, 94.0))
        frame.put(side, (0.4, 0.42), (0.3, 0.5), _REFLECTOR)
    frame.panels.extend(discs)
    yield frame.part(CHASSIS, CHASSIS, 1)
    yield from _load(rng, tarpaulin, (rear_m, front_m - cab_m - 0.25, half_m), top_m)
    yield from _cab(rng, paint, (front_m - cab_m, front_m, half_m), min(top_m - 0.1, float(rng.uniform(2.7, 3.5))))


def _cab(rng: np.random.Generator, paint: Colour, ends: tuple[float, float, float], top_m: float) -> Iterator[Part]:
    rear_m, front_m, half_m = ends
    block_x_m = (rear_m + front_m) / 2
    foot = _straight(rear_m, front_m, half_m * 0.98, up_m=(0.4, 1.35), corner_m=0.16)
    foot.put(FRONT, (0.0, 1.0), (0.0, 0.28), (52.0, 52.0, 52.0))
    foot.put_pair(FRONT, (0.0, 0.17), (0.12, 0.34), _LIT_LAMP if rng.random() < 0.5 else _HEAD_LAMP)
    foot.put(FRONT, (0.38, 0.62), (0.06, 0.22), _PLATE)
    foot.put(FRONT, (0.12, 0.88), (0.45, 0.95), scaled(paint, 0.45) if rng.random() < 0.6 else _GRILLE)
    foot.panels.extend(_wheels((front_m - 1.3,), half_m * 0.98, 0.5, (130.0, 130.0, 130.0), _GRILLE)[1])
    yield foot.part(scaled(paint, 0.92), paint, 2, block_x_m=block_x_m)
    house = _Slab((rear_m, front_m, half_m * 0.98), 1.35, (rear_m, front_m - 0.3, half_m * 0.92), top_m, 0.14)
    pane = 0.85 / (top_m - 1.35)
    house.put(FRONT, (0.05, 0.95), (0.12, min(0.95, 0.12 + pane)), scaled(GLASS, 1.3))
    for side in (LEFT, RIGHT):
        house.put(side, (0.42, 0.93), (0.12, min(0.9, 0.1 + pane)), GLASS)
    yield house.part(scaled(paint, 0.96), scaled(paint, 1.03), 2, block_x_m=block_x_m)
    for sign in (-1.0, 1.0):
        ear = _straight(front_m - 0.22, front_m - 0.1, 0.12, up_m=(1.75, 2.35), corner_m=0.02).part(_GRILLE, _GRILLE, 2)
        aside_m = sign * (half_m + 0.12)
        yield _moved(ear, (0.0, aside_m), (front_m - 0.1, aside_m))


def _load(rng: np.random.Generator, colour: Colour, ends: tuple[float, float, float], top_m: float) -> Iterator[Part]:
    """Build what a truck carries: a box, a tarpaulin, a tank or a tipper's open skip."""
    rear_m, front_m, half_m = ends
    block_x_m = (rear_m + front_m) / 2
    kind = rng.choice(("box", "tarpaulin", "tank", "skip"), p=(0.4, 0.36, 0.12, 0.12))
    if kind == "tank":
        steel = scaled(_STEEL, float(rng.uniform(0.8, 1.3)))
        for low, high, low_m, high_m, shade in (
            (0.55, 0.98, 1.05, 1.5, 0.6),
            (0.98, 0.98, 1.5, 2.3, 0.9),
            (0.98, 0.5, 2.3, 2.9, 1.0),
        ):
            slab = _Slab((rear_m, front_m, half_m * low), low_m, (rear_m, front_m, half_m * high), high_m, 0.3)
            if shade == 0.9:
                slab.put(REAR, (0.3, 0.7), (0.3, 0.8), _REFLECTOR)
            yield slab.part(scaled(steel, shade), steel, 2, block_x_m=block_x_m)
        return
    if kind == "skip":
        top_m = min(top_m, 2.5)
    box = _straight(rear_m, front_m, half_m, up_m=(1.05, top_m), corner_m=0.04)
    if kind == "box":
        box.put(REAR, (0.49, 0.51), (0.02, 0.98), scaled(colour, 0.55))
        box.put_pair(REAR, (0.2, 0.22), (0.02, 0.98), scaled(colour, 0.7), is_lamp=False)
        for side in (LEFT, RIGHT) if rng.random() < 0.6 else ():
            low, high = sorted(rng.uniform(0.1, 0.9, 2).tolist())
            box.put(side, (low, high), (0.45, 0.75), _paint_of(rng))
    else:
        for side in (LEFT, RIGHT):
            for share in np.linspace(0.02, 0.96, 7):
                box.put(side, (share, share + 0.015), (0.0, 1.0), scaled(colour, 0.8))
            box.put(side, (0.0, 1.0), (0.0, 0.06), scaled(colour, 0.5))
        box.put(REAR, (0.06, 0.94), (0.05, 0.94), scaled(colour, 0.9 if kind == "tarpaulin" else 0.7))
    box.put(REAR, (0.02, 0.98), (0.0, 0.03), (60.0, 60.0, 190.0))
    top = (90.0, 100.0, 112.0) if kind == "skip" else colour
    yield box.part(scaled(colour, 0.95), top, 2, block_x_m=block_x_m)


def _bus(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    livery = scaled(LIVERIES[rng.integers(len(LIVERIES))], float(rng.uniform(0.85, 1.1)))
    rear_m, front_m, half_m = -looks.length_m / 2, looks.length_m / 2, looks.width_m / 2
    top_m = float(rng.uniform(2.9, 3.5))
    glass = scaled(GLASS, float(rng.uniform(0.8, 1.3)))
    tyres, discs = _wheels(
        (-0.28 * looks.length_m, 0.27 * looks.length_m), half_m, 0.48, (130.0, 130.0, 130.0), _GRILLE
    )
    yield from tyres
    lower = _straight(rear_m, front_m, half_m, up_m=(0.3, 1.2), corner_m=0.14)
    lower.put_pair(FRONT, (0.02, 0.18), (0.25, 0.5), _LIT_LAMP if rng.random() < 0.5 else _HEAD_LAMP)
    lower.put_pair(REAR, (0.02, 0.12), (0.4, 0.9), _TAIL_LAMP)
    lower.put(REAR, (0.2, 0.8), (0.1, 0.7), _GRILLE)
    for side in (FRONT, REAR):
        lower.put(side, (0.4, 0.6), (0.12, 0.3), _PLATE)
    lower.panels.extend(discs)
    yield lower.part(livery, livery, 1)
    middle = _straight(rear_m, front_m, half_m, up_m=(1.2, 0.8 * top_m), corner_m=0.12)
    middle.put(FRONT, (0.04, 0.96), (0.0, 1.0), scaled(glass, 1.25))
    middle.put(REAR, (0.12, 0.88), (0.3, 1.0), glass)
    for side in (LEFT, RIGHT):
        for share in np.linspace(0.02, 0.86, 7):
            middle.put(side, (share, share + 0.125), (0.06, 0.98), glass)
    middle.put(RIGHT, (0.9, 0.98), (0.0, 0.98), scaled(glass, 0.8))
    yield middle.part(scaled(livery, 0.8), livery, 2)
    roof = _Slab((rear_m, front_m, half_m), 0.8 * top_m, (rear_m, front_m - 0.1, half_m * 0.94), top_m, 0.12)
    roof.put(FRONT, (0.2, 0.8), (0.2, 0.8), (60.0, 190.0, 235.0) if rng.random() < 0.6 else _GRILLE)
    yield roof.part(livery, scaled(livery, 1.04), 3)


def _motorcycle(looks: VehicleLooks, rng: np.random.Generator) -> Iterator[Part]:
    half_m, side_m, paint = looks.length_m / 2, looks.width_m / 2, _paint_of(rng)
    dress = RIDER if rng.random() < 0.7 else _paint_of(rng)
    _, discs = _wheels((-half_m + 0.32, half_m - 0.32), 0.09, 0.32, (110.0, 110.0, 110.0), None)
    for x_m in (-half_m + 0.32, half_m - 0.32):
        yield _straight(x_m - 0.3, x_m + 0.3, 0.07, up_m=(0.0, 0.62), corner_m=0.05).part(
            _TYRE, _TYRE, 0, block_x_m=x_m
        )
    frame = _Slab(
        (-0.34 * looks.length_m, 0.3 * looks.length_m, 0.16),
        0.3,
        (-0.4 * looks.length_m, 0.36 * looks.length_m, 0.2),
        0.85,
    )
    frame.put(FRONT, (0.2, 0.8), (0.4, 0.95), _LIT_LAMP, is_lamp=True)
    frame.put(REAR, (0.2, 0.8), (0.6, 0.95), _TAIL_LAMP, is_lamp=True)
    frame.put(REAR, (0.25, 0.75), (0.2, 0.55), _PLATE)
    frame.panels.extend(discs)
    yield frame.part(scaled(paint, 0.8), paint, 1)
    bars = _straight(0.16 * looks.length_m, 0.24 * looks.length_m, side_m, up_m=(0.92, 1.0), corner_m=0.02)
    yield bars.part(CHASSIS, CHASSIS, 2, block_x_m=0.2 * looks.length_m)
    low, high = (
        (-0.26 * looks.length_m, 0.14 * looks.length_m, side_m * 0.62),
        (-0.14 * looks.length_m, 0.1 * looks.length_m, 0.24),
    )
    yield _Slab(low, 0.72, high, 1.36, 0.1).part(dress, dress, 2, block_x_m=-0.05 * looks.length_m)
    head_m = 0.04 * looks.length_m
    helmet = _Slab((head_m - 0.12, head_m + 0.12, 0.11), 1.36, (head_m - 0.13, head_m + 0.13, 0.12), 1.62, 0.07)
    helmet.put(FRONT, (0.0, 1.0), (0.35, 0.75), GLASS)
    shell = _paint_of(rng)
    yield helmet.part(shell, scaled(shell, 1.1), 3)
