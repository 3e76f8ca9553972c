"""Which cars are there, and by what is each the one that it is? Routes about cars."""

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.responses import Response

from service.api.asked import OfRun
from service.api.bodies import CarList, LinkList
from service.api.openapi import answers
from service.api.routes.answering import json_answer
from service.questions.coverage import looked_at
from service.questions.identity import identities, links_of
from service.store.log import EventLog


def add_cars(router: APIRouter, log: EventLog) -> None:
    """Add the routes about cars."""

    @router.get("/api/v1/cars", name="cars", summary="List the cars of a run", responses=answers(CarList, 404, 422))
    def list_cars(asked: Annotated[OfRun, Query()]) -> Response:
        """Answer with the cars in the order of first sight, and how sure each is the same one."""
        record = log.run(asked.run)
        times = [looked_at(log, record.id, record.source)]
        return json_answer(CarList(record.id, identities(log, record.id), times))

    @router.get(
        "/api/v1/cars/{car}/links",
        name="links",
        summary="Say by what links a car is the one that it is",
        responses=answers(LinkList, 404, 422),
    )
    def get_links(car: str, asked: Annotated[OfRun, Query()]) -> Response:
        """Answer with the identity chain of a car, oldest link first."""
        record = log.run(asked.run)
        return json_answer(LinkList(record.id, car, links_of(log, record, car)))
