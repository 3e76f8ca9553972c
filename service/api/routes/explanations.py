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

    @router.get(
        "/api/v1/events/{event_id}/why",
        name="why",
        summary="Say why an event was recognised",
        responses=answers(EventExplanation, 404, 409, 422),
    )
    async def get_why(event_id: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Explain an event by its parts, its constraints and who its objects were."""
        found = await pool.ask(why, event_id)
        if found is None:
            raise HTTPException(404, f"event: expected the id of an event in this log, got {event_id!r}")
        return json_answer(found)

    @router.get(
        "/api/v1/chronicles/{name}/why-not",
        name="why_not",
        summary="Say why a chronicle was not recognised",
        description="The instances that came closest, the nearest first.",
        responses=answers(EXPLANATION, 400, 404, 409, 422),
        openapi_extra={"parameters": [describe_roles()]},
    )
    async def get_why_not(name: str, asked: Annotated[Absence, Query()]) -> Response:
        """Explain the absence of a chronicle by its near misses."""
        return json_answer(await pool.ask(why_not, asked.about(name, asked.from_, asked.to)))

    @router.get(
        "/api/v1/chronicles/{name}/partial",
        name="partial",
        summary="Say what instances of a chronicle wait for",
        description="What was under way at a time: what is missing, until when, and what became of instances before.",
        responses=answers(AwaitedAnswer, 400, 404, 409, 422),
        openapi_extra={"parameters": [describe_roles()]},
    )
    async def get_partial(name: str, asked: Annotated[Awaited, Query()]) -> Response:
        """Answer with the instances under way, and those that ended in the window."""
        return json_answer(await pool.ask(awaited, asked.about(name, asked.from_, asked.at)))

    @router.post(
        "/api/v1/monitors/try",
        name="try_monitors",
        summary="Say what monitors would have told",
        responses=answers(MonitorTrial, 400, 404, 409, 413, 422),
        dependencies=[Depends(take_none)],
    )
    async def try_monitors(order: MonitorOrder) -> Response:
        """Run monitors over the stored cars and relations of a run; nothing is written."""
        return json_answer(await pool.ask(monitors_tried, order.run, order.text))
