"""Is a page of events sent again when it has changed, and only then?"""

from collections.abc import Callable

import pytest

from service.api.app import create_app
from service.store.log import open_log
from service.store.upkeep import prune
from tests.service.conftest import NewLog
from tests.service.http import Client
from tests.service.logs import START_UTC_US, overtake, run, write_log

EVENTS = "/api/v1/events"
DAY_US = 86_400_000_000


def repeat_without_events(url: str) -> None:
    write_log(url, [])


def remove_old_events(url: str) -> None:
    with open_log(url, "w") as log:
        assert prune(log, {"events": DAY_US}, START_UTC_US + 2 * DAY_US)[0].rows == 1


def write_one_more(url: str) -> None:
    write_log(url, [overtake(5)], record=run("r2"))


@pytest.mark.parametrize("change", [write_one_more, remove_old_events, repeat_without_events])
def test_a_page_is_sent_again_when_it_has_changed(new_log: NewLog, change: Callable[[str], None]) -> None:
    url = write_log(new_log(), [overtake()], record=run(start_from="site"))
    with Client(create_app(url, shipped=())) as client:
        page = client.get(EVENTS)
        assert page.headers["cache-control"] == "private, no-cache"
        asked = {"If-None-Match": f'W/"other", {page.headers["etag"]}'}
        same = client.get(EVENTS, headers=asked)
        assert (same.status_code, same.content, same.headers["etag"]) == (304, b"", page.headers["etag"])
        assert same.headers["cache-control"] == page.headers["cache-control"]
        change(url)
        changed = client.get(EVENTS, headers=asked)
        assert changed.status_code == 200
        assert changed.json()["items"] != page.json()["items"]
