"""What a run has stored is enough to recognise it again and to explain it."""

import json
from pathlib import Path

import pytest

from chronicles.recogniser import recognise
from service.cli.app import run
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.stored_events import chronicles_of, stored_events, unwatched_relations
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.records.events import EventRecord
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.conftest import Demo

LIBRARY = Path(__file__).parents[2] / "chronicles" / "library"


@pytest.fixture(scope="module")
def url(tracks_log: Path) -> str:
    return str(tracks_log)


@pytest.fixture(scope="module")
def events(url: str) -> list[EventRecord]:
    with open_log(url) as log:
        return [decode_event(text) for text in iterate_events(log, EventFilter())]


@pytest.mark.long
def test_recognising_a_stored_run_again_gives_its_standing_events(url: str, events: list[EventRecord]) -> None:
    with open_log(url) as log:
        stored = stored_events(log, log.run().id)
        found = recognise(chronicles_of(log.run()), stored.events, until_us=stored.until_us)
    again = sorted((one.chronicle, one.start_us, one.end_us, sorted(one.roles.items())) for one in found)
    assert again == sorted((one.chronicle.name, one.start_us, one.end_us, sorted(one.roles.items())) for one in events)
    assert {"overtake", "pass"} <= {one.chronicle.name for one in events}


@pytest.mark.long
def test_every_event_is_explained(url: str, events: list[EventRecord]) -> None:
    with open_log(url) as log:
        explainer = Explainer(log)
        for event in events:
            found = explainer.explain_event(event.id)
            assert found is not None
            assert (found.explanation.start_us, found.explanation.end_us) == (event.start_us, event.end_us)
            slacks = [one.slack_us for one in found.explanation.constraints if one.slack_us is not None]
            assert all(slack >= 0 for slack in slacks)


def test_an_overtake_is_explained_by_the_chain_of_both_cars(url: str, events: list[EventRecord]) -> None:
    overtake = next(one for one in events if one.type == "overtake")
    with open_log(url) as log:
        found = Explainer(log).explain_event(overtake.id)
    assert found is not None
    assert set(found.identities) == {"overtaker", "overtaken"}
    for chain in found.identities.values():
        assert [one.level for one in chain][-1] == "car"


def test_the_overtaken_car_did_not_overtake(url: str, events: list[EventRecord]) -> None:
    overtake = next(one for one in events if one.type == "overtake")
    roles = {"overtaker": overtake.roles["overtaken"], "overtaken": overtake.roles["overtaker"]}
    with open_log(url) as log:
        found = Explainer(log).explain_absence(AbsenceQuestion(chronicle="overtake", roles=roles))
    assert found.recognised == 0
    assert found.near_misses


@pytest.mark.long
def test_one_chronicle_alone_costs_and_stores_only_its_relations(
    small_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(tmp_path / "log.db")
    process(RunRequest(small_scene / "truth.csv", small_scene / "site.toml", log, (LIBRARY / "crossing.chronicle",)))
    with open_log(log) as opened:
        assert opened.run().relations == ("in_crossing",)
        assert {one.name for one in opened.relations(opened.run().id)} <= {"in_crossing"}
    with open_log(log) as opened:
        asked = ("ahead", "behind", "beside", "in_crossing", "moving", "on")
        computed = unwatched_relations(opened, opened.run(), asked)
        assert {one.name for one in computed.changes} == {"ahead", "behind", "beside", "moving", "on"}
    assert run(["recognise", log, "--chronicles", str(LIBRARY / "overtake.chronicle"), "--format", "jsonl"]) == 0
    assert {json.loads(line)["chronicle"]["name"] for line in capsys.readouterr().out.splitlines()} == {"overtake"}


def test_a_stored_run_is_recognised_from_the_command_line(
    url: str, events: list[EventRecord], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["recognise", url, "--chronicles", str(LIBRARY / "overtake.chronicle"), "--format", "jsonl"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert sorted((one["start_us"], one["end_us"]) for one in found) == sorted(
        (one.start_us, one.end_us) for one in events if one.type == "overtake"
    )


def test_what_is_recognised_again_has_the_form_of_what_the_run_told(
    demo: Demo, capsys: pytest.CaptureFixture[str]
) -> None:
    """Key by key, value by value; of what is in no log there are no names, and the links it rests on are decided."""

    def printed(*command: str) -> list[dict[str, object]]:
        assert run([*command, "--format", "jsonl"]) == 0
        found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
        return sorted(found, key=lambda one: (one["start_us"], one["type"], str(one["roles"])))

    told = printed("events", str(demo.log))
    again = [one for one in printed("recognise", str(demo.log)) if one["status"] != "doubtful"]
    assert len(told) > 10
    assert [list(one) for one in again] == [list(one) for one in told]
    own = {"id": "", "seq": 0, "recognised_us": 0, "hypotheses": [], "status": "", "revises": None}
    assert [one | own for one in again] == [one | own for one in told]
    assert any(one["place"] for one in again)
    assert {one["id"] for one in again} == {""}
