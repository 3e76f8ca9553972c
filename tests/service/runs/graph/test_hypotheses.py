"""Identity hypotheses on their way from links to the event log: who carries which label, and what becomes of events."""

import json
from pathlib import Path

import pytest

from chronicles import load
from chronicles.adapter import RecognitionUnit
from chronicles.events import Event, Occurrence, Status
from chronicles.execution.unfit_events import UnfitCounter
from dyknow.sample import Sample
from dyknow.streams.hypotheses import Hypotheses
from qsr.adapter import FrameRelations
from qsr.changes.crossings import RelationChange
from service.api.app import create_app
from service.cli import app
from service.runs.graph.recording import Recorder
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, read_all, read_rows, run


class FakeRecogniser:
    """Note what it is told, in order; its occurrences are the texts of that."""

    def __init__(self) -> None:
        self.told: list[object] = []

    @property
    def open_hypotheses(self) -> tuple[str, ...]:
        return ("f#6",)

    def advance(self, t_us: int) -> list[Occurrence]:
        self.told.append(("advance", t_us))
        return []

    def revise(self, **told: object) -> list[Occurrence]:
        self.told.append({name: value for name, value in told.items() if value})
        return [occurrence("retracted"), occurrence("confirmed")]


def occurrence(status: Status, overtaken: str = "car2") -> Occurrence:
    roles = {"overtaker": "car1", "overtaken": overtaken}
    events = (Event("behind", ("car1", overtaken), SECOND_US, "true", "false", ("v1->w1#1",)),)
    emitted = (Event("overtake", ("car1", overtaken), 2 * SECOND_US), Event("pass", (overtaken,), 2 * SECOND_US))
    return Occurrence(
        chronicle="overtake",
        version="v1",
        roles=roles,
        start_us=SECOND_US,
        end_us=2 * SECOND_US,
        sub_events=(("t1", SECOND_US),),
        events=events,
        emitted=emitted,
        reports=(),
        recognised_us=3 * SECOND_US,
        hypotheses=("v1->w1#1",),
        status=status,
    )


def test_the_recogniser_hears_at_once_what_a_frame_decided() -> None:
    recogniser = FakeRecogniser()
    changes = (
        RelationChange("behind", ("car1", "car2"), 5, 9, None, True),
        RelationChange("turn", ("car3", "from", "j1"), 6, 9, None, "left"),
    )
    frame = FrameRelations(
        changes,
        Hypotheses(
            about={"car1": ("a#1", "b#2"), "car2": ("c#3",)},
            opened=(("f#6", 3),),
            validated=("d#4",),
            refuted=("e#5",),
            undecided=("g#7",),
        ),
    )
    unit = RecognitionUnit(recogniser, horizon_us=2)
    found = list(unit.update(Sample(9, 9, frame)))
    events = [
        Event("behind", ("car1", "car2"), 5, "unknown", "true", ("a#1", "b#2", "c#3")),
        Event("turn", ("car3", "from", "j1"), 6, "unknown", "left"),
    ]
    told = {"opened": (("f#6", 3),), "refuted": ("e#5",), "confirmed": ("d#4",), "undecided": ("g#7",)}
    assert recogniser.told == [told | {"events": events}, ("advance", 9)]
    assert list(unit.finish())
    assert recogniser.told[2:] == [{"undecided": ("f#6",)}, ("advance", 11)]
    assert [sample.value.status for sample in found] == ["retracted", "confirmed"]


def record(path: Path, *occurrences: Occurrence) -> Recorder:
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run())
        recorder = Recorder(writer, None, UnfitCounter(load("message m[]")), history_us=SECOND_US)
        for one in occurrences:
            recorder._record_occurrence(Sample(3 * SECOND_US, one.end_us, one))
        writer.finish("finished")
    return recorder


def test_a_confirmed_event_is_a_new_row_that_names_the_tentative_one(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    recorder = record(path, occurrence("tentative"), occurrence("tentative", "car9"), occurrence("confirmed"))
    rows = [(one.id, one.type, one.status, one.revises) for one in read_rows(str(path))]
    assert rows == [
        ("r1-1", "overtake", "tentative", None),
        ("r1-2", "pass", "tentative", None),
        ("r1-3", "overtake", "tentative", None),
        ("r1-4", "pass", "tentative", None),
        ("r1-5", "overtake", "confirmed", "r1-1"),
        ("r1-6", "pass", "confirmed", "r1-2"),
    ]
    assert [one.id for one in read_all(str(path))] == ["r1-3", "r1-4", "r1-5", "r1-6"]
    assert recorder.events == 4


def test_a_retracted_event_is_listed_only_when_asked_for(tmp_path: Path) -> None:
    from service.questions.events.queries import EventFilter

    path = tmp_path / "a.db"
    recorder = record(path, occurrence("tentative"), occurrence("retracted"), occurrence("recognised", "car9"))
    assert [one.id for one in read_all(str(path))] == ["r1-5", "r1-6"]
    retracted = read_all(str(path), EventFilter(statuses=("retracted",)))
    assert [(one.id, one.revises) for one in retracted] == [("r1-3", "r1-1"), ("r1-4", "r1-2")]
    assert read_all(str(path), EventFilter(statuses=("tentative",))) == []
    assert recorder.events == 2


def test_an_event_that_rested_on_nothing_open_may_be_retracted_too(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    recorder = record(path, occurrence("recognised"), occurrence("retracted"))
    assert [(one.status, one.revises) for one in read_rows(str(path))][2:] == [
        ("retracted", "r1-1"),
        ("retracted", "r1-2"),
    ]
    assert read_all(str(path)) == []
    assert recorder.events == 0


def test_a_confirmed_event_may_be_retracted_too(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    record(path, occurrence("tentative"), occurrence("confirmed"), occurrence("retracted"))
    assert read_all(str(path)) == []
    assert [one.revises for one in read_rows(str(path))] == [None, None, "r1-1", "r1-2", "r1-3", "r1-4"]


def test_the_command_line_and_http_list_retracted_events_only_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.db"
    record(path, occurrence("tentative"), occurrence("retracted"), occurrence("tentative", "car9"))
    for arguments, query, ids in [
        ([], "", ["r1-5", "r1-6"]),
        (["--status", "retracted"], "?status=retracted", ["r1-3", "r1-4"]),
        (["--status", "tentative", "--status", "retracted"], "?status=tentative&status=retracted", None),
    ]:
        assert app.run(["events", str(path), "--format", "jsonl", *arguments]) == 0
        shown = [json.loads(line)["id"] for line in capsys.readouterr().out.splitlines()]
        assert shown == (ids or ["r1-3", "r1-4", "r1-5", "r1-6"])
        with Client(create_app(str(path), shipped=())) as client:
            assert [one["id"] for one in client.get(f"/api/v1/events{query}").json()["items"]] == shown
            assert client.get("/api/v1/events/r1-1").json()["status"] == "tentative"


def test_an_occurrence_recognised_anew_is_another_event(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    record(path, occurrence("tentative"), occurrence("retracted"), occurrence("tentative"), occurrence("confirmed"))
    assert [(one.id, one.revises) for one in read_all(str(path))] == [("r1-7", "r1-5"), ("r1-8", "r1-6")]
