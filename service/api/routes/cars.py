"""Which cars are there, and by what is each the one that it is? Routes about cars."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from service.api.bodies import CarList, LinkList
from service.api.openapi import answers
from service.api.routes.answering import json_answer, refuse_parameters
from service.questions.identity import identities, links_of
from service.store.log import EventLog


def add_cars(router: APIRouter, log: EventLog) -> None:
    """Add the routes about cars."""

    @router.get("/api/v1/cars", name="cars", summary="List the cars of a run", responses=answers(CarList, 404, 422))
    def list_cars(request: Request, run: str | None = None) -> Response:
        """Answer with the cars in the order of first sight, and how sure each is the same one."""
        refuse_parameters(request, but="run")
        record = log.run(run)
        return json_answer(CarList(record.id, identities(log, record.id)))

    @router.get(
        "/api/v1/cars/{car}/links",
        name="links",
        summary="Say by what links a car is the one that it is",
        responses=answers(LinkList, 404, 422),
    )
    def get_links(car: str, request: Request, run: str | None = None) -> Response:
        """Answer with the identity chain of a car, oldest link first."""
        refuse_parameters(request, but="run")
        record = log.run(run)
        return json_answer(LinkList(record.id, car, links_of(log, record, car)))
