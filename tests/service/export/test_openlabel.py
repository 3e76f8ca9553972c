"""Is what is written OpenLABEL 1.0.0, and does reading it give back the events, cars and relations of the run?"""

import re
from pathlib import Path
from typing import Literal

import msgspec
import pytest

from service.api.app import create_app
from service.cli import app
from service.questions.events.queries import MAX_LIMIT
from service.records.seen import LeftOutFrame, RelationRecord
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, read_all, run, state, write_log

STEP_US = 40_000
COUNT = 500
UID = re.compile(r"-?[0-9]+")


class Strict(msgspec.Struct, forbid_unknown_fields=True):
    """As the published schema has it: its fields and no others."""


class Frames(Strict):
    frame_start: int
    frame_end: int


class Number(Strict):
    name: str
    val: float


class Text(Strict):
    name: str
    val: str


class EventData(Strict):
    num: list[Number]
    text: list[Text]


class Object(Strict):
    name: str
    type: str
    frame_intervals: list[Frames]


class Event(Object):
    event_data: EventData


class Agent(Strict):
    uid: str
    type: Literal["object", "action", "event", "context"]


class Relation(Object):
    rdf_subjects: list[Agent]
    rdf_objects: list[Agent]


class Metadata(msgspec.Struct):
    schema_version: Literal["1.0.0"]


class Stream(Strict):
    type: Literal["camera", "lidar", "radar", "gps_imu", "other"]
    uri: str


class Content(Strict):
    metadata: Metadata
    streams: dict[str, Stream]
    frame_intervals: list[Frames]
    objects: dict[str, Object]
    events: dict[str, Event]
    relations: dict[str, Relation]


class File(Strict):
    openlabel: Content


def read(text: str) -> Content:
    content = msgspec.json.decode(text, type=File).openlabel
    for elements in (content.objects, content.events, content.relations):
        assert all(map(UID.fullmatch, elements))
    agents = [one for relation in content.relations.values() for one in (*relation.rdf_subjects, *relation.rdf_objects)]
    assert all(one.uid in {"object": content.objects, "event": content.events}[one.type] for one in agents)
    return content


@pytest.fixture
def url(tmp_path: Path) -> str:
    """A run of 20 s, in which two of three frames are not looked at."""
    with open_log(str(tmp_path / "a.db"), "w") as log:
        writer = log.begin_run(run(relations=("behind", "side", "moving")))
        for number in range(0, COUNT, 3):
            writer.append_frames([number * STEP_US], number=number + 1)
            left_out = [other for other in (number + 1, number + 2) if other < COUNT]
            writer.append([LeftOutFrame(other + 1, other * STEP_US) for other in left_out])
        writer.append_states([state(0, "car7"), state(3 * SECOND_US, "car3", car_class="truck")])
        writer.append_states(
            [state(19 * SECOND_US, "car7"), state(20 * SECOND_US - STEP_US, "car3", car_class="truck")]
        )
        at, changes = 4 * SECOND_US, (("behind", ("car7", "car3"), "true"), ("side", ("car7", "car3"), "left"))
        writer.append([RelationRecord(at, at, *one[:2], "false", one[2]) for one in changes])
        writer.append([RelationRecord(at + 10_000, at + STEP_US, "moving", ("car3",), "false", "true")])
        writer.append([RelationRecord(8 * SECOND_US, 8 * SECOND_US, "behind", ("car7", "car3"), "true", "false")])
        turn = overtake(9 * SECOND_US + 1, 9 * SECOND_US + 1, type="turn", roles={"driver": "car7", "road": "road1"})
        writer.append_events([overtake(5 * SECOND_US), turn])
        writer.finish("finished")
    return str(tmp_path / "a.db")


def exported(url: str, query: str = "") -> Content:
    with Client(create_app(url, shipped=())) as client:
        answer = client.get(f"/api/v1/events/export?format=openlabel{query}")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/json"), answer.text
    return read(answer.text)


def test_events_survive_a_round_trip(url: str) -> None:
    content, roles = exported(url), {}
    for relation in content.relations.values():
        subject = relation.rdf_subjects[0]
        if subject.type == "event":
            filled = roles.setdefault(subject.uid, {})
            filled[relation.name] = content.objects[relation.rdf_objects[0].uid].name
    found = [
        (one.name, one.type, roles[uid], *(int(number.val) for number in one.event_data.num[:2]))
        for uid, one in content.events.items()
    ]
    assert found == [(one.id, one.type, one.roles, one.start_us, one.end_us) for one in read_all(url)]


def test_intervals_are_the_frames_that_are_shown(url: str) -> None:
    content = exported(url)
    shown = {one.name: one.frame_intervals for one in (*content.objects.values(), *content.relations.values())}
    assert shown["car7"] == [Frames(0, 475)]
    assert shown["car3"] == [Frames(75, 499)]
    assert shown["road1"] == []
    assert shown["behind"] == [Frames(100, 199)]  # [4 s, 8 s) at 25 frames a second
    assert shown["side left"] == [Frames(100, 499)]  # it held to the end
    assert [one.frame_intervals for one in content.events.values()] == [[Frames(125, 199)], [Frames(225, 225)]]
    assert content.frame_intervals == [Frames(0, 499)]


def test_relations_have_their_words_and_places(url: str) -> None:
    content = exported(url)
    found = {
        (one.type, *(content.objects[agent.uid].name for agent in (*one.rdf_subjects, *one.rdf_objects)))
        for one in content.relations.values()
        if one.rdf_subjects[0].type == "object"
    }
    assert found == {("behind", "car7", "car3"), ("side", "car7", "car3"), ("moving", "car3")}
    assert {one.name: one.type for one in content.objects.values()} == {
        "car7": "car",
        "car3": "truck",
        "road1": "other",
    }


def test_a_window_bounds_all_and_other_filters_events_alone(url: str) -> None:
    early = exported(url, "&to=2s")
    assert [*early.events] == [*early.relations] == []
    assert [one.name for one in early.objects.values()] == ["car7"]
    utc = exported(url, "&from=2026-05-01T08:00:08.5Z")
    assert {one.type for one in utc.relations.values()} == {"driver", "road", "side", "moving"}
    turns = exported(url, "&type=turn")
    assert [one.type for one in turns.events.values()] == ["turn"]
    assert "behind" in {one.type for one in turns.relations.values()}


@pytest.mark.long
def test_many_events_are_one_file_and_none_are_too(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake(number) for number in range(MAX_LIMIT + 1)])
    content = exported(url)
    assert (len(content.events), len(content.relations)) == (MAX_LIMIT + 1, 2 * MAX_LIMIT + 2)
    assert exported(url, "&type=none").events == {}


def test_it_is_of_one_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_log(tmp_path / "a.db", [overtake()])
    url = write_log(tmp_path / "a.db", [overtake()], record=run("r2"))
    with Client(create_app(url, shipped=())) as client:
        answer = client.get("/api/v1/events/export?format=openlabel")
        assert (answer.status_code, answer.json()["type"]) == (404, "urn:dyknow:problem:not-in-log")
        sent = client.get("/api/v1/events/export?format=openlabel&run=r2").text
    assert [one.name for one in read(sent).events.values()] == ["r2-1"]
    assert app.run(["events", url, "--run", "r2", "--format", "openlabel"]) == 0
    assert capsys.readouterr().out == sent
    assert app.run(["events", url, "--format", "openlabel", "--limit", "3"]) == 2
    assert "openlabel: expected one log, and no --limit" in capsys.readouterr().err
