"""How do other programs hear of events without asking? Each is posted to them, signed, in order and at least once.

A webhook is declared in a file; a thread of the server reads the rows of the log behind those that were delivered, and
notes in the log how far it is (`service.store.registers.deliveries`). What is posted follows Standard Webhooks 1.0
(standardwebhooks.com), so that receivers find libraries that check the signature.
"""

import base64
import hashlib
import hmac
import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from typing import Annotated
from urllib.parse import parse_qsl, urlsplit, urlunsplit

import msgspec
from msgspec import Meta, Struct

from service.api.messages.parameters import read_stream_question
from service.errors import LogError, QueryError, RunBusyError
from service.questions.events.queries import EventFilter, check_filter, find_rows
from service.runs.jobs.worker import Tell
from service.store.databases.database import Lock
from service.store.databases.location import database_of
from service.store.entries import Undelivered, WebhookState
from service.store.log import EventLog, open_log
from service.store.registers.deliveries import Deliveries
from service.texts.toml_tables import Text, read_toml, wrong

FIRST_PAUSE_S, MOST_PAUSE_S = 1.0, 300.0
LOOKED_EVERY_S = 0.5
TRIED_AGAIN_S = 10.0  # where another server delivers, or the log cannot be read
ANSWERED_WITHIN_S = 10.0
_SECRET = "whsec_"
_URL = r"^https?://(\[[0-9A-Fa-f:]+\]|[^\s/?#@:\[\]]+)(:[0-9]{1,5})?([/?][^\s#]*)?$"


class Webhook(Struct, frozen=True, kw_only=True):
    """A webhook as its file declares it.

    Attributes
    ----------
    name : by which the log knows how far it is.
    secret_env : the variable of the environment with the secret; one that begins with `whsec_` is base64 from there on.
    events : which ones, and behind which number a new webhook begins, as the query of a stream over HTTP.
    attempts : after so many an event is given up.
    """

    name: Annotated[str, Meta(pattern=r"^[A-Za-z0-9._-]{1,64}$", description="up to 64 letters, digits, '.', '_', '-'")]
    url: Annotated[str, Meta(pattern=_URL, description="an address, https://HOST/... or http://HOST/...")]
    secret_env: Text
    events: str = ""
    attempts: Annotated[int, Meta(ge=1, le=100)] = 8

    @property
    def asked(self) -> tuple[EventFilter, int | None]:
        """Which events it is told of, and behind which number it begins; raises a `QueryError` if that is wrong."""
        wanted, after_seq = read_stream_question(parse_qsl(self.events, keep_blank_values=True), None)
        check_filter(wanted)
        return wanted, after_seq

    @property
    def secret(self) -> bytes:
        """The key of its signatures; raises a `ValueError` if the environment has none."""
        text = os.environ.get(self.secret_env, "")
        key = base64.b64decode(text.removeprefix(_SECRET), validate=True) if text.startswith(_SECRET) else text.encode()
        if not key:
            raise ValueError("nothing")
        return key


class _WebhookFile(Struct):
    webhook: Annotated[list[Webhook], Meta(description="tables [[webhook]]")]


def load_webhooks(path: Path) -> list[Webhook]:
    """Read a file of webhooks.

    Raises
    ------
    SiteError
        If the file is missing, or a field is missing, wrong or unknown, with its place.
    """
    webhooks = read_toml(path, _WebhookFile, what="a file of webhooks").webhook
    for number, one in enumerate(webhooks, start=1):
        place = f"webhook[{number}]"
        if one.name in [other.name for other in webhooks[: number - 1]]:
            raise wrong(path, f"{place}.name", f"expected names that differ, got {one.name!r} twice")
        try:
            _ = one.asked, one.secret
        except QueryError as error:
            raise wrong(path, f"{place}.events", error) from error
        except ValueError as error:
            expected = f"expected {one.secret_env} in the environment, a text, or base64 behind {_SECRET!r}"
            raise wrong(path, f"{place}.secret_env", f"{expected}, got {error}") from error
    return webhooks


@contextmanager
def delivering(webhooks: Sequence[Webhook], log_url: str, tell: Tell) -> Iterator[None]:
    """Deliver the events of a log while in the `with` block.

    Parameters
    ----------
    tell : gets a line when an event is given up, or the log cannot be used.
    """
    ended = threading.Event()
    threads = [threading.Thread(target=_deliver, args=(one, log_url, ended, tell), daemon=True) for one in webhooks]
    for one in threads:
        one.start()
    try:
        yield
    finally:
        ended.set()
        for one in threads:
            one.join(ANSWERED_WITHIN_S)


def _deliver(webhook: Webhook, log_url: str, ended: threading.Event, tell: Tell) -> None:
    """Deliver until the end, if no other server does."""
    database = database_of(log_url)
    while not ended.is_set():
        try:
            with ExitStack() as stack:
                lock = database.lock(f"webhook-{webhook.name}")
                stack.callback(lock.release)
                log = stack.enter_context(open_log(log_url))
                _Delivery(webhook, Deliveries(log), lock, ended, tell).run(log)
        except LogError as error:
            if not isinstance(error, RunBusyError):
                tell(f"webhook {webhook.name}: {error}")
            ended.wait(TRIED_AGAIN_S)


class _Delivery:
    def __init__(
        self, webhook: Webhook, deliveries: Deliveries, lock: Lock, ended: threading.Event, tell: Tell
    ) -> None:
        self._webhook, self._deliveries, self._lock = webhook, deliveries, lock
        self._ended, self._tell = ended, tell
        self._wanted, first_seq = webhook.asked
        self._seq = deliveries.begin(webhook.name, first_seq)  # all up to it is delivered, given up, or not wanted

    def run(self, log: EventLog) -> None:
        """Deliver row by row, and in between what is to be tried once more, as long as no other server does."""
        while not self._ended.is_set() and self._lock.is_held():
            for one in self._deliveries.undelivered(due_for=self._webhook.name):
                self._deliveries.settle(one, post(self._webhook, one.seq, one.body))
            rows = find_rows(log, self._wanted, self._seq)
            if not all(self._settle(seq, body) for seq, _, body in rows.items):
                return
            self._seq = rows.until_seq
            if self._seq == rows.as_of_seq:
                self._ended.wait(LOOKED_EVERY_S)

    def _settle(self, seq: int, body: str) -> bool:
        """Deliver one event or give it up; False if the end came before, or another server."""
        name, pause_s, message = self._webhook.name, 0.0, ""
        for attempt in range(1, self._webhook.attempts + 1):
            if self._ended.wait(pause_s) or not self._lock.is_held():
                return False
            message = post(self._webhook, seq, body)
            if not message:
                break
            self._deliveries.note(WebhookState(name, self._seq, f"attempt {attempt} at {seq}: {message}"))
            pause_s = min(max(2 * pause_s, FIRST_PAUSE_S), MOST_PAUSE_S)
        if message:
            self._tell(f"webhook {name}: event {seq} is given up: {message}")
        self._deliveries.note(WebhookState(name, seq), Undelivered(name, seq, body, message) if message else None)
        self._seq = seq
        return True


def post(webhook: Webhook, seq: int, body: str) -> str:
    """Post one event; say what went wrong, in words, or nothing."""
    message_id, now_s = f"{msgspec.json.decode(body)['id']}-{seq}", str(int(time.time()))
    signed = f"{message_id}.{now_s}.{body}".encode()
    signature = base64.b64encode(hmac.digest(webhook.secret, signed, hashlib.sha256)).decode()
    headers = {"Content-Type": "application/json", "webhook-id": message_id, "webhook-timestamp": now_s}
    headers["webhook-signature"] = f"v1,{signature}"
    url = urlsplit(webhook.url)
    kind = HTTPSConnection if url.scheme == "https" else HTTPConnection
    connection = kind(url.netloc, timeout=ANSWERED_WITHIN_S)
    try:
        connection.request("POST", urlunsplit(("", "", url.path or "/", url.query, "")), body.encode(), headers)
        answer = connection.getresponse()
        # One that leads elsewhere is a wrong address: nobody signed for where it leads to.
        return "" if answer.status // 100 == 2 else f"expected an answer 2xx, got {answer.status} {answer.reason}"
    except (OSError, OverflowError, HTTPException) as error:
        return f"expected an answer, got {error!r}"
    finally:
        connection.close()
