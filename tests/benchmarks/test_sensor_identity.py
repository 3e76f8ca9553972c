"""The figures of two sensors: hand-made rows that can be counted on fingers, and a short scene."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.evaluate_identity import KINDS, make_scenes
from benchmarks.kept_identity import NamedRows, follow
from benchmarks.sensor_identity import SENSORS, pooled_idf1, score_sensors, taken_together, two_sensors
from service.runs.inputs.sites.site import load_site

TRUE = [(0, t_us, "a") for t_us in range(4)]


def named(*rows: tuple[int, str, str]) -> NamedRows:
    """Make rows of vehicle a: time, track, symbol."""
    t_us, ids, symbols = zip(*rows, strict=True)
    return NamedRows(np.array(t_us), ("a",) * len(rows), ids, symbols)


@pytest.mark.parametrize(
    ("symbols", "second", "share"),
    [
        (("car1",) * 4, ("",) * 4, 1.0),  # the other sensor's track is joined and has no row of its own
        (("car1",) * 4, ("car2",) * 4, 8 / 12),  # two cars for one vehicle
        (("car1", "car1", "", ""), ("", "", "car1", "car1"), 1.0),  # the other one leads
        (("car1", "car1", "", ""), ("", "", "car2", "car2"), 0.5),
        (("car1", "car1", "", ""), ("",) * 4, 4 / 6),
    ],
)
def test_a_vehicle_counts_once_however_many_see_it(
    symbols: tuple[str, ...], second: tuple[str, ...], share: float
) -> None:
    rows = [(k, track, one[k]) for k in range(4) for track, one in (("colour/1", symbols), ("thermal/1", second))]
    assert pooled_idf1(TRUE, [named(*rows)]) == pytest.approx(share)


@pytest.mark.long
def test_two_sensors_are_better_than_one_and_wrong_joins_are_counted(tmp_path: Path) -> None:
    place = KINDS["rural"].place
    scenes = make_scenes("rural", [1], tmp_path, seconds=25)
    row = score_sensors("rural", scenes, place)
    assert row.seen_idf1 > row.alone_seen_idf1 + 0.02
    assert row.view_idf1 > row.alone_view_idf1 + 0.02
    assert row.joins > 5
    assert row.wrong_joins == 0
    tracks, sensors = taken_together(two_sensors(scenes[0], place))
    assert set(sensors) == set(SENSORS)
    # Were each row of another vehicle, every join would be wrong.
    vehicles = tuple(f"{vehicle}{sensor}" for vehicle, sensor in zip(tracks.rows.vehicles, sensors, strict=True))
    mistaken = replace(tracks, rows=replace(tracks.rows, vehicles=vehicles))
    site = load_site(scenes[0].folder / "site.toml")
    followed = follow(mistaken, site.network, site.anchoring, sensors=sensors)
    assert followed.wrong_joins == followed.joins > 5
