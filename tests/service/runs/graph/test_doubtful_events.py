"""Events say how sure they are, and what is less sure than asked for is kept as doubtful."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Occurrence
from chronicles.execution.unfit_events import UnfitCounter
from dyknow.sample import Sample
from service.api.app import create_app
from service.cli import app
from service.questions.events.queries import EventFilter
from service.runs.graph.recording import Recorder
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, read_all, read_rows, run, write_log
from tests.service.runs.graph.test_hypotheses import occurrence


def record(path: Path, *occurrences: Occurrence, min_confidence: float | None = None) -> Recorder:
    with open_log(str(path), "w") as log:
        writer, unfit = log.begin_run(run()), UnfitCounter(load("message m[]"))
        recorder = Recorder(writer, None, unfit, history_us=SECOND_US, min_confidence=min_confidence)
        for one in occurrences:
            recorder._record_occurrence(Sample(3 * SECOND_US, one.end_us, one))
        writer.finish("finished")
    return recorder


@pytest.mark.parametrize(
    ("min_confidence", "status"), [(None, "doubtful"), (0.0, "recognised"), (0.6, "recognised"), (0.7, "doubtful")]
)
def test_what_is_below_the_floor_is_kept_and_not_counted(
    tmp_path: Path, min_confidence: float | None, status: str
) -> None:
    one = replace(occurrence("recognised"), confidence=0.61234, floor=0.8)
    recorder = record(tmp_path / "a.db", one, min_confidence=min_confidence)
    rows = read_rows(str(tmp_path / "a.db"))
    assert {(row.status, row.confidence) for row in rows} == {(status, 0.612)}
    assert recorder.events == len(read_all(str(tmp_path / "a.db"))) == (0 if status == "doubtful" else 2)


def test_doubtful_event_is_confirmed_as_doubtful_and_retracted_as_any_other(tmp_path: Path) -> None:
    told = [
        replace(occurrence(status), confidence=0.5, floor=0.8) for status in ("tentative", "confirmed", "retracted")
    ]
    recorder = record(tmp_path / "a.db", *told)
    assert [row.status for row in read_rows(str(tmp_path / "a.db"))][::2] == ["doubtful", "doubtful", "retracted"]
    assert recorder.events == 0


@pytest.fixture
def log(tmp_path: Path) -> str:
    return write_log(
        tmp_path / "a.db",
        [
            overtake(SECOND_US, confidence=0.95),
            overtake(2 * SECOND_US, confidence=0.5, status="doubtful"),
            overtake(3 * SECOND_US, confidence=0.3),
        ],
    )


@pytest.mark.parametrize(
    ("least", "starts_s"), [(None, [1, 3]), (0.0, [1, 2, 3]), (0.5, [1, 2]), (0.9, [1]), (1.0, [])]
)
def test_log_python_http_and_command_line_find_what_is_sure_enough(
    log: str, least: float | None, starts_s: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert [one.start_us // SECOND_US for one in read_all(log, EventFilter(min_confidence=least))] == starts_s
    with Client(create_app(log, shipped=())) as client:
        query = "" if least is None else f"?min_confidence={least}"
        items = client.get(f"/api/v1/events{query}").json()["items"]
    assert [one["start_us"] // SECOND_US for one in items] == starts_s
    options = [] if least is None else ["--min-confidence", str(least)]
    assert app.run(["events", log, "--format", "jsonl", *options]) == 0
    assert [json.loads(line)["confidence"] for line in capsys.readouterr().out.splitlines()] == [
        one["confidence"] for one in items
    ]


def test_table_shows_how_sure_events_are(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    app.run(["events", log, "--status", "doubtful"])
    head, row, *_ = [line.split() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert "sure" in head
    assert {"doubtful", "0.50"} <= set(row)


@pytest.mark.parametrize("text", ["1.5", "-0.1", "x", "nan", "1e1"])
def test_share_that_is_none_is_refused(log: str, text: str) -> None:
    with Client(create_app(log, shipped=())) as client:
        answer = client.get(f"/api/v1/events?min_confidence={text}")
    assert answer.status_code == 422
    assert f"min_confidence: expected 0 to 1, got {text!r}" in answer.text


def near_miss(path: Path, sigma_m: float) -> None:
    """Let a car brake at the last moment behind one that creeps, on no road."""
    lines = ["t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m,sigma_m"]
    x_m, speed_mps = 0.0, 13.0
    for t_us in range(0, 9_000_000, 100_000):
        lines.append(f"{t_us},a,{x_m:.3f},0,0,{speed_mps:.3f},4.5,1.8,{sigma_m}")
        lines.append(f"{t_us},b,{70 + 2e-6 * t_us:.3f},0,0,2,4.5,1.8,{sigma_m}")
        speed_mps = max(2.0, speed_mps - (0.8 if x_m > 63 else 0.0))
        x_m += 0.1 * speed_mps
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.long
@pytest.mark.parametrize(("sigma_m", "options", "is_told"), [(0.02, [], True), (1.5, [], False), (1.5, ["0"], True)])
def test_near_miss_of_badly_known_places_is_not_told_and_why_not_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], sigma_m: float, options: list[str], is_told: bool
) -> None:
    tracks, log = tmp_path / "tracks.csv", str(tmp_path / "a.db")
    near_miss(tracks, sigma_m)
    asked = [part for one in options for part in ("--min-confidence", one)]
    assert app.run(["process", str(tracks), "--log", log, *asked]) == 0
    capsys.readouterr()
    assert [one.type for one in read_all(log, EventFilter(types=("near_miss",)))] == ["near_miss"] * is_told
    [event] = read_all(log, EventFilter(types=("near_miss",), min_confidence=0.0))
    assert (event.confidence >= 0.98) == (sigma_m < 1)
    assert app.run(["explain", log, event.id]) == 0
    weakest = "" if event.confidence == 1 else "; weakest: conflict["
    assert f"sure to {event.confidence:.2f}{weakest}" in capsys.readouterr().out
    assert app.run(["why-not", log, "near_miss"]) == 0
    said = f"not told: one that is sure to {event.confidence:.2f}, below the floor of 0.98"
    assert (said in capsys.readouterr().out) != is_told
