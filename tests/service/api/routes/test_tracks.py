"""Do cars come as columns, of the window and the step that were asked for?"""

from collections.abc import Iterator

import msgspec
import pytest

from service.api.app import create_app
from service.api.messages.bodies import Tracks
from service.questions.observations.car_tracks import CarColumns
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, run, state


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """Two cars for ten seconds, five times a second."""
    url = str(tmp_path_factory.mktemp("tracks") / "a.db")
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        for t_us in range(0, 10 * SECOND_US, SECOND_US // 5):
            writer.append_frames([t_us])
            writer.append_states([state(t_us, "car3", t_us / 1e6), state(t_us, "car7", linked=t_us < SECOND_US)])
        writer.finish("finished")
    with Client(create_app(url, shipped=())) as client:
        yield client


def columns(client: Client, path: str) -> CarColumns:
    answer = client.get(f"/api/v1/{path}")
    assert answer.status_code == 200, answer.text
    return msgspec.json.decode(answer.content, type=Tracks).columns


def test_columns_are_the_states_of_the_log(client: Client) -> None:
    found = columns(client, "tracks?from=0&to=1.3s")
    assert found.car == ["car3", "car7"] * 7
    assert found.t_us[::2] == list(range(0, 1_300_000, 200_000))
    assert found.x_m[::2] == [0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2]
    assert found.linked[1::2] == [True] * 5 + [False] * 2


def test_a_step_takes_the_first_state_of_each_car_in_it(client: Client) -> None:
    found = columns(client, "tracks?from=1.5s&to=4s&step_us=1000000")
    assert list(zip(found.t_us, found.car, strict=True)) == [
        (t_us, car) for t_us in (1_600_000, 2_000_000, 3_000_000) for car in ("car3", "car7")
    ]


def test_a_trajectory_is_of_one_car_for_its_life(client: Client) -> None:
    found = columns(client, "cars/car3/trajectory")
    assert (set(found.car), len(found.t_us)) == ({"car3"}, 50)
    assert columns(client, "cars/car3/trajectory?from=9s").t_us == list(range(9 * SECOND_US, 10 * SECOND_US, 200_000))


@pytest.mark.parametrize(
    ("path", "status", "told"),
    [
        ("cars/car33/trajectory", 404, "expected one of its 2 cars"),
        ("cars/car3/trajectory?run=r9", 404, "expected a run 'r9'"),
        ("cars/car3/trajectory?from=5s&to=5s", 400, "from: expected a time before 'to'"),
        ("cars/car3/trajectory?step_us=0", 422, "step_us: expected greater than or equal to 1, got '0'"),
        ("tracks?from=1s", 422, "to: expected a value, got none"),
        ("tracks?from=1s&to=61.1s", 400, "to: expected at most 60000000 us after 'from', got 60100000 us"),
        ("tracks?from=2s&to=1s", 400, "from: expected a time before 'to'"),
    ],
)
def test_a_wrong_question_is_refused(client: Client, path: str, status: int, told: str) -> None:
    answer = client.get(f"/api/v1/{path}")
    assert (answer.status_code, told in answer.json()["detail"]) == (status, True)


def test_too_many_states_are_refused(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.questions.observations.car_tracks.MOST_STATES", 49)
    assert client.get("/api/v1/cars/car3/trajectory").json()["errors"][0]["parameter"] == "step_us"
    assert client.get("/api/v1/cars/car3/trajectory?step_us=400000").status_code == 200
