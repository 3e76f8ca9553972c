"""Who was a car: the links of its chain, their verdicts, and the times at which nobody saw it."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.app import run as dyknow
from service.questions.observations.identity import chain_of, hidden_times, identities, links_below, links_of
from service.records.seen import HypothesisRecord, LinkRecord
from service.store.log import EventLog, open_log
from tests.service.http import Client
from tests.service.logs import run, state

S = 1_000_000


def link(t_us: int, kind: str, lower: str, upper: str, label: str = "", **fields: object) -> LinkRecord:
    level = {"w": "world", "r": "on_road", "c": "car"}[upper[0]]
    return LinkRecord(t_us, kind, level, lower, upper, "", label, **fields)  # type: ignore[arg-type]  # fields by name


# car1 is lost at 2 s, taken for v7 at 5 s and for v8 at 6 s, and nothing decides that; car2 is seen all the time.
LINKS = [
    link(0, "established", "v1", "w1", "v1->w1#1"),
    link(0, "established", "w1", "r1", "w1->r1#2"),
    link(0, "established", "r1", "car1", "r1->car1#3"),
    link(S, "established", "v2", "w2", "v2->w2#4"),
    link(S, "established", "w2", "r2", "w2->r2#5"),
    link(S, "established", "r2", "car2", "r2->car2#6"),
    link(2 * S, "lost", "v1", "w1"),
    link(
        5 * S, "reestablished", "v7", "w1", "v7->w1#7", score_nats=4.0, margin_nats=2.5, runner_up="w9", hidden_us=2 * S
    ),
    link(6 * S, "refuted", "v7", "w1"),
    link(
        6 * S,
        "reestablished",
        "v8",
        "w1",
        "v8->w1#8",
        score_nats=6.0,
        margin_nats=5.5,
        runner_up="new",
        hidden_us=2 * S,
    ),
    link(9 * S, "undecided", "v8", "w1", "v8->w1#8", score_nats=6.0, margin_nats=1.0, runner_up="v9"),
]
VERDICTS = [
    HypothesisRecord(2 * S, "v1->w1#1", "validated"),
    HypothesisRecord(3 * S, "v2->w2#4", "validated"),
    HypothesisRecord(6 * S, "v7->w1#7", "refuted"),
]


def write(path: Path, links: Sequence[LinkRecord], *, cars: Sequence[str] = ("car1", "car2")) -> str:
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run())
        writer.append_frames([0, 9 * S])
        writer.append_states([state(t_us, car) for t_us in (0, 9 * S) for car in cars])
        writer.append(links)
        writer.append(VERDICTS)
        writer.finish("finished")
    return str(path)


@pytest.fixture
def url(tmp_path: Path) -> str:
    return write(tmp_path / "a.db", LINKS)


@pytest.fixture
def log(url: str) -> Iterator[EventLog]:
    with open_log(url) as opened:
        yield opened


def test_a_link_has_the_verdict_on_it_and_what_spoke_for_it_then(log: EventLog) -> None:
    chain = links_of(log, log.run(), "car1")
    assert [(one.lower, one.verdict) for one in chain] == [
        ("v1", "validated"),
        ("w1", "open"),
        ("r1", "open"),
        ("v7", "refuted"),
        ("v8", "undecided"),
    ]
    last = chain[-1]
    assert (last.start_us, last.end_us, last.score_nats, last.margin_nats, last.runner_up) == (
        6 * S,
        None,
        6.0,
        1.0,
        "v9",
    )
    assert (chain[3].margin_nats, chain[3].reason) == (2.5, "refuted: ")


def test_a_chain_can_be_that_of_an_earlier_time(log: EventLog) -> None:
    below = links_below(log, "r1")
    assert [one.lower for one in chain_of(below, "car1", until_us=5 * S)] == ["v1", "w1", "r1", "v7"]
    assert chain_of(below, "car9") == []


def test_hidden_time_ends_with_the_link_that_stands(log: EventLog) -> None:
    assert list(hidden_times(links_of(log, log.run(), "car1"))) == [(2 * S, 6 * S)]


@pytest.mark.long
def test_hidden_time_of_a_log_that_does_not_tell_it_is_between_the_links(tmp_path: Path) -> None:
    older = [LinkRecord(one.t_us, one.kind, one.level, one.lower, one.upper) for one in LINKS if one.lower != "v7"]
    with open_log(write(tmp_path / "b.db", older)) as log:
        chain = links_of(log, log.run(), "car1")
        assert list(hidden_times(chain)) == [(2 * S, 6 * S)]
        assert {one.verdict for one in chain} == {"", "undecided"}


def test_vision_objects_of_several_sensors_overlap_and_hide_nothing(tmp_path: Path) -> None:
    links = [
        link(0, "established", "a1", "w1", "a1->w1#1"),
        link(0, "established", "w1", "car1", "w1->car1#2"),
        link(1 * S, "joined", "b1", "w1"),
        link(2 * S, "parted", "b1", "w1"),
        link(3 * S, "joined", "b2", "w1"),
        link(5 * S, "parted", "b2", "w1"),
        link(5 * S, "lost", "a1", "w1"),
        link(5 * S, "reestablished", "b2", "w1", "b2->w1#3"),
        link(7 * S, "lost", "b2", "w1"),
        link(9 * S, "reestablished", "a2", "w1", "a2->w1#4"),
    ]
    with open_log(write(tmp_path / "two.db", links, cars=["car1"])) as log:
        chain = links_of(log, log.run("r1"), "car1")
        told = [(one.lower, one.start_us // S, one.end_us and one.end_us // S) for one in chain if one.level == "world"]
        assert told == [("a1", 0, 5), ("b1", 1, 2), ("b2", 3, 5), ("b2", 5, 7), ("a2", 9, None)]
        assert [one.how for one in chain if one.lower == "b1"] == ["joined"]
        assert list(hidden_times(chain)) == [(7 * S, 9 * S)]
        assert identities(log, "r1")[0].vision_ids == ("a1", "b1", "b2", "a2")


def test_cars_are_told_with_how_sure_they_are(log: EventLog) -> None:
    one, two = identities(log, "r1")
    assert (one.car, one.vision_ids, one.hidden_us) == ("car1", ("v1", "v8"), 4 * S)
    assert (one.undecided, one.refuted, one.open) == (1, 1, 2)
    assert (two.car, two.vision_ids, two.hidden_us, two.refuted) == ("car2", ("v2",), 0, 0)


def test_objects_are_shown_as_tables_and_as_json(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert dyknow(["objects", url]) == 0
    heading, first, _ = capsys.readouterr().out.splitlines()
    assert heading.split() == [
        "car",
        "class",
        "first",
        "last",
        "vision",
        "objects",
        "hidden",
        "s",
        "undecided",
        "refuted",
        "open",
    ]
    assert first.split() == ["car1", "car", "00:00.000", "00:09.000", "v1", "v8", "4.00", "1", "1", "2"]
    assert dyknow(["objects", url, "car1"]) == 0
    assert "v8 -> w1    undecided  6.0    1.0     v9         4.00" in capsys.readouterr().out.splitlines()[-1]
    assert dyknow(["objects", url, "car1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["run"], told["car"], [one["lower"] for one in told["links"]]) == (
        "r1",
        "car1",
        ["v1", "w1", "r1", "v7", "v8"],
    )
    assert dyknow(["objects", url, "--json"]) == 0
    assert [one["car"] for one in json.loads(capsys.readouterr().out)["cars"]] == ["car1", "car2"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["car3"], "run 'r1': expected one of its 2 cars (car1, car2), got 'car3'; did you mean "),
        (["--run", "r9"], "expected a run 'r9', got ['r1']"),
    ],
)
def test_what_a_log_does_not_hold_is_refused_with_what_it_does(
    url: str, arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert dyknow(["objects", url, *arguments]) == 3
    assert told in capsys.readouterr().err


def test_a_log_without_cars_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert dyknow(["objects", write(tmp_path / "c.db", [], cars=())]) == 0
    assert capsys.readouterr().err == "note: run 'r1' of demo.mp4 has no cars\n"


def test_the_same_is_told_over_http(url: str, log: EventLog) -> None:
    with Client(create_app(url, shipped=())) as client:
        cars = client.get("/api/v1/cars?run=r1").json()
        assert (cars["run"], [one["car"] for one in cars["items"]]) == ("r1", ["car1", "car2"])
        links = client.get("/api/v1/cars/car1/links").json()
        assert [one["run"] for one in links["looked_at"]] == ["r1"]
        chain = links_of(log, log.run(), "car1")
        assert [(one["lower"], one["verdict"], one["margin_nats"]) for one in links["items"]] == [
            (one.lower, one.verdict, one.margin_nats) for one in chain
        ]
        schemas = client.get("/openapi.json").json()["components"]["schemas"]
        assert set(links["items"][0]) == set(schemas["IdentityLink"]["properties"])
        assert set(cars["items"][0]) == set(schemas["CarIdentity"]["properties"])
        for path, status in (
            ("cars/car3/links", 404),
            ("cars?run=r9", 404),
            ("cars?car=car1", 422),
        ):
            assert client.get(f"/api/v1/{path}").status_code == status, path
