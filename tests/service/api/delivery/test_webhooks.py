"""Is each event posted, signed, in order, and never lost, whatever the receiver answers and whoever is restarted?"""

import base64
import hashlib
import hmac
import re
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any  # JSON

import msgspec
import pytest

from service.api.app import create_app
from service.api.delivery.webhooks import Webhook, delivering, load_webhooks
from service.cli.app import run as run_cli
from service.errors import SiteError
from service.store.databases.sqlite_file import SqliteFile
from service.store.log import open_log
from service.store.registers.deliveries import Deliveries
from tests.contracts.tables import page
from tests.service.conftest import NewLog
from tests.service.http import Client
from tests.service.logs import overtake, run, write_log
from tests.service.runs.jobs.test_jobs import until
from tests.service.runs.jobs.test_supervision import SERVE
from tests.service.store.databases.test_databases import end_all_connections

ADDRESS = "expected an address, https://HOST/... or http://HOST/..."
SECRET = "whsec_" + base64.b64encode(b"a key of the office").decode()


class Receiver:
    """A program that is told; `answers` is asked for the status of each post, by how many came before."""

    def __init__(self) -> None:
        self.posts: list[tuple[dict[str, str], bytes]] = []
        self.answers: Callable[[int], int] = lambda _: 204
        self.url = ""

    @property
    def seqs(self) -> list[int]:
        """Of what was taken, in the order in which it came."""
        taken = [body for at, (_, body) in enumerate(self.posts) if self.answers(at) == 204]
        return [msgspec.json.decode(body)["seq"] for body in taken]


@pytest.fixture
def receiver(monkeypatch: pytest.MonkeyPatch) -> Iterator[Receiver]:
    monkeypatch.setenv("OFFICE_SECRET", SECRET)
    monkeypatch.setattr("service.api.delivery.webhooks.FIRST_PAUSE_S", 0.001)
    monkeypatch.setattr("service.api.delivery.webhooks.TRIED_AGAIN_S", 0.01)
    monkeypatch.setattr("service.api.delivery.webhooks.LOOKED_EVERY_S", 0.01)
    told = Receiver()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            told.posts.append((dict(self.headers), self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(told.answers(len(told.posts) - 1))
            self.end_headers()

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever).start()
        told.url = f"http://127.0.0.1:{server.server_port}/hook?of=office"
        yield told
        server.shutdown()


@contextmanager
def told(log: str, receiver: Receiver, **fields: Any) -> Iterator[list[str]]:
    """Deliver the events of a log from its first one on; give what is said."""
    said: list[str] = []
    webhook = Webhook(name="office", url=receiver.url, secret_env="OFFICE_SECRET", **fields)
    with delivering([webhook], log, said.append):
        yield said


def test_events_are_posted_in_order_and_signed(new_log: NewLog, receiver: Receiver) -> None:
    log = write_log(new_log(), [overtake(0), overtake(1, type="pass"), overtake(2)])
    with told(log, receiver, events="type=overtake&last_event_id=0"):
        until(lambda: len(receiver.posts) == 2)
        write_log(log, [overtake(3)], record=run("r2"))
        until(lambda: len(receiver.posts) == 3)
    assert receiver.seqs == [1, 3, 4]
    headers, body = receiver.posts[0]
    assert headers["webhook-id"] == "r1-1-1"
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    wanted = base64.b64encode(hmac.digest(b"a key of the office", signed, hashlib.sha256)).decode()
    assert headers["webhook-signature"] == f"v1,{wanted}"


def test_what_fails_is_posted_again_before_what_comes_after(new_log: NewLog, receiver: Receiver) -> None:
    receiver.answers = lambda at: 204 if at % 3 == 2 else (500, 302)[at % 2]
    log = write_log(new_log(), [overtake(start_us) for start_us in range(4)])
    with told(log, receiver, events="last_event_id=0"):
        until(lambda: len(receiver.posts) == 12)
    assert receiver.seqs == [1, 2, 3, 4]
    assert [headers["webhook-id"] for headers, _ in receiver.posts[:4]] == ["r1-1-1"] * 3 + ["r1-2-2"]


def test_a_restart_goes_on_where_it_was_and_a_new_webhook_begins_now(new_log: NewLog, receiver: Receiver) -> None:
    log = write_log(new_log(), [overtake(0)])
    for number in range(2, 5):
        with told(log, receiver):
            until(lambda: bool(states(log)))
            until(lambda: states(log)[0][1] >= number - 1)  # noqa: B023  # it is asked for at once
        write_log(log, [overtake(number)], record=run(f"r{number}"))
    with told(log, receiver):
        until(lambda: len(receiver.posts) == 3)
    assert receiver.seqs == [2, 3, 4]


@pytest.mark.slow
def test_a_server_that_is_killed_amid_a_delivery_repeats_that_event_alone(
    new_log: NewLog, receiver: Receiver, tmp_path: Path
) -> None:
    log, path = write_log(new_log(), [overtake(start_us) for start_us in range(4)]), tmp_path / "webhooks.toml"
    path.write_text(declared(url=receiver.url, events="last_event_id=0"))
    command, kills = [*SERVE, log, "--workers", "0", "--webhooks", str(path)], {2, 4}  # the last one too

    def answer(at: int) -> int:
        """Take an event; the server is gone before it hears of some."""
        seq = msgspec.json.decode(receiver.posts[at][1])["seq"]
        if seq in kills:
            kills.remove(seq)
            server.kill()
            server.wait()
        return 204

    receiver.answers = answer
    while states(log) != [("office", 4, "")]:
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as server:
            until(lambda: server.poll() is not None or states(log) == [("office", 4, "")])
            server.kill()
    assert receiver.seqs == [1, 2, 2, 3, 4, 4]


def states(log: str) -> list[tuple[str, int, str]]:
    with open_log(log) as opened:
        deliveries = Deliveries(opened)
        return [(one.name, one.seq, one.message) for one in deliveries.states()]


def test_what_is_given_up_is_listed_and_tried_once_more(
    new_log: NewLog, receiver: Receiver, capsys: pytest.CaptureFixture[str]
) -> None:
    receiver.answers = lambda at: 500 if at < 4 else 204
    log = write_log(new_log(), [overtake(0), overtake(1)])
    with told(log, receiver, events="last_event_id=0", attempts=2) as said:
        until(lambda: states(log) == [("office", 2, "")])
        assert said == [
            f"webhook office: event {seq} is given up: expected an answer 2xx, got 500 Internal Server Error"
            for seq in (1, 2)
        ]
        assert run_cli(["webhooks", "list", log]) == 0
        listed = [re.split(r" {2,}", line)[:3] for line in capsys.readouterr().out.splitlines()[1:]]
        assert listed == [["office", "delivered up to", "2"], ["office", "given up", "1"], ["office", "given up", "2"]]
        assert run_cli(["webhooks", "retry", log, "office"]) == 0
        assert capsys.readouterr().out == "2 events of office will be tried again\n"
        until(lambda: len(receiver.posts) == 6)
    assert receiver.seqs == [1, 2]
    assert run_cli(["webhooks", "list", log, "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out) == {
        "items": [{"name": "office", "seq": 2, "message": ""}],
        "undelivered": [],
    }
    assert run_cli(["webhooks", "retry", log, "nobody"]) == 3
    assert "expected one of its webhooks, ['office'], got 'nobody'" in capsys.readouterr().err


def test_over_http_the_same_is_told_and_tried_once_more(
    new_log: NewLog, receiver: Receiver, capsys: pytest.CaptureFixture[str]
) -> None:
    receiver.answers = lambda _: 500
    log = write_log(new_log(), [overtake(0), overtake(1)])
    with told(log, receiver, events="last_event_id=0", attempts=1):
        until(lambda: states(log) == [("office", 2, "")])
    with Client(create_app(log)) as client:
        path = "/api/v1/webhooks"
        assert [one["seq"] for one in client.get(path).json()["undelivered"]] == [1, 2]
        assert run_cli(["webhooks", "list", log, "--json"]) == 0
        assert client.get(path).json() == msgspec.json.decode(capsys.readouterr().out)
        assert client.request("POST", f"{path}/office/retry").json() == {"webhook": "office", "due": 2}
        assert [one["is_due"] for one in client.get(path).json()["undelivered"]] == [True, True]
        assert client.request("POST", f"{path}/nobody/retry").status_code == 404


def test_of_several_servers_one_delivers(new_log: NewLog, receiver: Receiver) -> None:
    log = write_log(new_log(), [overtake(start_us) for start_us in range(20)])
    with told(log, receiver, events="last_event_id=0"), told(log, receiver, events="last_event_id=0") as said:
        until(lambda: len(receiver.posts) >= 20)
        until(lambda: states(log)[0][1] == 20)
    assert receiver.seqs == list(range(1, 21))
    assert said == []


@pytest.mark.long
def test_of_several_servers_one_delivers_after_a_restart_of_the_database(postgres: NewLog, receiver: Receiver) -> None:
    log = write_log(postgres(), [overtake(0)])

    def is_told(number: int) -> bool:
        return len(receiver.posts) >= number and states(log)[0][1] >= number

    with told(log, receiver, events="last_event_id=0"), told(log, receiver, events="last_event_id=0"):
        for number in range(1, 12):
            until(partial(is_told, number))
            end_all_connections(log)
            write_log(log, [overtake(number)], record=run(f"r{number}"))
        until(lambda: len(receiver.posts) >= 12)
    assert receiver.seqs == list(range(1, 13))


def test_nobody_who_listens_is_told_of_with_the_reason(new_log: NewLog, receiver: Receiver) -> None:
    receiver.url = "http://127.0.0.1:1/"
    log = write_log(new_log(), [overtake(0)])
    with told(log, receiver, events="last_event_id=0", attempts=100):
        until(lambda: any(" at 1: expected an answer, got Conn" in message for *_, message in states(log)))


def declared(**fields: object) -> str:
    lines = {"name": "office", "url": "https://example.org/hook", "secret_env": "OFFICE_SECRET"} | fields
    return "[[webhook]]\n" + "".join(f"{name} = {value!r}\n" for name, value in lines.items() if value is not None)


def test_a_file_declares_webhooks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OFFICE_SECRET", "plain words")
    path = tmp_path / "webhooks.toml"
    path.write_text(declared(events="type=overtake") + declared(name="police", attempts=3))
    office, police = load_webhooks(path)
    assert (office.asked[0].types, office.secret, police.attempts) == (("overtake",), b"plain words", 3)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "webhook: expected tables [[webhook]], got no such field"),
        (declared(name="a b"), "webhook[1].name: expected up to 64 letters, digits, '.', '_', '-', got 'a b'"),
        (declared() + declared(), "webhook[2].name: expected names that differ, got 'office' twice"),
        (declared(url="ftp://a"), f"webhook[1].url: {ADDRESS}, got 'ftp://a'"),
        (declared(url="http://a:b"), f"webhook[1].url: {ADDRESS}, got 'http://a:b'"),
        (declared(url=None), f"webhook[1].url: {ADDRESS}, got no such field"),
        (declared(events="typ=pass"), "webhook[1].events: query: expected type, actor,"),
        (declared(events="min_confidence=2"), "webhook[1].events: min_confidence: expected 0 to 1, got '2'"),
        (declared(secret_env="NOBODY_SET"), "webhook[1].secret_env: expected NOBODY_SET in the environment"),
        (declared(secret_env="BAD_SECRET"), "webhook[1].secret_env: expected BAD_SECRET in the environment"),
        (declared(secret="x"), "webhook[1].secret: expected one of name, url, secret_env, events, attempts;"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused_with_the_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, told: str
) -> None:
    monkeypatch.setenv("OFFICE_SECRET", "x")
    monkeypatch.setenv("BAD_SECRET", "whsec_!")
    path = tmp_path / "webhooks.toml"
    path.write_text(text)
    with pytest.raises(SiteError) as refused:
        load_webhooks(path)
    assert str(refused.value).startswith(f"{path}: {told}")


def test_the_file_of_the_page_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (shown,) = re.findall(r"((?: {4}.*\n)*? {4}\[\[webhook\]\]\n(?: {4}.*\n)+)", page("http.md"))
    for variable in re.findall(r'secret_env = "(\w+)"', shown):
        monkeypatch.setenv(variable, "x")
    path = tmp_path / "webhooks.toml"
    path.write_text(shown)
    assert [one.name for one in load_webhooks(path)] == ["office"]


def test_a_log_that_cannot_be_written_has_no_webhooks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OFFICE_SECRET", "x")
    log, path = write_log(tmp_path / "a.db", []), tmp_path / "webhooks.toml"
    path.write_text(declared())
    monkeypatch.setattr(SqliteFile, "can_write", lambda _: False)
    assert run_cli(["serve", log, "--port", "0", "--webhooks", str(path)]) == 3
    assert "expected one that can be written, as it keeps how far webhooks are" in capsys.readouterr().err
