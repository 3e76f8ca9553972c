"""Which questions does the HTTP interface answer?

Routes are plain functions run in worker threads: the database is asked and the answer put together there, off the
event loop. One reads a body, and hands the rest of its work to such a thread; explanations come from processes of their
own. Events are sent as the text that is stored; nothing is decoded on the way.
"""

from collections.abc import Iterable, Sequence
from typing import Final
from urllib.parse import urlencode

import msgspec
from anyio import to_thread
from fastapi import APIRouter, HTTPException, Request
from msgspec.structs import asdict
from starlette.responses import PlainTextResponse, Response

from dyknow.language.rendering import render_json
from service.api.bodies import CarList, ChronicleList, ChronicleUse, EventExplanation, EventList, Index, LinkList
from service.api.event_stream import MEDIA_TYPE as EVENT_STREAM
from service.api.event_stream import EventStream
from service.api.explanations import Explanations
from service.api.openapi import EXPLANATION, FINDINGS, answers
from service.api.parameters import (
    AWAITED_PARAMETERS,
    STREAM_PARAMETERS,
    Pairs,
    describe_absence_parameters,
    describe_event_parameters,
    read_absence_question,
    read_question,
    read_stream_question,
)
from service.api.revalidation import Revalidation
from service.errors import QueryError
from service.questions.awaited import AwaitedList
from service.questions.identity import identities, links_of
from service.questions.notes import name_notes, run_notes
from service.questions.queries import DEFAULT_LIMIT, MAX_LIMIT, EventPage, find_event, find_events, find_last_seq
from service.records import ChronicleRecord, EventRecord
from service.store.log import EventLog
from service.texts.chronicle_files import check_chronicles

JSON: Final = "application/json"

TEXT_NAME = "text"  # what findings call a text that came without a name
MAX_TEXT_BYTES = 256_000

HELLO = """\
DyKnow: what happened in the traffic, recognised from video.

curl '{base}api/v1/events?type=overtake&from=00:10&to=02:00'     all overtakes between two times
curl '{base}api/v1'                                              everything else there is to ask
"""


def add_routes(
    router: APIRouter,
    log: EventLog,
    stream: EventStream,
    explanations: Explanations,
    shipped: Iterable[ChronicleRecord],
    *,
    version: str,
) -> None:
    """Add the routes of one event log to those of an application.

    Parameters
    ----------
    stream, explanations : of the same log.
    shipped : the chronicles that come with DyKnow.
    version : of the software, for the index.
    """
    _add_general(router, log, version)
    _add_chronicles(router, log, tuple(shipped))
    _add_stream(router, stream)
    _add_events(router, log)
    _add_explanations(router, explanations)
    _add_cars(router, log)


def _add_general(router: APIRouter, log: EventLog, version: str) -> None:
    @router.get("/", include_in_schema=False, response_class=PlainTextResponse)
    def hello(request: Request) -> PlainTextResponse:
        return PlainTextResponse(HELLO.format(base=request.base_url))

    @router.get("/api/v1", summary="Say what can be asked", responses=answers(Index))
    def index() -> Response:
        return _json(msgspec.json.encode(_index(version, find_last_seq(log))))


def _add_chronicles(router: APIRouter, log: EventLog, library: tuple[ChronicleRecord, ...]) -> None:
    @router.get("/api/v1/chronicles", summary="List chronicles", responses=answers(ChronicleList, 422))
    def list_chronicles(request: Request) -> Response:
        """List the shipped chronicles and those of the log's runs."""
        _refuse_parameters(request)
        return _json(msgspec.json.encode(ChronicleList(_merge_chronicles(log, library))))

    @router.post(
        "/api/v1/chronicles/check",
        summary="Check a chronicle text",
        description="The body is the text, UTF-8. The answer is 200 whatever is found in it.",
        responses=answers(FINDINGS, 413, 422),
        max_body_size=MAX_TEXT_BYTES,
        openapi_extra={"requestBody": {"content": {"text/plain": {"schema": {"type": "string"}}}}},
    )
    async def check_text(request: Request) -> Response:
        """Find what is wrong or doubtful in a text."""
        text = await _read_text(request)
        # Off the event loop, as everything that takes time.
        checked = await to_thread.run_sync(check_chronicles, [(TEXT_NAME, text)])
        return _json(f'{{"findings":{render_json(checked.findings)}}}'.encode())


async def _read_text(request: Request) -> str:
    body = await request.body()
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise QueryError(f"body: expected UTF-8 text, got byte {body[error.start]:#04x}", parameter="body") from error


def _add_stream(router: APIRouter, stream: EventStream) -> None:
    @router.get(
        "/api/v1/events/stream",
        summary="Stream events as they are written",
        description="Server-sent events: `id` is the sequence number, `event` the status, `data` the event.",
        responses=answers(EventRecord, 422, media_type=EVENT_STREAM),
        openapi_extra={"parameters": describe_event_parameters(STREAM_PARAMETERS)},
    )
    async def stream_events(request: Request) -> Response:
        """Answer with the events behind a sequence number, and go on with those that are written from then on."""
        given = request.query_params.multi_items(), request.headers.get("last-event-id")
        return await stream.answer(*read_stream_question(*given))


def _add_events(router: APIRouter, log: EventLog) -> None:
    revalidation = Revalidation(log)

    @router.get(
        "/api/v1/events",
        summary="List events",
        description="Repeated parameters are alternatives; different parameters must all hold.",
        responses=answers(EventList, 400, 422),
        openapi_extra={"parameters": describe_event_parameters()},
    )
    def list_events(request: Request) -> Response:
        """Answer with one page of the events that were asked for."""
        unchanged = revalidation.unchanged(request)
        if unchanged is not None:
            return unchanged
        pairs = request.query_params.multi_items()
        question = read_question(pairs)
        page = find_events(log, question.wanted, limit=question.limit, cursor=question.cursor)
        is_empty = not page.items and question.cursor is None
        notes = (*name_notes([log], question.wanted), *run_notes([log], question.wanted)) if is_empty else ()
        answer = _event_page(page, request.url.path, pairs, notes)
        if not is_empty:  # the notes tell of runs, which change without an event
            answer.headers.update(revalidation.headers(page.as_of_seq))
        return answer

    @router.get("/api/v1/events/{event_id}", summary="Get one event", responses=answers(EventRecord, 404, 422))
    def get_event(event_id: str, request: Request) -> Response:
        """Get an event by its identifier; 404 if the log has no such event."""
        _refuse_parameters(request)
        text = find_event(log, event_id)
        if text is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return _json(text.encode())


def _add_explanations(router: APIRouter, explanations: Explanations) -> None:
    @router.get(
        "/api/v1/events/{event_id}/why",
        summary="Say why an event was recognised",
        responses=answers(EventExplanation, 404, 409, 422),
    )
    async def get_why(event_id: str, request: Request) -> Response:
        """Explain an event by its parts, its constraints and who its objects were."""
        _refuse_parameters(request)
        found = await explanations.why(event_id)
        if found is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return _json(found)

    @router.get(
        "/api/v1/chronicles/{name}/why-not",
        summary="Say why a chronicle was not recognised",
        description="The instances that came closest, the nearest first.",
        responses=answers(EXPLANATION, 400, 404, 409, 422),
        openapi_extra={"parameters": describe_absence_parameters(name="name")},
    )
    async def get_why_not(name: str, request: Request) -> Response:
        """Explain the absence of a chronicle by its near misses."""
        question = read_absence_question(name, request.query_params.multi_items())
        return _json(await explanations.why_not(question))

    @router.get(
        "/api/v1/chronicles/{name}/partial",
        summary="Say what instances of a chronicle wait for",
        description="What was under way at a time: what is missing, until when, and what became of instances before.",
        responses=answers(AwaitedList, 400, 404, 409, 422),
        openapi_extra={"parameters": describe_absence_parameters(AWAITED_PARAMETERS, name="name")},
    )
    async def get_partial(name: str, request: Request) -> Response:
        """Answer with the instances under way, and those that ended in the window."""
        question = read_absence_question(name, request.query_params.multi_items(), AWAITED_PARAMETERS)
        return _json(await explanations.awaited(question))


def _add_cars(router: APIRouter, log: EventLog) -> None:
    @router.get("/api/v1/cars", summary="List the cars of a run", responses=answers(CarList, 404, 422))
    def list_cars(request: Request, run: str | None = None) -> Response:
        """Answer with the cars in the order of first sight, and how sure each is the same one."""
        _refuse_parameters(request, but="run")
        record = log.run(run)
        return _json(msgspec.json.encode(CarList(record.id, identities(log, record.id))))

    @router.get(
        "/api/v1/cars/{car}/links",
        summary="Say by what links a car is the one that it is",
        responses=answers(LinkList, 404, 422),
    )
    def get_links(car: str, request: Request, run: str | None = None) -> Response:
        """Answer with the identity chain of a car, oldest link first."""
        _refuse_parameters(request, but="run")
        record = log.run(run)
        return _json(msgspec.json.encode(LinkList(record.id, car, links_of(log, record, car))))


def _refuse_parameters(request: Request, *, but: str | None = None) -> None:
    """Refuse parameters that are not taken, where one is at most: one that restricts nothing was meant to."""
    names = [name for name, _ in request.query_params.multi_items()]
    for name in names if names != [but] else ():
        raise QueryError(
            f"query: expected {'one ' + but if but else 'no parameter'}, got {', '.join(map(repr, names))}",
            parameter=name,
        )


def _event_page(page: EventPage, path: str, pairs: Pairs, notes: Sequence[str]) -> Response:
    cursor = "null" if page.next_cursor is None else f'"{page.next_cursor}"'
    told = f',"notes":{msgspec.json.encode(notes).decode()}' if notes else ""
    body = f'{{"items":[{",".join(page.items)}],"next_cursor":{cursor},"as_of_seq":{page.as_of_seq}{told}}}'
    response = _json(body.encode())
    if page.next_cursor is not None:
        query = urlencode([*(pair for pair in pairs if pair[0] != "cursor"), ("cursor", page.next_cursor)])
        response.headers["Link"] = f'<{path}?{query}>; rel="next"'
    return response


def _merge_chronicles(log: EventLog, library: Iterable[ChronicleRecord]) -> list[ChronicleUse]:
    """Join the shipped chronicles and those of the log's runs, one entry a name and version."""
    shipped = {(one.name, one.version): one for one in library}
    used: dict[tuple[str, str], ChronicleRecord] = {}
    runs: dict[tuple[str, str], list[str]] = {}
    for run in log.runs():
        for one in run.chronicles:
            used.setdefault((one.name, one.version), one)
            runs.setdefault((one.name, one.version), []).append(run.id)
    return [
        ChronicleUse(**asdict(one), is_shipped=key in shipped, runs=runs.get(key, []))
        for key, one in sorted((used | shipped).items())
    ]


def _index(version: str, as_of_seq: int) -> Index:
    links = {
        "events": "/api/v1/events",
        "event": "/api/v1/events/{event_id}",
        "stream": "/api/v1/events/stream",
        "why": "/api/v1/events/{event_id}/why",
        "cars": "/api/v1/cars",
        "links": "/api/v1/cars/{car}/links",
        "chronicles": "/api/v1/chronicles",
        "check": "/api/v1/chronicles/check",
        "why_not": "/api/v1/chronicles/{name}/why-not",
        "partial": "/api/v1/chronicles/{name}/partial",
        "openapi": "/openapi.json",
        "health": "/healthz",
    }
    return Index("dyknow", version, as_of_seq, DEFAULT_LIMIT, MAX_LIMIT, links)


def _json(body: bytes) -> Response:
    return Response(body, media_type=JSON)
