"""What it changes that somebody says how fast each sighting moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.vision.support import FloatArray
from tests.vision.tracking.test_tracker import Row, detect, everywhere, names
from vision.detection.detector import Velocities
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

LOOK_US = 250_000
SPREAD_MPS = 1.0


def look(
    tracker: Tracker, t_us: int, rows: Sequence[Row], speeds_mps: Sequence[tuple[float, float]] | None
) -> VisionObjects:
    """Show cars to a tracker as boxes of a network, that belong to nobody, twice as much evidence as by motion."""
    tracker.predict(t_us)
    seen = replace(detect(rows), weight=np.full(len(rows), 2.0))
    if speeds_mps is not None:
        noise = np.broadcast_to(SPREAD_MPS**2 * np.eye(2), (len(rows), 2, 2))
        seen = replace(seen, velocities=Velocities(np.array(speeds_mps).reshape(-1, 2), noise))
    return tracker.update(seen)


def column_of_cars(t_us: int) -> list[Row]:
    """Cars that follow each other at 8 m, and drive 8 m between two looks, so that each is where the next one was."""
    return [(8.0 * place + 32e-6 * t_us, 0.0, 0.0, 4.5, 1.8) for place in range(-40, 1)]


def speeds_after(looks: int, *, are_seen: bool) -> FloatArray:
    tracker = Tracker(VisionSettings(), everywhere)
    for k in range(looks):
        rows = column_of_cars(k * LOOK_US)
        told = look(tracker, k * LOOK_US, rows, [(32.0, 0.0)] * len(rows) if are_seen else None)
    return told.velocity_mps


def test_cars_that_follow_each_other_drive_and_do_not_seem_to_stand() -> None:
    assert speeds_after(5, are_seen=True)[:, 0] == pytest.approx(np.full(41, 32.0), abs=1.0)
    assert len(speeds_after(5, are_seen=False)) == 0  # nothing seems to have moved


def test_who_comes_into_view_is_looked_for_where_it_drives_to() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    told = [look(tracker, k * LOOK_US, [(15.0 * k, 0.0, 0.0, 4.5, 1.8)], [(60.0, 0.0)]) for k in range(6)]
    assert names(told) == {"v1"}
    assert told[-1].velocity_mps[0] == pytest.approx([60.0, 0.0], abs=0.5)


def test_the_speed_of_what_is_in_front_is_not_that_of_what_is_behind_it() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    for k in range(12):
        told = look(tracker, k * LOOK_US, [(k, 0.0, 0.0, 4.5, 1.8)], [(4.0 if k != 9 else -15.0, 0.0)])
        if k >= 4:
            assert told.ids == ("v1",)
            assert told.velocity_mps[0] == pytest.approx([4.0, 0.0], abs=0.5)


def test_of_cars_that_meet_the_one_is_seen_that_moves_as_what_is_seen() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    for k in range(8):
        rows: list[Row] = [(-40.0 + 5 * k, 0.0, 0.0, 4.5, 1.8), (40.0 - 5 * k, 2.0, np.pi, 4.5, 1.8)]
        look(tracker, k * LOOK_US, rows, [(20.0, 0.0), (-20.0, 0.0)])
    # Both would be at the same place along the road now, and what is seen is nearer to the other one's lane.
    told = look(tracker, 8 * LOOK_US, [(0.0, 0.9, np.pi, 4.5, 1.8)], [(-20.0, 0.0)])
    assert told.ids == ("v1", "v2")
    assert (told.velocity_mps[told.observed, 0] < 0).all()
    assert told.observed.sum() == 1


def test_nobody_is_lost_who_is_seen_to_move_by_no_known_speed() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    told = [look(tracker, k * LOOK_US, [(3.0 * k, 0.0, 0.0, 4.5, 1.8)], [(np.nan, np.nan)]) for k in range(8)]
    assert told[-1].ids == ("v1",)
    assert told[-1].velocity_mps[0] == pytest.approx([12.0, 0.0], abs=0.2)
