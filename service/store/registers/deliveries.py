"""How far is each webhook of a log, and what could not be delivered? Kept in the log, so a restart goes on there."""

from msgspec.structs import astuple
from sqlalchemy import delete, select, update

from service.errors import NotInLogError
from service.store import schema
from service.store.entries import Undelivered, WebhookState
from service.store.log import EventLog
from service.store.writer import insert_rows, lock_seqs

_WEBHOOKS, _UNDELIVERED = schema.webhooks.c, schema.undelivered.c


class Deliveries:
    """The deliveries of one log, open as long as they are asked for."""

    def __init__(self, log: EventLog) -> None:
        self._log = log

    def begin(self, name: str, after_seq: int | None) -> int:
        """Give the number up to which a webhook is; a new one begins behind `after_seq`, or from now on."""
        with self._log.change() as connection:
            last_seq = lock_seqs(connection)
            seq = connection.scalar(select(_WEBHOOKS.seq).where(_WEBHOOKS.name == name))
            if seq is None:
                seq = last_seq if after_seq is None else min(after_seq, last_seq)
                insert_rows(connection, schema.webhooks, [(name, seq, "")])
            return int(seq)

    def note(self, state: WebhookState, given_up: Undelivered | None = None) -> None:
        """Note how far a webhook is, and with it an event that was given up."""
        values = {"seq": state.seq, "message": state.message}
        with self._log.change() as connection:
            connection.execute(update(schema.webhooks).where(_WEBHOOKS.name == state.name).values(values))
            insert_rows(connection, schema.undelivered, [astuple(given_up)] if given_up else [])

    def settle(self, one: Undelivered, message: str) -> None:
        """Note what came of one more attempt; with no message it was delivered, and is forgotten."""
        is_it = (_UNDELIVERED.webhook == one.webhook) & (_UNDELIVERED.seq == one.seq)
        again = update(schema.undelivered).where(is_it).values(message=message, is_due=False)
        with self._log.change() as connection:
            connection.execute(again if message else delete(schema.undelivered).where(is_it))

    def retry(self, name: str) -> int:
        """Let what was given up of a webhook be tried once more; return how many events that are.

        Raises
        ------
        NotInLogError
            If the log knows no such webhook.
        """
        names = [one.name for one in self.states()]
        if name not in names:
            raise NotInLogError(f"log {self._log.place.name!r}: expected one of its webhooks, {names}, got {name!r}")
        with self._log.change() as connection:
            of_it = _UNDELIVERED.webhook == name
            return connection.execute(update(schema.undelivered).where(of_it).values(is_due=True)).rowcount

    def states(self) -> list[WebhookState]:
        """List the webhooks by name."""
        return self._log.rows(WebhookState, select(schema.webhooks).order_by(_WEBHOOKS.name))

    def undelivered(self, *, due_for: str | None = None) -> list[Undelivered]:
        """List what was given up, by webhook and in the order of writing; or of one what is to be tried once more."""
        query = select(schema.undelivered).order_by(_UNDELIVERED.webhook, _UNDELIVERED.seq)
        if due_for is not None:
            query = query.where(_UNDELIVERED.webhook == due_for, _UNDELIVERED.is_due)
        return self._log.rows(Undelivered, query)
