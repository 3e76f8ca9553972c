"""Where does who knows only the address go from here?"""

from fastapi import APIRouter, Request
from fastapi.routing import APIRoute
from starlette.responses import PlainTextResponse, Response

from service.api.messages.answers import answers, json_answer
from service.api.messages.bodies import Index
from service.questions.events.queries import DEFAULT_LIMIT, MAX_LIMIT, find_last_seq
from service.records.runs import software_version
from service.store.log import EventLog

HELLO = """\
DyKnow: what happened in the traffic, recognised from video.

curl '{base}api/v1/events?type=overtake&from=00:10&to=02:00'     all overtakes between two times
curl '{base}api/v1'                                              everything else there is to ask
"""


def add_index(router: APIRouter, log: EventLog) -> None:
    """Add the first page and the index.

    The index links to every described route, by its name.
    """
    version = software_version()

    @router.get("/", include_in_schema=False, response_class=PlainTextResponse)
    def hello(request: Request) -> PlainTextResponse:
        return PlainTextResponse(HELLO.format(base=request.base_url))

    @router.get("/api/v1", name="index", responses=answers(Index))
    def index() -> Response:
        """Say what can be asked: link to all routes by their names."""
        described = (one for one in router.routes if isinstance(one, APIRoute) and one.include_in_schema)
        links = {one.name: one.path for one in described} | {"openapi": "/openapi.json"}
        return json_answer(Index("dyknow", version, find_last_seq(log), DEFAULT_LIMIT, MAX_LIMIT, links))
