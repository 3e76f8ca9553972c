"""Scenes for the tests of the relations."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qsr.changes.crossings import BoolArray, RelationChange, Value
from qsr.measuring.footprints import FloatArray, Footprints


def footprints(
    t_us: int,
    ids: Sequence[str],
    xy_m: Sequence[Sequence[float]] | FloatArray,
    *,
    heading_rad: Sequence[float] | float = 0.0,
    speed_mps: Sequence[float] | float = 10.0,
    length_m: float = 4.0,
    width_m: float = 2.0,
    road: Sequence[int] | int = -1,
    junction: Sequence[int] | int = -1,
    lane: Sequence[int] | int = -1,
    straight_road: bool = False,
    observed: Sequence[bool] | bool = True,
) -> Footprints:
    """Build one frame; a straight road runs along the x axis, so that along is x and across is y."""
    count = len(ids)
    centre_m = np.asarray(xy_m, dtype=np.float64).reshape(count, 2)
    none = np.full(count, np.nan)
    return Footprints.of(
        t_us=t_us,
        ids=tuple(ids),
        centre_m=centre_m,
        heading_rad=np.broadcast_to(np.asarray(heading_rad, dtype=np.float64), (count,)).copy(),
        speed_mps=np.broadcast_to(np.asarray(speed_mps, dtype=np.float64), (count,)).copy(),
        length_m=np.full(count, length_m),
        width_m=np.full(count, width_m),
        road=np.broadcast_to(np.asarray(0 if straight_road else road, dtype=np.int32), (count,)).copy(),
        along_m=centre_m[:, 0].copy() if straight_road else none,
        across_m=centre_m[:, 1].copy() if straight_road else none,
        tangent_rad=np.zeros(count) if straight_road else none,
        junction=np.broadcast_to(np.asarray(junction, dtype=np.int32), (count,)).copy(),
        lane=np.broadcast_to(np.asarray(lane, dtype=np.int32), (count,)).copy(),
        observed=np.broadcast_to(np.asarray(observed, dtype=np.bool_), (count,)).copy(),
    )


def changes_of(changes: Sequence[RelationChange], name: str, *args: str) -> list[tuple[int, Value, Value]]:
    """Pick the changes of one relation instance: time, old, new."""
    return [(change.t_us, change.old, change.new) for change in changes if (change.name, change.args) == (name, args)]


_RADIUS_M = 120.0


@dataclass(slots=True)
class _Drivers:
    """Cars on a bend of 180 m and on the open ground; `along_m` and `across_m` count on the road, `xy_m` beside it."""

    on_road: BoolArray
    sign: FloatArray
    along_m: FloatArray
    across_m: FloatArray
    speed_mps: FloatArray
    xy_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray


def random_traffic(
    rng: np.random.Generator, *, frames: int, count: int, period_us: int = 100_000, noise_m: float = 0.2
) -> Iterator[Footprints]:
    """Drive cars on a bent two-way road with a junction, and a few across the open ground.

    Cars come and go at random, some come back under their old name, and the order within a frame is shuffled. Some are
    only predicted for a while.
    """
    drivers = _draw_drivers(rng, count)
    seen = rng.random(count) < 0.5
    hiding = rng.spawn(1)[0]
    hidden = np.zeros(count, dtype=np.bool_)
    for frame in range(frames):
        t_us = frame * period_us + int(rng.integers(0, 1000))
        _drive(drivers, rng, period_us)
        centre_m, body_rad = _bodies(drivers, rng, noise_m)
        seen ^= rng.random(count) < 0.02
        hidden ^= hiding.random(count) < np.where(hidden, 0.3, 0.1)
        order = rng.permutation(np.flatnonzero(seen))
        frame_of_all = _place(drivers, rng, t_us, order=order, centre_m=centre_m, body_rad=body_rad, noise_m=noise_m)
        yield frame_of_all.having(observed=~hidden[order])


def _draw_drivers(rng: np.random.Generator, count: int) -> _Drivers:
    on_road = rng.random(count) < 0.7
    sign = np.where(rng.random(count) < 0.6, 1.0, -1.0)
    return _Drivers(
        on_road=on_road,
        sign=sign,
        along_m=rng.uniform(0, 150, count),
        across_m=np.where(sign > 0, -1.75, 1.75) * rng.choice([1.0, -1.0], count, p=[0.8, 0.2]),
        speed_mps=rng.uniform(0.0, 25.0, count),
        xy_m=rng.uniform(-60, 60, (count, 2)) + np.array([0.0, _RADIUS_M]),
        heading_rad=rng.uniform(-math.pi, math.pi, count),
        length_m=rng.uniform(2, 14, count),
        width_m=rng.uniform(0.8, 2.5, count),
    )


def _drive(drivers: _Drivers, rng: np.random.Generator, period_us: int) -> None:
    count = len(drivers.sign)
    drivers.speed_mps = np.maximum(drivers.speed_mps + rng.normal(0, 0.5, count), 0.0)
    drivers.heading_rad = drivers.heading_rad + rng.normal(0, 0.05, count)
    drivers.along_m = (drivers.along_m + drivers.sign * drivers.speed_mps * period_us * 1e-6) % 180.0
    ahead = np.stack([np.cos(drivers.heading_rad), np.sin(drivers.heading_rad)], axis=1)
    drivers.xy_m = drivers.xy_m + 0.3 * drivers.speed_mps[:, None] * period_us * 1e-6 * ahead


def _bodies(drivers: _Drivers, rng: np.random.Generator, noise_m: float) -> tuple[FloatArray, FloatArray]:
    """Measure centres, (n, 2), and headings, not yet within (-pi, pi]."""
    count = len(drivers.sign)
    tangent_rad = drivers.along_m / _RADIUS_M
    out_m = _RADIUS_M - drivers.across_m
    point_m = np.stack([out_m * np.sin(tangent_rad), _RADIUS_M - out_m * np.cos(tangent_rad)], axis=1)
    centre_m = np.where(drivers.on_road[:, None], point_m, drivers.xy_m) + rng.normal(0, noise_m, (count, 2))
    road_rad = tangent_rad + np.where(drivers.sign > 0, 0, math.pi)
    return centre_m, np.where(drivers.on_road, road_rad, drivers.heading_rad) + rng.normal(0, 0.05, count)


def _place(
    drivers: _Drivers,
    rng: np.random.Generator,
    t_us: int,
    *,
    order: NDArray[np.intp],
    centre_m: FloatArray,
    body_rad: FloatArray,
    noise_m: float,
) -> Footprints:
    """Add noisy road coordinates; the junction lies between two roads."""
    along_m, count = drivers.along_m, len(drivers.sign)
    in_junction = drivers.on_road & (along_m > 60) & (along_m < 80)
    road = np.where(drivers.on_road & ~in_junction, np.where(along_m < 90, 0, 1), -1).astype(np.int32)
    on = road >= 0
    return Footprints.of(
        t_us=t_us,
        ids=tuple(f"car{k}" for k in order),
        centre_m=centre_m[order],
        heading_rad=np.angle(np.exp(1j * body_rad))[order],
        speed_mps=drivers.speed_mps[order],
        length_m=drivers.length_m[order],
        width_m=drivers.width_m[order],
        road=road[order],
        along_m=np.where(on, along_m + rng.normal(0, noise_m, count), np.nan)[order],
        across_m=np.where(on, drivers.across_m + rng.normal(0, noise_m, count), np.nan)[order],
        tangent_rad=np.where(on, np.angle(np.exp(1j * (along_m / _RADIUS_M))), np.nan)[order],
        junction=np.where(in_junction, 0, -1).astype(np.int32)[order],
        lane=np.where(on, 2 * road + (drivers.across_m > 0), -1).astype(np.int32)[order],
    )
