"""Which events are there? They are sent as the text that is stored: nothing is decoded on the way."""

from collections.abc import Mapping
from hashlib import blake2b
from typing import Annotated
from urllib.parse import urlencode

import msgspec
from fastapi import APIRouter, HTTPException, Query, Request
from starlette.responses import Response, StreamingResponse

from service.api.asked import GEOJSON, NoParameters
from service.api.bodies import EventList, EventSummary
from service.api.event_stream import MEDIA_TYPE as EVENT_STREAM
from service.api.event_stream import EventStream
from service.api.openapi import answers, problems
from service.api.parameters import (
    EventQuery,
    ExportQuery,
    Pairs,
    StreamQuery,
    SummaryQuery,
    describe_query,
    read_query,
    read_stream_question,
)
from service.api.routes.answering import json_answer
from service.export.events import exported
from service.questions.coverage import Coverage, LookedAt
from service.questions.notes import name_notes, run_notes
from service.questions.queries import EventFilter, EventPage, find_event, find_events
from service.questions.summaries import count_events, summarise
from service.records import EventRecord
from service.store.log import EventLog

_MEDIA_TYPES = {
    "jsonl": "application/jsonl", "csv": "text/csv", "vtt": "text/vtt", "geojson": GEOJSON, "ocel": "application/json",
}  # fmt: skip
_EXPORTED = problems(400, 422) | {200: {"description": "OK", "content": {one: {} for one in _MEDIA_TYPES.values()}}}


def add_events(router: APIRouter, log: EventLog, stream: EventStream, coverage: Coverage) -> None:
    """Add the routes about events.

    Parameters
    ----------
    stream, coverage : of the same log.
    """
    _add_page(router, log, coverage)
    _add_stream(router, stream)
    _add_summary(router, log, coverage)
    _add_export(router, log)
    _add_event(router, log)  # last, as `{event_id}` fits the paths above too


def _add_page(router: APIRouter, log: EventLog, coverage: Coverage) -> None:
    @router.get(
        "/api/v1/events",
        name="events",
        summary="List events",
        description="Repeated parameters are alternatives; different parameters must all hold.",
        responses=answers(EventList, 400, 422),
        openapi_extra={"parameters": describe_query(EventQuery)},
    )
    def list_events(request: Request) -> Response:
        """Answer with one page of the events that were asked for."""
        pairs = request.query_params.multi_items()
        asked, wanted = read_query(pairs, EventQuery)
        page = find_events(log, wanted, limit=asked.limit, cursor=asked.cursor)
        told: dict[str, object] = {"looked_at": _looked_at(coverage, wanted)}
        if asked.count == "exact":
            told["count"] = count_events(log, wanted)
        # What is told of an older state does not change.
        if not page.items and asked.cursor is None and wanted.as_of is None:
            notes = (*name_notes([log], wanted), *run_notes([log], wanted))
            told |= {"notes": notes} if notes else {}
        return _event_page(page, request, pairs, told)


def _add_stream(router: APIRouter, stream: EventStream) -> None:
    @router.get(
        "/api/v1/events/stream",
        name="stream",
        summary="Stream events as they are written",
        description="Server-sent events: `id` is the sequence number, `event` the status, `data` the event.",
        responses=answers(EventRecord, 422, media_type=EVENT_STREAM),
        openapi_extra={"parameters": describe_query(StreamQuery)},
    )
    async def stream_events(request: Request) -> Response:
        """Answer with the events behind a sequence number, and go on with those that are written from then on."""
        given = request.query_params.multi_items(), request.headers.get("last-event-id")
        return await stream.answer(*read_stream_question(*given))


def _add_summary(router: APIRouter, log: EventLog, coverage: Coverage) -> None:
    @router.get(
        "/api/v1/events/summary",
        name="summary",
        summary="Count events",
        responses=answers(EventSummary, 400, 422),
        openapi_extra={"parameters": describe_query(SummaryQuery)},
    )
    def summarise_events(request: Request) -> Response:
        """Answer with counts by type, road, object or hour, the highest first, and bins of media time."""
        asked, wanted = read_query(request.query_params.multi_items(), SummaryQuery)
        bin_us = asked.bin_us or None
        as_of_seq, items = summarise(log, wanted, asked.by, bin_us=bin_us, limit=asked.limit)
        return json_answer(EventSummary(asked.by, bin_us, as_of_seq, items, _looked_at(coverage, wanted)))


def _add_export(router: APIRouter, log: EventLog) -> None:
    @router.get(
        "/api/v1/events/export",
        name="export",
        summary="Export events as a file",
        description="All events of the filters, in one state of the log.",
        responses=_EXPORTED,
        openapi_extra={"parameters": describe_query(ExportQuery)},
    )
    def export_events(request: Request) -> Response:
        """Answer with a file that is made while it is sent."""
        asked, wanted = read_query(request.query_params.multi_items(), ExportQuery)
        headers = {"Content-Disposition": f'attachment; filename="events.{asked.format}"'}
        blocks = exported(log, wanted, asked.format)
        return StreamingResponse(blocks, headers=headers, media_type=_MEDIA_TYPES[asked.format])


def _add_event(router: APIRouter, log: EventLog) -> None:
    @router.get(
        "/api/v1/events/{event_id}", name="event", summary="Get one event", responses=answers(EventRecord, 404, 422)
    )
    def get_event(event_id: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get an event by its identifier; 404 if the log has no such event."""
        text = find_event(log, event_id)
        if text is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return json_answer(text.encode())


def _looked_at(coverage: Coverage, wanted: EventFilter) -> list[LookedAt] | None:
    """Say what was looked at; not of an older state of the log, which must stay as it was."""
    return coverage.of(wanted) if wanted.as_of is None else None


def _event_page(page: EventPage, request: Request, pairs: Pairs, told: Mapping[str, object]) -> Response:
    """Answer with a page, or that the client has it; `told` is what stands beside its items."""
    beside = {"next_cursor": page.next_cursor, "as_of_seq": page.as_of_seq, **told}
    body = b'{"items":[%b],%b' % (",".join(page.items).encode(), msgspec.json.encode(beside)[1:])
    tag = f'W/"{blake2b(body, digest_size=12).hexdigest()}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}  # to be kept, and asked for each time
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    if page.next_cursor is not None:
        query = urlencode([*(pair for pair in pairs if pair[0] != "cursor"), ("cursor", page.next_cursor)])
        headers["Link"] = f'<{request.url.path}?{query}>; rel="next"'
    return json_answer(body, headers=headers)
