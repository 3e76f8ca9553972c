"""What the recorder writes of cars, remembers to place events, and what it calls them."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from anchoring.adapter import Anchored
from anchoring.observations import Cars, nowhere
from chronicles.execution.unfit_events import UnfitCounter
from chronicles.library import load_library
from dyknow.kpl.loader import DeclaredStream
from dyknow.sample import Sample
from gis.roads.road_network import RoadPositions
from service.cli.app import run
from service.records.seen import CarState
from service.runs.graph.recording import CarHistory, Recorder
from service.store.writer import RunWriter
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
        sigma_m=np.full(n, np.nan),
        has_moved=np.ones(n, np.bool_),
        confidence=np.ones(n),
    )


class Rows(list[CarState]):
    """Stand in for the writer of a run, and for the stream of cars."""

    def append_states(self, rows: Iterable[CarState]) -> None:
        self.extend(rows)

    def append(self, links: Iterable[object]) -> None:
        assert not list(links)

    def subscribe(self, consumer: Callable[[Sample[object]], None]) -> None:
        self.consumer = consumer


def off_road(t_us: int, *names: str) -> Cars:
    return replace(cars_at(t_us, *names), positions=nowhere(len(names)))


def test_a_hidden_car_has_one_row_a_time_and_the_seen_one_goes_first() -> None:
    written = Rows()
    unfit = UnfitCounter(load_library(["overtake"]))
    recorder = Recorder(cast(RunWriter, written), None, unfit, history_us=60 * SECOND)
    recorder.attach({"recorded_cars": cast(DeclaredStream, written)})
    absent = replace(off_road(0, "car1"), linked=np.zeros(1, np.bool_))
    values = [
        Anchored(off_road(0, "car1"), ()),
        Anchored(replace(absent, t_us=SECOND), ()),  # predicted
        *(Anchored(off_road(t * SECOND), ()) for t in (2, 3)),
        # Seen at 3 s as something unknown, and known to be the hidden car since 4 s.
        Anchored(
            off_road(4 * SECOND, "car1"),
            (),
            former=(off_road(3 * SECOND, "car1"),),
            filled=tuple(replace(absent, t_us=t * SECOND) for t in (1, 2, 3)),
        ),
    ]
    for value in values:
        written.consumer(Sample(value.cars.t_us, value.cars.t_us, value))
    rows = sorted((row.t_us // SECOND, row.linked) for row in written)
    assert rows == [(0, True), (1, False), (2, False), (3, True), (4, True)]


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
