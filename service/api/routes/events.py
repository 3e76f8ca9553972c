"""Which events are there? They are sent as the text that is stored: nothing is decoded on the way."""

from collections.abc import Mapping
from typing import Annotated
from urllib.parse import urlencode

import msgspec
from fastapi import APIRouter, HTTPException, Query, Request
from starlette.responses import Response

from service.api.asked import NoParameters
from service.api.bodies import EventList
from service.api.event_stream import MEDIA_TYPE as EVENT_STREAM
from service.api.event_stream import EventStream
from service.api.openapi import answers
from service.api.parameters import (
    STREAM_PARAMETERS,
    Pairs,
    describe_event_parameters,
    read_question,
    read_stream_question,
)
from service.api.routes.answering import json_answer
from service.questions.coverage import Coverage
from service.questions.notes import name_notes, run_notes
from service.questions.queries import EventPage, find_event, find_events
from service.records import EventRecord
from service.store.log import EventLog


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
        told: dict[str, object] = {"looked_at": coverage.of(question.wanted)}
        if not page.items and question.cursor is None:
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
