"""Which events are there? They are sent as the text that is stored: nothing is decoded on the way."""

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache, partial
from typing import Annotated, NamedTuple
from urllib.parse import parse_qsl
from zlib import crc32

import msgspec
from anyio import to_thread
from fastapi import APIRouter, HTTPException, Query, Request
from starlette.responses import Response, StreamingResponse

from service.api.delivery.event_stream import MEDIA_TYPE as EVENT_STREAM
from service.api.delivery.event_stream import EventStream
from service.api.messages.answers import answers, file_answers, json_answer, link_to_next
from service.api.messages.asked import GEOJSON, NoParameters
from service.api.messages.bodies import EventList, EventSummary
from service.api.messages.parameters import (
    EventQuery,
    ExportQuery,
    StreamQuery,
    SummaryQuery,
    read_query,
    read_stream_question,
    taking,
)
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import summary
from service.errors import LogError
from service.export.events import exported
from service.questions.events.notes import name_notes, run_notes
from service.questions.events.queries import find_event, find_events
from service.questions.events.summaries import count_events
from service.questions.observations.coverage import Coverage
from service.records.events import EventRecord
from service.store.log import EventLog, HastyLog

MOST_KEPT = 32

_PATH = "/api/v1/events"
_MEDIA_TYPES = {
    "jsonl": "application/jsonl", "csv": "text/csv", "vtt": "text/vtt", "geojson": GEOJSON, "ocel": "application/json",
    "openlabel": "application/json", "parquet": "application/vnd.apache.parquet",
}  # fmt: skip
_EXPORTED = file_answers(_MEDIA_TYPES.values(), 400, 404, 422, 501)


def add_events(router: APIRouter, log: EventLog, stream: EventStream, coverage: Coverage, pool: ProcessPool) -> None:
    """Add the routes about events.

    Parameters
    ----------
    stream, coverage, pool : of the same log.
    """
    _add_page(router, log, coverage)
    _add_stream(router, stream)
    _add_summary(router, pool)
    _add_export(router, log)
    _add_event(router, log)  # last, as `{event_id}` fits the paths above too


def _add_page(router: APIRouter, log: EventLog, coverage: Coverage) -> None:
    hasty = log.hasty()
    kept = _KeptPages(hasty, coverage) if hasty else None

    @router.get("/events", name="events", responses=answers(EventList, 400, 422), openapi_extra=taking(EventQuery))
    async def list_events(request: Request) -> Response:
        """List events, one page of those that were asked for.

        Repeated parameters are alternatives; different parameters must all hold.
        """
        query = request.scope["query_string"].decode("latin-1")
        page = kept.find(query) if kept else None
        if page is None:  # it takes long
            page = await to_thread.run_sync(_made, log, coverage, query)
        return _sent(page, request)


class _Page(NamedTuple):
    body: bytes
    headers: Mapping[str, str]


class _KeptPages:
    """Pages that were asked for since the log changed, or it was last looked at for coverage; for a second at most."""

    def __init__(self, log: HastyLog, coverage: Coverage) -> None:
        self._log, self._coverage = log, coverage
        self._state = 0, 0.0
        self._made = lru_cache(MOST_KEPT)(partial(_made, log, coverage))

    def find(self, query: str) -> _Page | None:
        """Give a page; None if it takes long."""
        if not self._coverage.is_fresh:
            return None
        with suppress(LogError):
            state = self._log.version(), self._coverage.looked_s
            if state != self._state:
                self._made.cache_clear()
                self._state = state
            return self._made(query)
        return None


def _made(log: EventLog, coverage: Coverage, query: str) -> _Page:
    pairs = parse_qsl(query, keep_blank_values=True)
    asked, wanted = read_query(pairs, EventQuery)
    page = find_events(log, wanted, limit=asked.limit, cursor=asked.cursor)
    told: dict[str, object] = {"looked_at": coverage.beside(wanted)}
    if asked.count == "exact":
        told["count"] = count_events(log, wanted)
    # What is told of an older state does not change.
    if not page.lines and asked.cursor is None and wanted.as_of is None:
        if isinstance(log, HastyLog):
            raise LogError(f"log {log.place.name!r}: expected an answer at once, got notes, which read much of it")
        notes = (*name_notes([log], wanted), *run_notes([log], wanted))
        told |= {"notes": notes} if notes else {}
    beside = {"next_cursor": page.next_cursor, "as_of_seq": page.as_of_seq, **told}
    body = b'{"items":[%b],%b' % (page.lines.replace("\n", ",").encode(), msgspec.json.encode(beside)[1:])
    # To be kept, and asked for each time.
    headers = {"ETag": f'W/"{crc32(body):x}-{len(body):x}"', "Cache-Control": "private, no-cache"}
    return _Page(body, headers | link_to_next(_PATH, pairs, page.next_cursor))


def _sent(page: _Page, request: Request) -> Response:
    """Answer with a page, or that the client has it."""
    if page.headers["ETag"] in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers={name: page.headers[name] for name in ("ETag", "Cache-Control")})
    return json_answer(page.body, headers=page.headers)


def _add_stream(router: APIRouter, stream: EventStream) -> None:
    streamed = answers(EventRecord, 422, media_type=EVENT_STREAM)

    @router.get("/events/stream", name="stream", responses=streamed, openapi_extra=taking(StreamQuery))
    async def stream_events(request: Request) -> Response:
        """Stream events as they are written, from those behind a sequence number on.

        Server-sent events: `id` is the sequence number, `event` the status, `data` the event.
        """
        given = request.query_params.multi_items(), request.headers.get("last-event-id")
        return await stream.answer(*read_stream_question(*given))


def _add_summary(router: APIRouter, pool: ProcessPool) -> None:
    counted = answers(EventSummary, 400, 422)

    @router.get("/events/summary", name="summary", responses=counted, openapi_extra=taking(SummaryQuery))
    async def summarise_events(request: Request) -> Response:
        """Count events by type, road, object or hour, the highest count first, and in bins of media time."""
        asked, wanted = read_query(request.query_params.multi_items(), SummaryQuery)
        return json_answer(await pool.ask(summary, wanted, asked.by, asked.bin_us or None, asked.limit))


def _add_export(router: APIRouter, log: EventLog) -> None:
    @router.get("/events/export", name="export", responses=_EXPORTED, openapi_extra=taking(ExportQuery))
    def export_events(request: Request) -> Response:
        """Export all events of the filters as a file, which is made while it is sent, in one state of the log."""
        asked, wanted = read_query(request.query_params.multi_items(), ExportQuery)
        headers = {"Content-Disposition": f'attachment; filename="events.{asked.format}"'}
        blocks = exported(log, wanted, asked.format)
        return StreamingResponse(blocks, headers=headers, media_type=_MEDIA_TYPES[asked.format])


def _add_event(router: APIRouter, log: EventLog) -> None:
    @router.get("/events/{event_id}", name="event", responses=answers(EventRecord, 404, 422))
    def get_event(event_id: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get an event by its identifier; 404 if the log has no such event."""
        text = find_event(log, event_id)
        if text is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return json_answer(text.encode())
