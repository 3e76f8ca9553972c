"""Scenes for the tests of the relations."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from qsr.changes import RelationChange
from qsr.footprints import FloatArray, Footprints


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
    straight_road: bool = False,
) -> Footprints:
    """Build one frame; a straight road runs along the x axis, so that along is x and across is y."""
    count = len(ids)
    centre_m = np.asarray(xy_m, dtype=np.float64).reshape(count, 2)
    none = np.full(count, np.nan)
    return Footprints(
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
    )


def changes_of(changes: Sequence[RelationChange], name: str, *args: str) -> list[tuple[int, bool | None, bool | None]]:
    """Pick the changes of one relation instance: time, old, new."""
    return [(change.t_us, change.old, change.new) for change in changes if (change.name, change.args) == (name, args)]


def random_traffic(
    rng: np.random.Generator, *, frames: int, count: int, period_us: int = 100_000, noise_m: float = 0.2
) -> Iterator[Footprints]:
    """Drive cars on a bent two-way road with a junction, and a few across the open ground.

    Cars come and go at random, some come back under their old name, and the order within a frame is shuffled.
    """
    radius_m = 120.0
    on_road = rng.random(count) < 0.7
    sign = np.where(rng.random(count) < 0.6, 1.0, -1.0)
    along = rng.uniform(0, 150, count)
    across = np.where(sign > 0, -1.75, 1.75) * rng.choice([1.0, -1.0], count, p=[0.8, 0.2])
    speed = rng.uniform(0.0, 25.0, count)
    xy = rng.uniform(-60, 60, (count, 2)) + np.array([0.0, radius_m])
    heading = rng.uniform(-math.pi, math.pi, count)
    length, width = rng.uniform(2, 14, count), rng.uniform(0.8, 2.5, count)
    seen = rng.random(count) < 0.5
    for frame in range(frames):
        t_us = frame * period_us + int(rng.integers(0, 1000))
        speed = np.maximum(speed + rng.normal(0, 0.5, count), 0.0)
        heading = heading + rng.normal(0, 0.05, count)
        along = (along + sign * speed * period_us * 1e-6) % 180.0
        xy = xy + 0.3 * speed[:, None] * period_us * 1e-6 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        angle = along / radius_m
        tangent = angle
        point = np.stack([(radius_m - across) * np.sin(angle), radius_m - (radius_m - across) * np.cos(angle)], axis=1)
        centre = np.where(on_road[:, None], point, xy) + rng.normal(0, noise_m, (count, 2))
        body_heading = np.where(on_road, tangent + np.where(sign > 0, 0, math.pi), heading) + rng.normal(0, 0.05, count)
        seen ^= rng.random(count) < 0.02
        in_junction = on_road & (along > 60) & (along < 80)
        road = np.where(on_road & ~in_junction, np.where(along < 90, 0, 1), -1).astype(np.int32)
        order = rng.permutation(np.flatnonzero(seen))
        yield Footprints(
            t_us=t_us,
            ids=tuple(f"car{k}" for k in order),
            centre_m=centre[order],
            heading_rad=np.angle(np.exp(1j * body_heading))[order],
            speed_mps=speed[order],
            length_m=length[order],
            width_m=width[order],
            road=road[order],
            along_m=np.where(road >= 0, along + rng.normal(0, noise_m, count), np.nan)[order],
            across_m=np.where(road >= 0, across + rng.normal(0, noise_m, count), np.nan)[order],
            tangent_rad=np.where(road >= 0, np.angle(np.exp(1j * tangent)), np.nan)[order],
            junction=np.where(in_junction, 0, -1).astype(np.int32)[order],
        )
