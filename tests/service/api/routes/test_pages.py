"""Is a page the same, whether it is answered at once, by a thread, or out of what is kept?"""

from collections.abc import Iterator

import pytest

from service.api.app import create_app
from service.api.routes.events import MOST_KEPT
from service.errors import LogError
from service.questions.events.sql_text import values_of
from service.store.log import EventLog, open_log
from tests.service.conftest import NewLog
from tests.service.http import Client
from tests.service.logs import overtake, write_log

QUERIES = (
    "",
    "type=overtake&type=pass&limit=3",
    "actor=car7&from=00:02&order=-start",
    "as_of=4&limit=2",
    "count=exact&limit=1",
    "type=overtaking",
    "road=rode1",
    "from=10:00",
    "road=road1&role.overtaker=car7",
)
LONG = "SELECT count(*) FROM events AS one, events AS other"


def asked(client: Client, query: str) -> tuple[int, bytes, dict[str, str]]:
    answer = client.get(f"/api/v1/events?{query}")
    own = ("x-request-id",)
    return answer.status_code, answer.content, {k: v for k, v in answer.headers.items() if k not in own}


@pytest.fixture(scope="module")
def url(new_log: NewLog) -> str:
    return write_log(new_log(), [overtake(start_s) for start_s in range(6)])


@pytest.fixture(scope="module")
def slow(url: str) -> Iterator[Client]:
    """Give a client of an application that answers by threads alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(EventLog, "hasty", lambda _: None)
        app = create_app(url, shipped=())
    with Client(app) as opened:
        yield opened


@pytest.mark.parametrize("query", QUERIES)
def test_a_page_is_the_same_at_once_kept_and_by_a_thread(url: str, slow: Client, query: str) -> None:
    with Client(create_app(url, shipped=())) as client:
        first, second, kept = (asked(client, query) for _ in range(3))  # by the first one coverage is known
    assert first == second == kept == asked(slow, query)
    assert first[0] == 200


def test_more_pages_are_asked_for_than_are_kept(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()])
    with Client(create_app(url, shipped=())) as client:
        for limit in [*range(1, 2 * MOST_KEPT), 1]:
            assert len(client.get(f"/api/v1/events?limit={limit}").json()["items"]) == 1


def test_what_takes_long_is_given_up_at_once_and_answered_by_a_thread(
    new_log: NewLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = write_log(new_log(), [overtake(start_s) for start_s in range(500)])
    monkeypatch.setattr("service.store.log.HASTY_S", -1.0)
    with open_log(url) as log:
        hasty = log.hasty()
        if hasty is not None:
            with hasty.connect() as connection, pytest.raises(Exception, match="interrupted"):
                values_of(connection, LONG)
            with pytest.raises(LogError, match="expected an answer at once, got 'interrupted'"), hasty.connect() as one:
                values_of(one, LONG)
    with Client(create_app(url, shipped=())) as client:
        for _ in range(2):
            assert len(client.get("/api/v1/events?limit=1000").json()["items"]) == 500
