"""What the recorder remembers to place events, and what it calls them."""

from pathlib import Path

import numpy as np
import pytest

from anchoring.observations import Cars
from gis.road_network import RoadPositions
from service.cli.app import run
from service.runs.recording import CarHistory
from tests.service.logs import read_all
from tests.service.tracks import write_tracks

SECOND = 1_000_000


def cars_at(t_us: int, *names: str) -> Cars:
    n = len(names)
    positions = RoadPositions(
        road=np.zeros(n, np.int32),
        along_m=np.zeros(n),
        across_m=np.zeros(n),
        lane=np.zeros(n, np.int32),
        junction=np.full(n, -1, np.int32),
        tangent_rad=np.zeros(n),
    )
    return Cars(
        t_us=t_us,
        ids=names,
        centre_m=np.column_stack((np.arange(n) + t_us / SECOND, np.full(n, 2.0))),
        velocity_mps=np.zeros((n, 2)),
        speed_mps=np.zeros(n),
        heading_rad=np.zeros(n),
        length_m=np.full(n, 4.5),
        width_m=np.full(n, 1.8),
        classes=("car",) * n,
        linked=np.ones(n, np.bool_),
        vision_ids=("v1",) * n,
        positions=positions,
    )


def test_history_gives_the_last_place_up_to_a_time() -> None:
    history = CarHistory(10 * SECOND)
    for t in range(5):
        history.remember(cars_at(t * SECOND, "car1", "car2"))
    assert history.find("car2", 2 * SECOND + 400_000) == (0, 3.0, 2.0)


def test_history_knows_no_car_that_was_not_there() -> None:
    history = CarHistory(10 * SECOND)
    history.remember(cars_at(SECOND, "car1"))
    assert history.find("car2", SECOND) is None
    assert history.find("car1", 0) is None


def test_history_forgets_what_is_too_old() -> None:
    history = CarHistory(2 * SECOND)
    for t in range(5):
        history.remember(cars_at(t * SECOND, "car1"))
    assert history.find("car1", SECOND) is None
    assert history.find("car1", 2 * SECOND) is not None


@pytest.mark.parametrize(
    ("actions", "types"),
    [
        ("assert(lively[?car]:true, t1)", ["rolling"]),
        ("emit departed[?car]  assert(lively[?car]:true, t1)", ["departed"]),
        ("emit departed[?car]  emit awoken[?car]", ["departed", "awoken"]),
    ],
)
def test_only_messages_name_the_type_of_an_event(tmp_path: Path, actions: str, types: list[str]) -> None:
    tracks, chronicle = write_tracks(tmp_path / "tracks.csv", frames=50), tmp_path / "a.chronicle"
    chronicle.write_text(
        "attribute lively[?car]  message departed[?car]  message awoken[?car]\n"
        f"chronicle rolling[?car](t1) {{ event(moving[?car]:(?, true), t1)  when recognised {{ {actions} }} }}\n"
    )
    log = str(tmp_path / "a.db")
    assert run(["process", str(tracks), "--log", log, "--chronicles", str(chronicle)]) == 0
    assert [one.type for one in read_all(f"sqlite:///{log}")] == types
