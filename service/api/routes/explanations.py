"""Why was it recognised, why not, and what is awaited? Routes that are answered by processes of their own."""

from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Query
from starlette.responses import Response

from service.api.messages.answers import EXPLANATION, answers, json_answer
from service.api.messages.asked import Absence, Awaited, MonitorOrder, NoParameters, take_none
from service.api.messages.bodies import AwaitedAnswer, EventExplanation, MonitorTrial
from service.api.messages.parameters import describe_roles
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import awaited, monitors_tried, why, why_not


def add_explanations(router: APIRouter, pool: ProcessPool) -> None:
    """Add the routes that look again at what a run saw."""
    absent, under_way = (answers(one, 400, 404, 409, 422) for one in (EXPLANATION, AwaitedAnswer))
    tried = answers(MonitorTrial, 400, 404, 409, 413, 422)
    roles = {"parameters": [describe_roles()]}

    @router.get("/events/{event_id}/why", name="why", responses=answers(EventExplanation, 404, 409, 422))
    async def get_why(event_id: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Say why an event was recognised: its parts, its constraints and who its objects were."""
        found = await pool.ask(why, event_id)
        if found is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return json_answer(found)

    @router.get("/chronicles/{name}/why-not", name="why_not", responses=absent, openapi_extra=roles)
    async def get_why_not(name: str, asked: Annotated[Absence, Query()]) -> Response:
        """Say why a chronicle was not recognised: the instances that came closest, the nearest first."""
        return json_answer(await pool.ask(why_not, asked.about(name, asked.from_, asked.to)))

    @router.get("/chronicles/{name}/partial", name="partial", responses=under_way, openapi_extra=roles)
    async def get_partial(name: str, asked: Annotated[Awaited, Query()]) -> Response:
        """Say what instances of a chronicle wait for at a time, until when, and what became of those before."""
        return json_answer(await pool.ask(awaited, asked.about(name, asked.from_, asked.at)))

    @router.post("/monitors/try", name="try_monitors", responses=tried, dependencies=[Depends(take_none)])
    async def try_monitors(order: MonitorOrder) -> Response:
        """Say what monitors would have told of the stored cars and relations of a run; nothing is written."""
        return json_answer(await pool.ask(monitors_tried, order.run, order.text))
