"""Do relations come as intervals, of the window and the things that were asked about?"""

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.api.app import create_app
from service.questions.observations.coverage import Coverage
from service.questions.observations.relation_intervals import RelationQuestion, relation_intervals
from service.records.seen import HypothesisRecord, RelationRecord
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, run, state


def change(t_s: int, name: str, args: str, new: str, *hypotheses: str) -> RelationRecord:
    """Build a change that is decided half a second after it happened."""
    t_us = t_s * SECOND_US
    return RelationRecord(t_us, t_us + 500_000, name, tuple(args.split()), "unknown", new, hypotheses)


CHANGES = (
    change(0, "on", "car7 road1", "true"),
    change(1, "behind", "car7 car3", "true"),
    change(4, "behind", "car7 car3", "false"),
    change(5, "behind", "car3 car7", "true"),
    change(6, "beside", "car3 car7", "true", "wrong"),
)


def write(place: Path, changes: tuple[RelationRecord, ...]) -> str:
    with open_log(str(place), "w") as log:
        writer = log.begin_run(run(relations=("on", "behind", "beside")))
        writer.append_frames([second * SECOND_US for second in range(11)])
        for second in (0, 10):
            writer.append_states([state(second * SECOND_US, car) for car in ("car3", "car7")])
        writer.append(sorted(changes, key=lambda one: one.decided_us))
        writer.append([HypothesisRecord(8 * SECOND_US, "wrong", "refuted")])
        writer.finish("finished")
    return str(place)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with Client(create_app(write(tmp_path_factory.mktemp("relations") / "a.db", CHANGES), shipped=())) as client:
        yield client


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("relations", ["on 0 -", "behind 1 4", "behind 5 -"]),
        ("relations?name=behind&name=beside", ["behind 1 4", "behind 5 -"]),
        ("relations?b=road1", ["on 0 -"]),
        ("relations?a=car3&b=car7", ["behind 1 4", "behind 5 -"]),
        ("relations?from=4s&to=5s", ["on 0 -"]),
        ("relations?to=3s&a=car3", ["behind 1 -"]),
        ("relations/at?t_us=3s", ["on 0 -", "behind 1 -"]),
        ("relations?a=car9", []),
    ],
)
def test_intervals_of_a_window(client: Client, path: str, told: list[str]) -> None:
    items = client.get(f"/api/v1/{path}").json()["items"]
    ends = ["-" if one["end_us"] is None else one["end_us"] // SECOND_US for one in items]
    assert [f"{one['name']} {one['start_us'] // SECOND_US} {end}" for one, end in zip(items, ends, strict=True)] == told


def test_the_earliest_come_first_and_all_are_counted(client: Client) -> None:
    found = client.get("/api/v1/relations?limit=1").json()
    assert (found["count"], [one["name"] for one in found["items"]]) == (3, ["on"])
    assert found["looked_at"][0]["spans_us"] == [[0, 10 * SECOND_US]]


@pytest.mark.parametrize("limit", [1, 2, 3, 4, 99])
def test_pages_by_cursor_are_the_whole(tmp_path: Path, limit: int) -> None:
    pairs = [f"car{first} car{second}" for first in range(3) for second in range(3) if first != second]
    changes = [change(start, name, pair, "true") for name in ("behind", "beside") for pair in pairs for start in (1, 2)]
    with Client(create_app(write(tmp_path / "a.db", tuple(changes)), shipped=())) as client:
        path = "/api/v1/relations?from=0s&to=9s"
        whole, cursor, pages = client.get(path).json(), "", []
        while cursor is not None:
            page = client.get(f"{path}&limit={limit}{cursor and f'&cursor={cursor}'}").json()
            assert page["count"] == whole["count"]
            pages += page["items"]
            assert len(page["items"]) == limit or page["next_cursor"] is None
            cursor = page["next_cursor"]
        assert pages == whole["items"]
        assert len(pages) == 24
        assert whole["next_cursor"] is None


def test_a_cursor_of_another_question_is_refused(client: Client) -> None:
    cursor = client.get("/api/v1/relations?limit=1").json()["next_cursor"]
    assert client.get(f"/api/v1/relations?limit=1&cursor={cursor}").json()["items"][0]["name"] == "behind"
    for query in (f"a=car3&cursor={cursor}", "cursor=x"):
        answer = client.get(f"/api/v1/relations?{query}")
        assert (answer.status_code, answer.json()["type"]) == (400, "urn:dyknow:problem:bad-cursor")


@pytest.mark.parametrize(
    ("query", "status", "parameter"),
    [
        ("name=behnd", 422, "name"), ("limit=0", 422, "limit"), ("from=5s&to=5s", 400, "from"), ("x=1", 422, "x"),
        ("from=2026-05-01T08:00:00Z", 422, "from"),
    ],
)  # fmt: skip
def test_a_wrong_question_is_refused(client: Client, query: str, status: int, parameter: str) -> None:
    answer = client.get(f"/api/v1/relations?{query}")
    assert (answer.status_code, answer.json()["errors"][0]["parameter"]) == (status, parameter)


def test_a_time_is_needed_to_ask_what_held_at_it(client: Client) -> None:
    assert client.get("/api/v1/relations/at").json()["detail"] == "t_us: expected a value, got none"


def test_an_unwatched_relation_is_computed_from_the_cars(client: Client) -> None:
    (one,) = client.get("/api/v1/relations?name=moving&a=car7").json()["items"]
    assert one["args"] == ["car7"]


def test_intervals_are_what_a_walk_through_all_changes_gives(tmp_path: Path) -> None:
    rng = random.Random(4)
    changes = tuple(
        change(rng.randrange(10), "behind", rng.choice(("car3 car7", "car7 car3")), rng.choice(("true", "false")))
        for _ in range(30)
    )
    with open_log(write(tmp_path / "a.db", changes)) as log:
        for now_us in range(0, 10 * SECOND_US, SECOND_US // 2):
            question = RelationQuestion(names=("behind",), from_us=now_us, to_us=now_us + 1, limit=99)
            held = {}
            for one in sorted(log.relations("r1"), key=lambda one: one.t_us):
                if one.t_us <= now_us:
                    held[one.args] = one.new == "true"
            found = relation_intervals(log, question, Coverage(log)).items
            assert {one.args for one in found} == {args for args, holds in held.items() if holds}, now_us
