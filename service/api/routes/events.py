"""Which events are there? They are sent as the text that is stored: nothing is decoded on the way."""

from collections.abc import Mapping
from typing import Annotated
from urllib.parse import urlencode

import msgspec
from fastapi import APIRouter, HTTPException, Query, Request
from starlette.responses import Response, StreamingResponse

from service.api.asked import NoParameters
from service.api.bodies import EventList, EventSummary
from service.api.event_stream import MEDIA_TYPE as EVENT_STREAM
from service.api.event_stream import EventStream
from service.api.openapi import answers
from service.api.parameters import (
    EXPORT_PARAMETERS,
    STREAM_PARAMETERS,
    SUMMARY_PARAMETERS,
    Pairs,
    describe_event_parameters,
    read_export_question,
    read_question,
    read_stream_question,
    read_summary_question,
)
from service.api.routes.answering import json_answer
from service.export.events import exported
from service.questions.coverage import Coverage
from service.questions.notes import name_notes, run_notes
from service.questions.queries import EventPage, find_event, find_events
from service.questions.summaries import count_events, summarise
from service.records import EventRecord
from service.store.log import EventLog

_MEDIA_TYPES = {"jsonl": "application/jsonl", "csv": "text/csv"}
_EXPORTED = answers("", 400, 422) | {
    200: {"description": "OK", "content": {one: {"schema": {"type": "string"}} for one in _MEDIA_TYPES.values()}}
}


def add_events(router: APIRouter, log: EventLog, stream: EventStream, coverage: Coverage) -> None:
    """Add the routes about events.

    Parameters
    ----------
    stream, coverage : of the same log.
    """

    @router.get(
        "/api/v1/events",
        name="events",
        summary="List events",
        description="Repeated parameters are alternatives; different parameters must all hold.",
        responses=answers(EventList, 400, 422),
        openapi_extra={"parameters": describe_event_parameters()},
    )
    def list_events(request: Request) -> Response:
        """Answer with one page of the events that were asked for."""
        pairs = request.query_params.multi_items()
        question = read_question(pairs)
        page = find_events(log, question.wanted, limit=question.limit, cursor=question.cursor)
        is_now = question.wanted.as_of is None  # what is told of then does not change
        told: dict[str, object] = {"looked_at": coverage.of(question.wanted) if is_now else None}
        if question.is_counted:
            told["count"] = count_events(log, question.wanted)
        if is_now and not page.items and question.cursor is None:
            notes = (*name_notes([log], question.wanted), *run_notes([log], question.wanted))
            told |= {"notes": notes} if notes else {}
        return _event_page(page, request.url.path, pairs, told)

    @router.get(
        "/api/v1/events/stream",
        name="stream",
        summary="Stream events as they are written",
        description="Server-sent events: `id` is the sequence number, `event` the status, `data` the event.",
        responses=answers(EventRecord, 422, media_type=EVENT_STREAM),
        openapi_extra={"parameters": describe_event_parameters(STREAM_PARAMETERS)},
    )
    async def stream_events(request: Request) -> Response:
        """Answer with the events behind a sequence number, and go on with those that are written from then on."""
        given = request.query_params.multi_items(), request.headers.get("last-event-id")
        return await stream.answer(*read_stream_question(*given))

    @router.get(
        "/api/v1/events/summary",
        name="summary",
        summary="Count events",
        responses=answers(EventSummary, 400, 422),
        openapi_extra={"parameters": describe_event_parameters(SUMMARY_PARAMETERS)},
    )
    def summarise_events(request: Request) -> Response:
        """Answer with counts by type, road, object or hour, the highest first, and bins of media time."""
        wanted, by, bin_us, limit = read_summary_question(request.query_params.multi_items())
        as_of_seq, items = summarise(log, wanted, by, bin_us=bin_us, limit=limit)
        looked_at = coverage.of(wanted) if wanted.as_of is None else None
        return json_answer(EventSummary(by, bin_us, as_of_seq, items, looked_at))

    @router.get(
        "/api/v1/events/export",
        name="export",
        summary="Export events as a file",
        description="All events of the filters, in one state of the log.",
        responses=_EXPORTED,
        openapi_extra={"parameters": describe_event_parameters(EXPORT_PARAMETERS)},
    )
    def export_events(request: Request) -> Response:
        """Answer with a file that is made while it is sent."""
        wanted, form = read_export_question(request.query_params.multi_items())
        headers = {"Content-Disposition": f'attachment; filename="events.{form}"'}
        return StreamingResponse(exported(log, wanted, form), headers=headers, media_type=_MEDIA_TYPES[form])

    @router.get(
        "/api/v1/events/{event_id}", name="event", summary="Get one event", responses=answers(EventRecord, 404, 422)
    )
    def get_event(event_id: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get an event by its identifier; 404 if the log has no such event."""
        text = find_event(log, event_id)
        if text is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return json_answer(text.encode())


def _event_page(page: EventPage, path: str, pairs: Pairs, told: Mapping[str, object]) -> Response:
    """Answer with a page; `told` is what stands beside its items."""
    beside = {"next_cursor": page.next_cursor, "as_of_seq": page.as_of_seq, **told}
    response = json_answer(b'{"items":[%b],%b' % (",".join(page.items).encode(), msgspec.json.encode(beside)[1:]))
    if page.next_cursor is not None:
        query = urlencode([*(pair for pair in pairs if pair[0] != "cursor"), ("cursor", page.next_cursor)])
        response.headers["Link"] = f'<{path}?{query}>; rel="next"'
    return response
