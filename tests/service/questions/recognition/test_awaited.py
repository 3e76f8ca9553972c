"""Is it told what a chronicle waits for, until when, and what became of it?"""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event
from service.api.app import create_app
from service.api.messages.bodies import AwaitedAnswer, Problem
from service.cli.app import run as run_cli
from service.questions.recognition.awaited import AwaitedList, awaited_instances
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, read_all

STAY = load(
    "chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] "
    "noevent(alarm[], (t1, t1 + 2s)) }"
)
EVENTS = [
    Event("enter", ("a",), 0),
    Event("enter", ("b",), 1 * SECOND_US),
    Event("leave", ("a",), 5 * SECOND_US),
    Event("enter", ("c",), 11 * SECOND_US),
    Event("alarm", (), 12 * SECOND_US),
]


def states(since_s: int, at_s: int) -> list[tuple[str, str, int]]:
    found = awaited_instances(STAY, "stay", EVENTS, since_us=since_s * SECOND_US, at_us=at_s * SECOND_US)
    return [(one.roles["car"], one.state, one.latest_us // SECOND_US) for one in found]


def test_what_is_under_way_says_what_it_waits_for_and_until_when() -> None:
    assert states(4, 4) == [("a", "awaited", 9), ("b", "awaited", 10)]
    [first, _] = awaited_instances(STAY, "stay", EVENTS, since_us=4 * SECOND_US, at_us=4 * SECOND_US)
    assert [(one.label, one.t_us) for one in first.matched] == [("t1", 0)]
    assert [(one.label, one.pattern, one.earliest_us, one.latest_us) for one in first.expected] == [
        ("t2", "leave[?car]", 4 * SECOND_US, 9 * SECOND_US)
    ]


@pytest.mark.parametrize(
    ("since_s", "at_s", "expected"),
    [
        # Nothing is consumed: what was recognised with one leave still waits for another.
        (0, 8, [("a", "awaited", 9), ("b", "awaited", 10), ("a", "recognised", 5)]),
        (6, 9, [("a", "awaited", 9), ("b", "awaited", 10)]),
        (6, 11, [("c", "awaited", 20), ("a", "recognised", 9), ("b", "timed out", 10)]),
        (10, 13, [("b", "timed out", 10), ("c", "failed", 20)]),
        (13, 13, []),
    ],
)
def test_what_ended_since_a_time_says_how(since_s: int, at_s: int, expected: list[tuple[str, str, int]]) -> None:
    assert states(since_s, at_s) == expected


def test_nothing_after_the_time_counts() -> None:
    for at_s in range(14):
        early = [one for one in EVENTS if one.t_us <= at_s * SECOND_US]
        found = awaited_instances(STAY, "stay", early, since_us=0, at_us=at_s * SECOND_US)
        assert found == awaited_instances(STAY, "stay", EVENTS, since_us=0, at_us=at_s * SECOND_US)


@pytest.fixture(scope="module")
def log(tracks: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    url = str(tmp_path_factory.mktemp("awaited") / "a.db")
    assert run_cli(["process", str(tracks), "--site", str(tracks.parent / "site.toml"), "--log", url]) == 0
    return url


@pytest.fixture(scope="module")
def client(log: str) -> Iterator[Client]:
    with Client(create_app(log)) as client:
        yield client


def ask(client: Client, query: str) -> AwaitedList:
    answer = client.get(f"/api/v1/chronicles/overtake/partial?{query}")
    assert answer.status_code == 200, answer.text
    told = msgspec.json.decode(answer.content, type=AwaitedAnswer)
    assert told.looked_at[0].run == told.run
    return told


@pytest.mark.long
def test_an_overtake_is_awaited_before_it_is_recognised(client: Client, log: str) -> None:
    event = next(one for one in read_all(log) if one.type == "overtake")
    roles = "&".join(f"role.{role}={actor}" for role, actor in event.roles.items())
    middle_us = (event.start_us + event.end_us) // 2
    [before] = [one for one in ask(client, f"at={middle_us}&{roles}").items if one.state == "awaited"]
    assert before.matched[0].t_us == event.start_us
    assert before.expected[0].earliest_us >= middle_us
    after = ask(client, f"from={middle_us}&at={event.recognised_us}&{roles}")
    assert "recognised" in {one.state for one in after.items}
    assert (after.run, after.since_us, after.count >= len(after.items)) == (event.run, middle_us, True)


def test_without_a_time_the_end_of_the_run_is_asked_about(client: Client, log: str) -> None:
    found = ask(client, "limit=1")
    with open_log(log) as opened:
        assert found.at_us == found.since_us == opened.last_us(found.run)
    assert {one.state for one in found.items} == {"awaited"}
    assert len(found.items) == 1 < found.count


@pytest.mark.parametrize(
    ("path", "status", "detail"),
    [
        ("nothing/partial", 404, "expected one of its chronicles, got 'nothing'"),
        ("overtake/partial?role.driver=car1", 400, "expected one of overtaker, overtaken, road, got 'driver'"),
        ("overtake/partial?at=1h", 422, "at: expected"),
        ("overtake/partial?to=5s", 422, "query: expected a parameter of this path or role.NAME, got 'to'"),
        ("overtake/partial?from=5s&at=2s", 400, "from: expected a time before"),
        ("overtake/partial?at=2000s", 404, "nothing was filmed then"),
    ],
)
def test_what_cannot_be_asked_is_refused(client: Client, path: str, status: int, detail: str) -> None:
    answer = client.get(f"/api/v1/chronicles/{path}")
    assert (answer.status_code, msgspec.json.decode(answer.content, type=Problem).status) == (status, status)
    assert detail in answer.json()["detail"]
