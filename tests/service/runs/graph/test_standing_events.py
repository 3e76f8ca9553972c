"""Monitors that look at chronicles: what they see of events, live and stored, and what is refused."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from chronicles.chronicle_set import load, load_texts
from dyknow.errors import FormulaError
from dyknow.mtl.formula import ANY
from dyknow.streams.hypotheses import Hypotheses
from qsr.adapter import FrameRelations
from qsr.changes.crossings import RelationChange
from service.cli.app import run
from service.errors import InputError
from service.questions.events.queries import EventFilter
from service.questions.recognition.stored_monitoring import monitor_log
from service.records.events import EventRecord
from service.runs.graph.monitored_states import TrafficState
from service.runs.graph.pipeline import TRAJECTORIES, shipped_kpl
from service.runs.graph.stream_processes import StandingEvents
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from service.texts.chronicle_files import with_relations
from service.texts.monitored_features import CarValue
from tests.conftest import Demo
from tests.service.logs import SECOND_US, read_all
from tests.service.runs.graph.test_hidden_passes import PASSES, rows
from tests.service.runs.graph.test_stream_processes import LIMIT, run_race, stored, told, write_jump, written
from tests.service.tracks import HEADER

JUNCTION = Path(__file__).parents[3] / "golden" / "junction_tracks"
PASSED = """chronicle passed[?a, ?b](t1, t2) {
  event(beside[?a, ?b]:(false, true), t1)
  event(beside[?a, ?b]:(true, false), t2)
  t2 - t1 in [0s, 60s]
}
"""
CALMS = "monitor calms per ?a in Car: always (passed[?a, ?] implies eventually[0s, 2s] speed[?a] < 15 m/s)\n"
# Who crosses, and who has driven straight on and is not slow within 3 s; the others ask for what comes late.
ASKING = """monitor crosses_none per ?a in Car: always not crossing[?a, ?]
monitor calms per ?a in Car: always (drive_straight[?a, ?, ?, ?] implies eventually[0s, 3s] speed[?a] < 8 m/s)
monitor careful per ?a in Car, ?b in Car: always not reckless_overtake[?a, ?b, ?] and not (?a != ?b and pass[?a, ?b])
"""


def run_junction(folder: Path, monitors: str, tracks: Path, *, final: bool = False) -> str:
    """Process tracks of the pinned junction, where cars are hidden and events are told early; return the log's URL."""
    path = written(folder, "a.monitors", monitors)
    log = str(folder / "log.db")
    process(RunRequest(tracks, JUNCTION / "site.toml", log, monitor_files=(path,), final=final))
    return f"sqlite:///{log}"


def first_rows(seconds: int) -> tuple[str, list[str]]:
    """Give the header and the first rows of the junction's tracks, of sixty seconds."""
    header, *lines = (JUNCTION / "tracks.csv").read_text(encoding="utf-8").splitlines()
    at = header.split(",").index("t_us")
    return header, [line for line in lines if int(line.split(",")[at]) < seconds * SECOND_US]


def write_lost(path: Path, seed: int, seconds: int) -> Path:
    """Write the tracks of the junction with most of them lost for up to 8 s, and then begun under another name."""
    rng = np.random.default_rng(seed)
    header, lines = first_rows(seconds)
    rows = [line.split(",") for line in lines]
    at, name = header.split(",").index("t_us"), header.split(",").index("id")
    for one in sorted({row[name] for row in rows}):
        own = [row for row in rows if row[name] == one]
        from_us = int(own[rng.integers(len(own))][at])
        to_us = from_us + int(rng.integers(200_000, 8_000_000))
        for row in own if rng.random() < 0.6 else ():
            if int(row[at]) >= from_us:
                row[name] = f"{one}_2" if int(row[at]) >= to_us else ""
    return written(path.parent, path.name, "\n".join([header, *(",".join(row) for row in rows if row[name]), ""]))


def verdicts(url: str, monitors: str = "") -> list[EventRecord]:
    return [one for one in read_all(url) if one.type.endswith("_violated") and one.type.startswith(monitors)]


def when(events: Sequence[EventRecord]) -> list[tuple[str, int]]:
    return sorted((one.roles["a"], one.start_us) for one in events)


def judged(events: Sequence[EventRecord]) -> list[object]:
    return sorted((stored(one) for one in events), key=repr)


# ---- what is seen


@pytest.mark.long
def test_an_event_is_true_in_the_first_state_at_or_after_its_end(tmp_path: Path) -> None:
    """Evaluate two monitors slowly, from the events, frames and cars of the log alone."""
    header, lines = first_rows(seconds=16)
    url = run_junction(tmp_path, ASKING, written(tmp_path, "tracks.csv", "\n".join([header, *lines, ""])))
    with open_log(url) as log:
        frames_us = [t_us for _, t_us in log.frames(log.run().id)]
        speed_mps = {(one.car, one.t_us): one.speed_mps for one in log.states(log.run().id) if one.linked}

    def frame_at(t_us: int) -> int:
        return next(one for one in frames_us if one >= t_us)

    crossed = read_all(url, EventFilter(types=("crossing",)))
    assert {one.status for one in crossed} == {"recognised", "confirmed"}
    assert when(verdicts(url, "crosses_none")) == sorted((one.roles["car"], frame_at(one.end_us)) for one in crossed)
    expected = []
    for one in read_all(url, EventFilter(types=("drive_straight",))):
        car, from_us = one.roles["car"], frame_at(one.end_us)
        within = [speed_mps.get((car, t_us)) for t_us in frames_us if from_us <= t_us <= from_us + 3 * SECOND_US]
        stays = all(speed is not None for speed in within)
        if stays and min(within) >= 8.0:
            expected.append((car, frame_at(from_us + 3 * SECOND_US)))
    assert when(verdicts(url, "calms")) == sorted(expected)
    assert expected


@pytest.mark.parametrize(("most_kmh", "window_s"), [(80, 10), (60, 3), (50, 1)])
def test_after_an_overtake_who_stays_fast_is_told_as_a_slow_look_at_the_log_tells_it(
    tmp_path: Path, demo: Demo, most_kmh: int, window_s: int
) -> None:
    text = f"monitor calms per ?a in Car: always (overtake[?a, ?, ?] implies eventually[0s, {window_s}s] speed[?a] <"
    found = monitor_log(str(demo.log), [written(tmp_path, "a.monitors", f"{text} {most_kmh} km/h)\n")])
    expected = []
    with open_log(str(demo.log)) as log:
        rows_of_car = [one for one in log.states(log.run().id) if one.linked]
        frames_us = [t_us for _, t_us in log.frames(log.run().id)]
    for event in read_all(f"sqlite:///{demo.log}", EventFilter(types=("overtake",))):
        speeds = {one.t_us: one.speed_mps for one in rows_of_car if one.car == event.roles["overtaker"]}
        begin_us = min(t_us for t_us in frames_us if t_us >= event.end_us)
        end_us = min((t_us for t_us in frames_us if t_us >= begin_us + window_s * SECOND_US), default=None)
        within = [speed for t_us, speed in speeds.items() if begin_us <= t_us <= begin_us + window_s * SECOND_US]
        if end_us in speeds and min(within) >= most_kmh / 3.6:  # else nobody saw the end, or the car was slow enough
            expected.append((event.roles["overtaker"], end_us))
    assert [(one.objects[0], one.t_us) for one in found.events] == sorted(expected, key=lambda one: one[1])
    assert bool(expected) is (most_kmh < 80)


@pytest.mark.long
def test_the_log_tells_the_same_as_the_run_whether_events_are_told_early_or_late(tmp_path: Path) -> None:
    monitors = ASKING + LIMIT.replace("15 m/s", "10 m/s")
    urls: list[str] = []
    for name in ("early", "final"):
        (tmp_path / name).mkdir()
        tracks = write_lost(tmp_path / name / "tracks.csv", seed=0, seconds=30)
        urls.append(run_junction(tmp_path / name, monitors, tracks, final=name == "final"))
    every = EventFilter(statuses=("recognised", "confirmed", "tentative", "retracted"))
    assert {one.status for one in read_all(urls[0], every)} == set(every.statuses)
    found = monitor_log(urls[0], [tmp_path / "early" / "a.monitors"])
    live = judged(verdicts(urls[0]))
    assert judged(verdicts(urls[1])) == live
    assert sorted(told(found.events), key=repr) == live
    assert {one.monitor for one in found.report if one.violated} == {"crosses_none", "calms", "limit"}


@pytest.mark.long
def test_an_event_that_is_told_long_after_it_was_is_true_when_it_was(tmp_path: Path) -> None:
    """One car passes another from 5 s to 9 s, while nobody sees the first."""
    request = RunRequest(
        written(tmp_path, "hidden.csv", "\n".join([HEADER, *rows(), ""])),
        None,
        str(tmp_path / "log.db"),
        chronicle_files=(written(tmp_path, "a.chronicle", PASSES),),
        monitor_files=(written(tmp_path, "a.monitors", "monitor unpassed per ?a in Car: always not passes[?, ?a]\n"),),
    )
    process(request)
    url = f"sqlite:///{request.log_url}"
    found = read_all(url, EventFilter(types=("passes",)))
    [hidden] = [one for one in found if one.end_us < 9 * SECOND_US < one.recognised_us]
    [passed] = [one for one in verdicts(url) if one.roles["a"] == hidden.roles["b"]]
    assert 0 <= passed.start_us - hidden.end_us < 200_000
    assert passed.recognised_us > 9 * SECOND_US  # when a is seen again
    assert sorted(told(monitor_log(url, list(request.monitor_files)).events), key=repr) == judged(verdicts(url))


@pytest.mark.parametrize(("verdict", "is_true"), [("validated", True), ("refuted", False), ("undecided", True)])
def test_a_state_waits_until_its_events_stand(verdict: str, is_true: bool) -> None:
    chronicles = load("chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")
    standing = StandingEvents(chronicles, {"met"}, lag_us=20)
    change = RelationChange("close", ("a", "b"), t_us=95, decided_us=100, old=False, new=True)
    seen: list[tuple[int, CarValue]] = []
    for t_us in (90, 100, 120, 140, 160):
        known = Hypotheses({"a": ("v1->a#1",)})
        if t_us == 140:
            known = Hypotheses(**{verdict: ("v1->a#1",)})
        standing.hold(t_us, TrafficState(("a", "b"), {}))
        standing.take(t_us, FrameRelations((change,) if t_us == 100 else (), known))
        seen += [(one_us, state.value("met", ("a", ANY))) for one_us, state in standing.complete()]
        assert (100 in dict(seen)) is (t_us >= 140)
    assert seen == [(90, False), (100, is_true), (120, False)]
    standing.finish()
    assert [one_us for one_us, _ in standing.complete()] == [140, 160]


def test_what_may_still_come_of_the_very_time_of_a_state_holds_it_back() -> None:
    chronicles = load("chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")
    standing = StandingEvents(chronicles, {"met"}, lag_us=20)
    change = RelationChange("close", ("a", "b"), t_us=100, decided_us=200, old=False, new=True)
    for t_us in range(90, 230, 10):
        standing.hold(t_us, TrafficState(("a", "b"), {}))
        opened = (("a lost#1", 100),) if t_us == 110 else ()
        returned = ("a lost#1",) if t_us == 200 else ()
        frame = FrameRelations((change,) if t_us == 200 else (), Hypotheses(opened=opened, refuted=returned))
        standing.take(t_us, frame)
        seen = [(one_us, state.value("met", ("a", "b"))) for one_us, state in standing.complete()]
        if t_us == 200:
            assert seen == [(one_us, one_us == 100) for one_us in range(100, 180, 10)]
        else:
            assert seen == ([(90, False)] if t_us == 120 else [] if t_us < 200 else [(t_us - 30, False)])


def test_a_state_waits_as_long_as_its_chronicles_look_on() -> None:
    text = """message alone[?a]
    chronicle stays[?a](t1) { event(moving[?a]:(true, false), t1) noevent(moving[?a]:(false, true), (t1, t1 + 50us))
      when recognised { emit alone[?a] } }
    chronicle rests[?a](t1) { event(alone[?a], t1) }"""
    standing = StandingEvents(load_texts(with_relations([("own", text)])), {"rests"}, lag_us=20)
    change = RelationChange("moving", ("a",), t_us=95, decided_us=100, old=True, new=False)
    for t_us in range(100, 200, 10):
        standing.hold(t_us, TrafficState(("a",), {}))
        standing.take(t_us, FrameRelations((change,) if t_us == 100 else ()))
        complete = [(one_us, state.value("rests", ("a",))) for one_us, state in standing.complete()]
        assert complete == ([] if t_us < 180 else [(t_us - 80, t_us == 180)])


@pytest.mark.long
def test_windows_count_from_the_end_of_the_event(tmp_path: Path) -> None:
    url = run_race(tmp_path, CALMS + LIMIT, PASSED)
    [passed, _] = read_all(url, EventFilter(types=("passed",)))
    [calms] = verdicts(url, "calms")
    assert 8 * SECOND_US < passed.end_us < 8_100_000  # so the state is that at 8.1 s
    assert (calms.start_us, calms.roles) == (10_100_000, {"a": "car1"})
    assert sorted(told(monitor_log(url, [tmp_path / "a.monitors"]).events), key=repr) == judged(verdicts(url))


def test_a_feature_goes_before_an_event_of_its_name(tmp_path: Path) -> None:
    url = run_race(tmp_path, LIMIT.replace("speed[?car] < 15 m/s", "seen[?car]"), PASSED.replace("passed", "seen"))
    assert verdicts(url) == []
    assert len(read_all(url, EventFilter(types=("seen",)))) == 2


# ---- which chronicles there are


@pytest.mark.long
def test_a_chronicle_of_the_library_comes_with_the_monitors_that_look_at_it(tmp_path: Path) -> None:
    for name in ("with", "without"):
        (tmp_path / name).mkdir()
    monitors = CALMS.replace("passed[", "pass[")
    url = run_race(tmp_path / "with", monitors, PASSED)
    with open_log(url) as log:
        assert [one.name for one in log.run().chronicles] == ["pass", "passed"]
    assert [one.roles["a"] for one in verdicts(url)] == ["car1"]
    # A log whose run did not have it is asked for it all the same.
    without = run_race(tmp_path / "without", "", PASSED)
    assert read_all(without, EventFilter(types=("pass",))) == []
    found = told(monitor_log(without, [tmp_path / "with" / "a.monitors"]).events)
    assert found == [stored(one) for one in verdicts(url)]


def test_chronicles_look_at_some_monitors_while_others_look_at_chronicles(tmp_path: Path) -> None:
    late = "message limit_violated[?car]\nchronicle late[?car](t1) { event(limit_violated[?car], t1) }\n"
    url = run_race(tmp_path, CALMS + LIMIT, PASSED + late)
    assert {one.type for one in read_all(url)} == {"limit_violated", "late", "passed", "calms_violated"}


# ---- what is refused

LATE = "message {0}[?a]\nchronicle late[?a](t1) {{ event({0}[?a], t1) }}\n"


@pytest.mark.parametrize(
    ("monitors", "chronicles", "message"),
    [
        (
            CALMS,
            PASSED + LATE.format("calms_violated"),
            "chronicle 'late': expected messages of monitors that look at no chronicle, got 'calms_violated'",
        ),
        (
            CALMS.replace("passed[?a, ?]", "late[?a]"),
            LATE.format("calms_violated"),
            "chronicle 'late': expected no message of a monitor, as it feeds monitors itself, got 'calms_violated'",
        ),
        (
            CALMS.replace("passed[?a, ?]", "late[?a]") + LIMIT,
            LATE.format("limit_violated"),
            "chronicle 'late': expected no message of a monitor, as it feeds monitors itself, got 'limit_violated'",
        ),
        (CALMS.replace("calms", "passed"), PASSED, "monitor 'passed': expected a name that no chronicle has"),
    ],
    ids=["chain_behind", "circle", "chain_before", "name"],
)
def test_what_would_run_in_a_circle_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monitors: str, chronicles: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run_race(tmp_path, monitors, chronicles)
    assert not (tmp_path / "log.db").exists()
    paths = str(tmp_path / "a.chronicle"), "--monitors", str(tmp_path / "a.monitors")
    assert run(["check", *paths]) == 3
    assert message in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("passed[?a]", r"expected 2 arguments of 'passed', got 1(.|\n)*write passed\[\?a, \?b\], with \? for what"),
        ("overtake[?a, ?]", r"expected 3 (.|\n)*write overtake\[\?overtaker, \?overtaken, \?road\], with \?"),
        ("pased[?a, ?]", r"expected a known feature, got 'pased'(.|\n)*did you mean 'passed'\?"),
        ("overtak[?a, ?, ?]", r"expected a known feature, got 'overtak'(.|\n)*did you mean 'overtake'\?"),
        ("beside[?a, ?]", r"expected an object or a variable in 'beside', got '\?'"),
        ("passed[?a, ?] < 3", "expected a truth value, as .* is, got a number"),
    ],
    ids=["arity", "of_the_library", "unknown", "unknown_in_the_library", "whichever", "kind"],
)
def test_events_are_asked_as_they_are_given(tmp_path: Path, text: str, message: str) -> None:
    monitors = f"monitor calms per ?a in Car: always not ({text})\n"
    with pytest.raises(FormulaError, match=message):
        run_race(tmp_path, monitors, PASSED)
    url = run_race(tmp_path, "", PASSED)
    with pytest.raises(FormulaError, match=message):
        monitor_log(url, [written(tmp_path, "b.monitors", monitors)])
    assert run(["check", str(tmp_path / "a.chronicle"), "--monitors", str(tmp_path / "b.monitors")]) == 3


def test_streams_of_ones_own_are_refused(tmp_path: Path) -> None:
    streams = written(tmp_path, "own.kpl", shipped_kpl(TRAJECTORIES).text + "stream also = cars;\n")
    request = RunRequest(
        write_jump(tmp_path / "jump.csv", 60),
        None,
        str(tmp_path / "log.db"),
        monitor_files=(written(tmp_path, "a.monitors", CALMS.replace("passed[", "pass[")),),
        kpl_file=streams,
    )
    with pytest.raises(InputError, match="expected the shipped streams for monitors that look at pass, got others"):
        process(request)
