"""Explanations from a log: why an event is in it, why another one is not, and who the cars were."""

import json
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

from chronicles.recogniser import recognise
from service.api.app import create_app
from service.cli.app import run
from service.errors import LogError, QueryError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.stored_events import Part, StoredEvents, chronicles_of, stored_events
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.records.events import ChronicleRef, EventDraft, SubEvent
from service.records.runs import RunRecord, SourceText
from service.records.seen import HypothesisRecord, LinkRecord, RelationRecord
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import load_chronicle_files
from tests.conftest import Demo
from tests.service.http import Client

MET = """\
message met[?a, ?b] { ?a in Car  ?b in Car }
chronicle met[?a, ?b](t1, t2) {
  event(close[?a, ?b]:(false, true), t1)
  event(beside[?a, ?b]:(false, true), t2)
  t2 - t1 in [0s, 9s]
  when recognised { emit met[?a, ?b] }
}
"""
MET_ALONE = """\
message close[?a, ?b]
message beside[?a, ?b]
chronicle met[?a, ?b](t1, t2) {
  event(close[?a, ?b], t1)
  event(beside[?a, ?b], t2)
  t2 - t1 in [0s, 9s]
}
"""
SECOND = 1_000_000


def relation(second: int, name: str, *args: str, hypotheses: tuple[str, ...] = ()) -> RelationRecord:
    return RelationRecord(second * SECOND, second * SECOND, name, args, "false", "true", hypotheses)


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A run in which car1 met car2, came near car3 too late, and was taken for having met car4."""
    folder = tmp_path_factory.mktemp("met")
    path = folder / "met.chronicle"
    path.write_text(MET)
    loaded = load_chronicle_files([path])
    record = RunRecord(
        id="r1",
        source="demo.mp4",
        start_utc_us=0,
        chronicles=loaded.records,
        texts=loaded.texts,
        relations=("beside", "close"),
    )
    wrong = ("v4->w4#7",)
    relations = [
        relation(1, "close", "car1", "car2"),
        relation(3, "beside", "car1", "car2"),
        relation(10, "close", "car1", "car3"),
        relation(21, "beside", "car1", "car3"),
        relation(30, "close", "car1", "car4", hypotheses=wrong),
        relation(31, "beside", "car1", "car4", hypotheses=wrong),
    ]
    links = [
        LinkRecord(0, "established", "world", "v1", "w1"),
        LinkRecord(0, "established", "car", "w1", "car1"),
        LinkRecord(2 * SECOND, "lost", "world", "v1", "w1", "the vision object is gone"),
        LinkRecord(2 * SECOND + 5, "reestablished", "world", "v9", "w1"),
        LinkRecord(40 * SECOND, "refuted", "world", "v9", "w1"),
    ]
    version = loaded.merged.plan("met").version
    drafts = [draft(version, 1, 3, "car2"), draft(version, 30, 31, "car4", status="tentative", hypotheses=wrong)]
    with open_log(str(folder / "a.db"), "w") as log:
        writer = log.begin_run(record)
        writer.append_frames(second * SECOND for second in range(41))
        writer.append(links)
        writer.append(relations)
        writer.append([HypothesisRecord(32 * SECOND, *wrong, "refuted")])
        writer.append_events(drafts)
        writer.finish("finished")
    return str(folder / "a.db")


def draft(version: str, start: int, end: int, other: str, **fields: object) -> EventDraft:
    return EventDraft(
        type="met",
        chronicle=ChronicleRef("met", version),
        start_us=start * SECOND,
        end_us=end * SECOND,
        roles={"a": "car1", "b": other},
        recognised_us=end * SECOND,
        sub_events=(SubEvent("t1", start * SECOND), SubEvent("t2", end * SECOND)),
        **fields,  # type: ignore[arg-type]  # fields of any type, by name
    )


@pytest.fixture(scope="module")
def log(url: str) -> Iterator[EventLog]:
    with open_log(url) as opened:
        yield opened


def test_the_chronicles_of_a_run_are_the_same_when_compiled_again(log: EventLog) -> None:
    record = log.run()
    assert [chronicles_of(record).plan(one.name).version for one in record.chronicles] == [
        one.version for one in record.chronicles
    ]


def test_the_stored_events_without_refuted_ones_give_the_standing_events(log: EventLog) -> None:
    stored = stored_events(log, "r1")
    found = recognise(chronicles_of(log.run()), stored.events, until_us=stored.until_us)
    assert [one.roles for one in found] == [{"a": "car1", "b": "car2"}]
    assert stored.until_us == 40 * SECOND


def test_an_event_is_explained_with_the_room_of_its_constraints(log: EventLog) -> None:
    found = Explainer(log).explain_event("r1-1")
    assert found is not None
    [constraint] = found.explanation.constraints
    assert (constraint.value_us, constraint.slack_us) == (2 * SECOND, 2 * SECOND)


def test_what_is_read_to_explain_an_event_is_enough(demo: Demo, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []

    def counted(
        log: EventLog, run_id: str, *, believed: Collection[str] = (), part: Part | None = None
    ) -> StoredEvents:
        found = stored_events(log, run_id, believed=believed, part=part)
        read.append(len(found.events))
        return found

    def whole(log: EventLog, run_id: str, *, believed: Collection[str] = (), part: Part | None = None) -> StoredEvents:
        return stored_events(log, run_id, believed=believed)

    with open_log(str(demo.log)) as log:
        every = EventFilter(statuses=("recognised", "tentative", "confirmed", "retracted", "doubtful"))
        ids = [decode_event(text).id for text in iterate_events(log, every)]
        explained = []
        for reader, asked in ((counted, ids), (whole, ids[::3])):
            monkeypatch.setattr("service.questions.recognition.explaining.stored_events", reader)
            explained.append([_shown(Explainer(log), one) for one in asked])
        assert explained[0][::3] == explained[1]
        assert len(read) == len(ids) > 8
        assert max(read) < len(stored_events(log, log.run().id).events) / 2


def _shown(explainer: Explainer, event_id: str) -> tuple[str, object]:
    found = explainer.explain_event(event_id)
    assert found is not None
    return found.render(), found.as_record()


def test_a_question_about_a_window_reads_what_may_lie_in_it(
    url: str, demo: Demo, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []

    def counted(log: EventLog, run_id: str, **asked: Part | None) -> StoredEvents:
        found = stored_events(log, run_id, **asked)
        read.append(len(found.events))
        return found

    with open_log(url) as log:
        monkeypatch.setattr("service.questions.recognition.explaining.stored_events", counted)
        for roles in ({}, {"a": "car1"}):
            asked = AbsenceQuestion(chronicle="met", roles=roles, start_us=35 * SECOND, end_us=40 * SECOND)
            assert Explainer(log).explain_absence(asked).recognised == 0
        assert read == [0, 0, 4]  # car1 occurs, though not in the window
    monkeypatch.undo()
    with open_log(str(demo.log)) as log:
        explainer, whole = Explainer(log), Explainer(log)
        monkeypatch.setattr(whole, "_part", lambda *_: None)
        for name in ("overtake", "pass", "near_miss"):
            asked = AbsenceQuestion(chronicle=name, roles={}, start_us=10 * SECOND, end_us=20 * SECOND)
            assert explainer.explain_absence(asked) == whole.explain_absence(asked)


def test_what_was_true_long_before_of_others_is_looked_up(tmp_path: Path) -> None:
    path = tmp_path / "passed.chronicle"
    path.write_text("""\
message passed[?a] { ?a in Car }
chronicle passed[?a](t1) {
  event(close[?a, ?b]:(false, true), t1)
  hold(moving[?b]:false, (t1, t1 + 1s))
  when recognised { emit passed[?a] }
}
""")
    loaded = load_chronicle_files([path])
    record = RunRecord(
        id="r1",
        source="a.mp4",
        start_utc_us=0,
        chronicles=loaded.records,
        relations=("close", "moving"),
        texts=loaded.texts,
    )
    with open_log(str(tmp_path / "a.db"), "w") as log:
        writer = log.begin_run(record)
        writer.append_frames([0, 900 * SECOND])
        writer.append(
            [RelationRecord(0, 0, "moving", ("parked",), "unknown", "false"), relation(600, "close", "car1", "parked")]
        )
        chronicle = ChronicleRef("passed", loaded.records[0].version)
        draft = EventDraft(
            type="passed",
            chronicle=chronicle,
            start_us=600 * SECOND,
            end_us=600 * SECOND,
            roles={"a": "car1"},
            recognised_us=601 * SECOND,
            sub_events=(SubEvent("t1", 600 * SECOND),),
        )
        writer.append_events([draft])
        writer.finish("finished")
        found = Explainer(log).explain_event("r1-1")
        assert found is not None
        assert "moving[parked] was false from 0.000 s" in found.render()


def test_an_event_is_explained_by_who_its_cars_were_up_to_its_end(log: EventLog) -> None:
    found = Explainer(log).explain_event("r1-1")
    assert found is not None
    chain = [(one.lower, one.upper, one.start_us, one.end_us) for one in found.identities["a"]]
    assert chain == [
        ("v1", "w1", 0, 2 * SECOND),
        ("w1", "car1", 0, None),
        ("v9", "w1", 2 * SECOND + 5, 40 * SECOND),
    ]
    assert set(found.identities) == {"a"}


def test_an_event_that_was_taken_back_is_explained_by_what_was_believed(log: EventLog) -> None:
    found = Explainer(log).explain_event("r1-2")
    assert found is not None
    assert [one.event.args for one in found.explanation.events] == [("car1", "car4"), ("car1", "car4")]


def test_an_absence_is_explained_by_the_nearest_miss(log: EventLog) -> None:
    found = Explainer(log).explain_absence(AbsenceQuestion(chronicle="met", roles={"b": "car3"}))
    miss = found.near_misses[0]
    assert (miss.failures[0].kind, miss.short_us) == ("bound", 2 * SECOND)
    assert found.recognised == 0


@pytest.mark.parametrize("window", [(5, 15), (15, 30), (12, 13), (21, 22), (None, 15), (20, None)])
def test_a_window_asks_for_the_instances_that_overlap_it_with_all_their_events(
    log: EventLog, window: tuple[int | None, int | None]
) -> None:
    start_us, end_us = (None if second is None else second * SECOND for second in window)
    question = AbsenceQuestion(chronicle="met", roles={"b": "car3"}, start_us=start_us, end_us=end_us)
    [miss] = Explainer(log).explain_absence(question).near_misses
    assert [one.event.t_us for one in miss.events] == [10 * SECOND, 21 * SECOND]
    assert miss.failures[0].kind == "bound"


def test_a_window_apart_from_an_instance_does_not_ask_for_it(log: EventLog) -> None:
    question = AbsenceQuestion(chronicle="met", roles={"b": "car3"}, start_us=22 * SECOND)
    [miss] = Explainer(log).explain_absence(question).near_misses
    assert (miss.events, [one.kind for one in miss.failures]) == ((), ["missing event"] * 2)


@pytest.mark.parametrize(("window", "count"), [((0, 40), 1), ((2, 3), 1), ((3, 4), 1), ((4, 40), 0), ((0, 1), 0)])
def test_a_part_of_what_was_recognised_is_no_near_miss(log: EventLog, window: tuple[int, int], count: int) -> None:
    start_us, end_us = window[0] * SECOND, window[1] * SECOND
    question = AbsenceQuestion(chronicle="met", roles={"b": "car2"}, start_us=start_us, end_us=end_us)
    found = Explainer(log).explain_absence(question)
    assert found.recognised == count
    assert not any(miss.events for miss in found.near_misses)


@pytest.mark.parametrize(
    ("question", "error", "message"),
    [
        (AbsenceQuestion(chronicle="x", roles={}), LogError, "expected one of its chronicles, got 'x'; known: 'met'"),
        (AbsenceQuestion(chronicle="mett", roles={}), LogError, "got 'mett'; did you mean 'met'?"),
        (
            AbsenceQuestion(chronicle="met", roles={"b": "car33"}),
            LogError,
            "run 'r1': expected something that occurs in it as role 'b', got 'car33'; did you mean 'car3'?",
        ),
        (AbsenceQuestion(chronicle="met", roles={"c": "car1"}), QueryError, "role: expected one of a, b, got 'c'"),
        (AbsenceQuestion(chronicle="met", roles={}, start_us=5, end_us=5), QueryError, "from: expected a time before"),
        (AbsenceQuestion(chronicle="met", roles={}, run="r9"), LogError, "expected a run 'r9'"),
    ],
)
def test_a_question_that_cannot_be_answered_is_refused(
    log: EventLog, question: AbsenceQuestion, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Explainer(log).explain_absence(question)


def test_a_chronicle_may_be_asked_for_by_what_it_alone_emits(log: EventLog, tmp_path: Path) -> None:
    path = tmp_path / "turns.chronicle"
    one = "chronicle {name}[?a](t1) {{ event(close[?a, ?]:(?, true), t1) when recognised {{ emit near[?a] }} }}"
    path.write_text("message near[?a]\n" + one.format(name="near_one"))
    asked = AbsenceQuestion(chronicle="near", roles={})
    assert Explainer(log).explain_absence(asked, [path]).chronicle == "near_one"
    path.write_text("message near[?a]\n" + one.format(name="near_one") + one.format(name="near_two"))
    with pytest.raises(LogError, match="expected one of near_one, near_two, which emit 'near', got 'near'"):
        Explainer(log).explain_absence(asked, [path])


def test_explain_on_the_command_line(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", url, "r1-1"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("met[a=car1, b=car2] from 1.000 s to 3.000 s was recognised\n")
    assert "  a car1\n    v1 -> w1  00:00.000 to 00:02.000, lost: the vision object is gone\n" in shown
    assert run(["explain", url, "r1-1", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["event"], record["explanation"]["kind"]) == ("r1-1", "why")
    assert record["identities"]["a"][0]["lower"] == "v1"
    assert run(["explain", url, "r1-99"]) == 3
    assert "expected the id of one of its events, got 'r1-99'" in capsys.readouterr().err


def test_why_not_on_the_command_line(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["why-not", url, "met", "--role", "b=car3"]) == 0
    assert "t2 - t1 was too long by 2.000 s: it was 11.000 s, allowed 0.000 s to 9.000 s" in capsys.readouterr().out
    assert run(["why-not", url, "met", "--role", "b=car3", "--from", "9s", "--to", "12s", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["kind"], record["start_us"], record["roles"]) == ("why_not", 9 * SECOND, {"b": "car3"})
    assert run(["why-not", url, "met", "--role", "b=car3", "--role", "b=car4"]) == 2
    assert run(["why-not", url, "met", "--role", "c=car3"]) == 2
    assert run(["why-not", url, "met", "--role", "b=car2"]) == 0
    assert capsys.readouterr().out == "met[b=car2]: recognised once; 0 near misses\n"
    assert run(["why-not", url, "nosuch"]) == 3
    assert run(["why-not", url, "met", "--role", "b=car99"]) == 3
    assert "expected something that occurs in it as role 'b', got 'car99'" in capsys.readouterr().err


def test_a_log_is_recognised_again(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(Path(url).with_name("met.chronicle"))
    assert run(["recognise", url, "--chronicles", path, "--executor", "eager", "--format", "jsonl"]) == 0
    [line] = capsys.readouterr().out.splitlines()
    assert json.loads(line)["roles"] == {"a": "car1", "b": "car2"}


@pytest.fixture(scope="module")
def client(url: str) -> Iterator[Client]:
    with Client(create_app(url)) as opened:
        yield opened


def test_why_over_http(client: Client, log: EventLog) -> None:
    answer = client.get("/api/v1/events/r1-1/why")
    found = Explainer(log).explain_event("r1-1")
    assert found is not None
    assert answer.json() == json.loads(json.dumps(found.as_record()))
    schema = client.get("/openapi.json").json()["components"]["schemas"]["EventExplanation"]
    assert set(answer.json()) == set(schema["properties"])
    refused = client.get("/api/v1/events/r1-1/why?colour=red")
    assert (refused.status_code, refused.json()["type"]) == (422, "urn:dyknow:problem:bad-parameter")
    missing = client.get("/api/v1/events/r1-99/why")
    assert (missing.status_code, missing.json()["detail"][:6]) == (404, "event:")


@pytest.mark.parametrize("window", [("--from", "41s"), ("--from", "2:00", "--to", "3:00")])
def test_why_not_outside_the_time_that_was_filmed_says_so(
    url: str, capsys: pytest.CaptureFixture[str], window: tuple[str, ...]
) -> None:
    assert run(["why-not", url, "met", *window]) == 3
    said = capsys.readouterr().err
    assert "run 'r1': expected a window in the time that it covers (00:00.000 to 00:40.000), got 0" in said
    assert said.endswith(": nothing was filmed then\n")


def test_why_not_over_http(client: Client) -> None:
    answer = client.get("/api/v1/chronicles/met/why-not?role.b=car3&from=9s&limit=1")
    assert answer.status_code == 200
    assert (answer.json()["kind"], len(answer.json()["near_misses"])) == ("why_not", 1)
    assert answer.json()["looked_at"] == client.get("/api/v1/cars").json()["looked_at"]
    document = client.get("/openapi.json").json()
    explained = document["components"]["schemas"]["Explanation"]
    assert answer.json().keys() <= explained["$defs"]["why_not"]["properties"].keys()


@pytest.mark.parametrize(
    ("path", "status", "kind"),
    [
        ("nosuch/why-not", 404, "not-in-log"),
        ("met/why-not?run=r9", 404, "not-in-log"),
        ("met/why-not?role.b=car99", 404, "not-in-log"),
        ("met/why-not?role.c=car1", 400, "bad-filter"),
        ("met/why-not?colour=red", 422, "bad-parameter"),
        ("met/why-not?role.b=car1&role.b=car2", 422, "bad-parameter"),
        ("met/why-not?limit=51", 422, "bad-parameter"),
        ("met/why-not?from=2026-05-01T08:00:00Z", 422, "bad-parameter"),
        ("met/why-not?from=5s&to=5s", 400, "bad-filter"),
    ],
)
def test_a_question_that_cannot_be_answered_is_a_problem(client: Client, path: str, status: int, kind: str) -> None:
    answer = client.get(f"/api/v1/chronicles/{path}")
    assert (answer.status_code, answer.json()["type"]) == (status, f"urn:dyknow:problem:{kind}")


def test_a_run_whose_events_do_not_explain_is_a_conflict(tmp_path: Path) -> None:
    record = RunRecord(id="r1", source="demo.mp4", start_utc_us=0, texts=(SourceText("met.chronicle", MET_ALONE),))
    with open_log(str(tmp_path / "b.db"), "w") as log:
        writer = log.begin_run(record)
        writer.append_events([draft("another", 1, 3, "car2")])
        writer.finish("finished")
    with Client(create_app(str(tmp_path / "b.db"))) as client:
        answer = client.get("/api/v1/events/r1-1/why")
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:dyknow:problem:cannot-explain")
