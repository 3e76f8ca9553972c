"""What a run keeps does not grow with the cars that have left."""

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from types import FunctionType, MethodType

import numpy as np
import pytest

from chronicles.execution.unfit_events import UnfitCounter
from dyknow.sample import Sample
from dyknow.streams.stream import exhaust
from service.runs.graph.pipeline import TRAJECTORIES, Feed, Pipeline, declared_pipeline
from service.runs.graph.recording import Recorder, recorded_streams
from service.runs.inputs.trajectories import TrajectoryObjects
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files
from service.texts.monitor_files import load_monitor_files
from tests.service.logs import SECOND_US, run

pytestmark = pytest.mark.long

STEP_US = 200_000
LIVES, CARS_AT_A_TIME = 10, 10  # frames, and new cars in each life
BUSY, QUIET = 120, 200  # frames with new cars, and frames in which what is known of them may be forgotten
CHRONICLE = """message stays[?a] { ?a in Car }
chronicle stays[?a](t1) { event(moving[?a]:(unknown, true), t1) hold(moving[?a]:true, (t1 + 10ms, t1 + 1s))
    noevent(close[?a, ?b]:(false, true), (t1, t1 + 1s)) when recognised { emit stays[?a] } }"""
MONITORS = "monitor limit per ?car in Car: always speed[?car] < 20 m/s\n"


def frame(number: int) -> TrajectoryObjects:
    """Cars far from those before; each drives for two seconds, and never comes again. One stands there all the time."""
    life, age = divmod(number, LIVES)
    n = CARS_AT_A_TIME if number % (BUSY + QUIET) < BUSY else 0
    place = np.arange(n)
    moving = np.column_stack((60.0 * (place // 2) + 3.0 * age, 500.0 * life + 4.0 * (place % 2)))
    return TrajectoryObjects(
        t_us=number * STEP_US,
        ids=(*(f"{life}:{k}" for k in place.tolist()), "stands"),
        centre_m=np.vstack((moving, (0.0, -500.0))),
        velocity_mps=np.array([(15.0, 0.0)] * n + [(0.0, 0.0)]),
        heading_rad=np.zeros(n + 1),
        length_m=np.full(n + 1, 4.5),
        width_m=np.full(n + 1, 1.8),
        observed=np.ones(n + 1, dtype=np.bool_),
        clipped=np.zeros(n + 1, dtype=np.bool_),
    )


def sizes(roots: Mapping[str, object]) -> dict[str, int]:
    """Add up the elements of all containers that can be reached, by the way there."""
    found, seen = dict[str, int](), set[int]()
    waiting = [(one, name) for name, one in roots.items()]
    while waiting:
        one, way = waiting.pop()
        if (
            id(one) in seen
            or isinstance(one, (str, type))
            or type(one).__module__.startswith(("sqlalchemy", "sqlite3"))
        ):
            continue
        seen.add(id(one))
        if isinstance(one, (dict, list, tuple, set, frozenset, deque)):
            found[way] = found.get(way, 0) + len(one)
            parts = [*one.keys(), *one.values()] if isinstance(one, dict) else list(one)
            waiting += [(part, way + "[]") for part in parts]
        elif isinstance(one, MethodType):
            waiting.append((one.__self__, way))
        elif isinstance(one, FunctionType):
            waiting += [(cell.cell_contents, way) for cell in one.__closure__ or ()]
        elif isinstance(one, np.ndarray):
            found[way] = found.get(way, 0) + one.size
        else:
            slots = [slot for kind in type(one).__mro__ for slot in getattr(kind, "__slots__", ())]
            names = [*getattr(one, "__dict__", ()), *(slot for slot in slots if hasattr(one, slot))]
            waiting += [(getattr(one, name), f"{way}.{name}") for name in names if name != "__dict__"]
    return found


def fed(pipeline: Pipeline, numbers: range) -> None:
    for number in numbers:
        objects = frame(number)
        exhaust(pipeline.publish_in_steps(Sample(objects.t_us, objects.t_us, objects)))


def test_hundreds_of_cars_that_left_leave_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # What is bounded by a large number is bounded by a small one here.
    monkeypatch.setattr("anchoring.anchorer.MOST_AWAY", 64)
    monkeypatch.setattr("chronicles.execution.live.eager._RECENT", 64)
    monkeypatch.setattr("chronicles.execution.live.revision.DECIDED_KEPT", 64)
    monkeypatch.setattr("chronicles.execution.stage._FIRST_SWEEP", 16)
    (tmp_path / "a.chronicle").write_text(CHRONICLE)
    (tmp_path / "a.monitors").write_text(MONITORS)
    monitors = load_monitor_files((tmp_path / "a.monitors",))
    chronicles = load_chronicle_files((tmp_path / "a.chronicle",), messages=monitors.messages)
    pipeline = declared_pipeline(Feed(TRAJECTORIES), None, chronicles.merged, monitors, clock=lambda: 0)
    with open_log(str(tmp_path / "a.db"), "w") as log:
        recorder = Recorder(log.begin_run(run()), None, UnfitCounter(chronicles.merged), history_us=5 * SECOND_US)
        recorder.attach(recorded_streams(pipeline))
        kept = []
        for number in range(3):
            fed(pipeline, range(number * (BUSY + QUIET), (number + 1) * (BUSY + QUIET)))
            kept.append(sizes({"pipeline": pipeline, "recorder": recorder}))
        assert recorder.cars > 2 * BUSY
        assert recorder.events > BUSY
    _, before, after = kept  # by the first quiet time, what is bounded need not be full
    grown = {way: (before.get(way, 0), size) for way, size in after.items() if size > before.get(way, 0)}
    # One thing kept of each of the cars in between would be as many more.
    assert sum(after.values()) - sum(before.values()) < BUSY * CARS_AT_A_TIME // LIVES, grown
