"""How does a client hear of events as they are written? As server-sent events, row by row of the log, in their order.

Each client reads the log itself, from the sequence number that it knows, when it has taken what came before: nothing is
kept for it. One task looks whether there is a newer number, and wakes all.
"""

from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import Final, TypeVar

from anyio import CapacityLimiter, Event, move_on_after, sleep, to_thread
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from service.errors import CrowdedError, LogError, QueryError
from service.questions.events.queries import EventFilter, check_filter, find_last_seq, find_rows
from service.store.log import EventLog

MEDIA_TYPE: Final = "text/event-stream"
LOOKED_EVERY_S = 0.05
HEARTBEAT_S = 15.0  # proxies end what is silent for a minute, some for half of one
RETRY_MS = 2_000
MOST_STREAMS = 100
THREADS = 2  # of their own, so that a hundred streams hold up no other question

_Answer = TypeVar("_Answer")


class EventStream:
    """Streams the events of one log to those who ask for them.

    Attributes
    ----------
    count : of the streams that are open.
    """

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._limiter = CapacityLimiter(THREADS)
        self.count = 0
        self._is_open = True
        self._seq = 0
        self._news = Event()

    async def watch(self) -> None:
        """Look for new events as long as somebody wants to know; ends by being cancelled."""
        while True:
            await sleep(LOOKED_EVERY_S)
            try:
                seq = await self._ask(find_last_seq) if self.count else self._seq
            except LogError:  # it may be back soon
                continue
            if seq != self._seq:
                self._seq = seq
                self._wake()

    def close(self) -> None:
        """End all streams, each behind a whole event."""
        self._is_open = False
        self._wake()

    async def answer(self, wanted: EventFilter, after_seq: int | None) -> StreamingResponse:
        """Begin a stream.

        Parameters
        ----------
        wanted : its window and order change nothing.
        after_seq : the last number that the client knows; None for events that are not written yet.

        Raises
        ------
        QueryError
            If the filter is wrong, or the log has not come as far as that number.
        CrowdedError
            If there are as many streams as may be.
        """
        check_filter(wanted)
        last_seq = await self._ask(find_last_seq)
        if after_seq is not None and after_seq > last_seq:
            message = f"last_event_id: expected one up to {last_seq}, the newest of this log, got {after_seq}"
            raise QueryError(message, parameter="last_event_id")
        if self.count >= MOST_STREAMS:
            raise CrowdedError(f"stream: expected fewer than {MOST_STREAMS} at once, got one more; ask again later")
        self.count += 1
        return _Stream(self._blocks(wanted, last_seq if after_seq is None else after_seq), self._leave)

    async def _blocks(self, wanted: EventFilter, seq: int) -> AsyncIterator[bytes]:
        yield f"retry: {RETRY_MS}\nid: {seq}\n\n".encode()
        while self._is_open:
            news = self._news  # of what is written after this, whoever is waked hears
            try:
                found = await self._ask(partial(find_rows, wanted=wanted, after_seq=seq))
            except LogError:  # the client comes back, to the number that it knows
                return
            seq = found.until_seq
            text = "".join(f"id: {one}\nevent: {kind}\ndata: {body}\n\n" for one, kind, body in found.items)
            if text:
                yield text.encode()
            if seq < found.as_of_seq:
                continue
            with move_on_after(HEARTBEAT_S):
                await news.wait()
            if not news.is_set():
                yield f": nothing new\nid: {seq}\n\n".encode()

    async def _ask(self, question: Callable[[EventLog], _Answer]) -> _Answer:
        return await to_thread.run_sync(question, self._log, limiter=self._limiter)

    def _wake(self) -> None:
        self._news.set()
        self._news = Event()

    def _leave(self) -> None:
        self.count -= 1


class _Stream(StreamingResponse):
    """A response that tells when it is over, even if it never began."""

    def __init__(self, blocks: AsyncIterator[bytes], on_end: Callable[[], None]) -> None:
        # The last one is for nginx, which would wait for more.
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(blocks, headers=headers, media_type=MEDIA_TYPE)
        self._on_end = on_end

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._on_end()
