"""Is the object-centric event log whole: is all that an event names declared, and are the roles its relationships?"""

from pathlib import Path

from service.api.app import create_app
from service.questions.events.queries import MAX_LIMIT
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import overtake, run, state

EVENT_KEYS = {"id", "type", "time", "attributes", "relationships"}


def test_events_have_their_objects_and_types(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log:
        for name in ("r1", "r2"):
            writer = log.begin_run(run(name))
            writer.append_frames([0])
            writer.append_states([state(0, "car3", car_class="truck"), state(0, "car7")])
            on = {"driver": "car7", "road": "road1"}
            writer.append_events([overtake(), overtake(type="turn", roles=on)])
            writer.finish("finished")
    with Client(create_app(str(tmp_path / "a.db"), shipped=())) as client:
        answer = client.get("/api/v1/events/export?format=ocel")
        events = client.get("/api/v1/events").json()["items"]
        empty = client.get("/api/v1/events/export?format=ocel&type=none").json()
    found = answer.json()
    assert answer.headers["content-type"] == "application/json"
    assert found.keys() == {"eventTypes", "objectTypes", "events", "objects"}
    assert all(one.keys() == EVENT_KEYS for one in found["events"])
    assert [(one["id"], one["type"], one["time"]) for one in found["events"]] == [
        (one["id"], one["type"], one["start"]) for one in events
    ]
    roles = [{one["qualifier"]: one["objectId"] for one in event["relationships"]} for event in found["events"]]
    assert roles == [{role: f"{one['run']}/{actor}" for role, actor in one["roles"].items()} for one in events]
    objects = {one["id"]: one["type"] for one in found["objects"]}
    assert {one for named in roles for one in named.values()} == objects.keys()
    assert [objects[f"r2/{name}"] for name in ("car3", "car7", "road1")] == ["truck", "car", "other"]
    assert [one["name"] for one in found["objectTypes"]] == ["car", "other", "truck"]
    declared = {one["name"]: {given["name"] for given in one["attributes"]} for one in found["eventTypes"]}
    assert all({given["name"] for given in one["attributes"]} == declared[one["type"]] for one in found["events"])
    assert empty == {"events": [], "objects": [], "eventTypes": [], "objectTypes": []}


def test_more_events_than_are_read_at_once_are_one_log(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log:
        writer = log.begin_run(run())
        writer.append_events([overtake(number) for number in range(MAX_LIMIT + 1)])
        writer.finish("finished")
    with Client(create_app(str(tmp_path / "a.db"), shipped=())) as client:
        for form, name in (("ocel", "events"), ("geojson", "features")):
            assert len(client.get(f"/api/v1/events/export?format={form}").json()[name]) == MAX_LIMIT + 1
