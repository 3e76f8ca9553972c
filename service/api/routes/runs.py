"""Which runs does the log hold, and what is known of each? Routes about runs."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query
from msgspec import convert
from msgspec.structs import replace
from pydantic import Field
from starlette.responses import Response

from service.api.messages.answers import answers, json_answer
from service.api.messages.asked import GEOJSON, Form, NoParameters
from service.api.messages.bodies import RunDetail, RunList, RunSummary
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import site
from service.questions.events.queries import MAX_VALUES
from service.questions.observations.coverage import Coverage, lost_views
from service.records.runs import RunSite, RunStatus
from service.runs.graph.stored_streams import StoredStreams, streams_of
from service.store.log import EventLog
from service.store.upkeep import holdings


class _Asked(NoParameters):
    source: list[str] = Field([], max_length=MAX_VALUES, description="Name of the input.")
    status: list[RunStatus] = Field([], max_length=MAX_VALUES, description="How far the run has come.")


class _Site(NoParameters):
    format: Form = "json"


def add_runs(router: APIRouter, log: EventLog, pool: ProcessPool, coverage: Coverage) -> None:
    """Add the routes about runs."""

    @router.get("/runs", name="runs", responses=answers(RunList, 422))
    def list_runs(asked: Annotated[_Asked, Query()]) -> Response:
        """List runs, in the order in which they first came to the log, and what time each looked at."""
        known = coverage.of_all()
        found = [
            replace(
                convert(one, RunSummary, from_attributes=True),
                looked_at_us=known[one.id].spans_us if one.id in known else (),  # it may have begun this moment
            )
            for one in log.runs()
            if one.source in (asked.source or (one.source,)) and one.status in (asked.status or (one.status,))
        ]
        return json_answer(RunList(found))

    @router.get("/runs/{run}", name="run", responses=answers(RunDetail, 404, 422))
    def get_run(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get one run: what it was made of, how far it has come, what it holds, and when it saw nothing."""
        record = log.run(run)
        detail = convert(record, RunDetail, from_attributes=True)
        return json_answer(
            replace(
                detail,
                # Where files lie is nobody's affair but the server's.
                file=detail.file and replace(detail.file, path=Path(detail.file.path).name),
                looked_at_us=coverage.of_run(record)[0].spans_us,
                covered_us=log.covered_us(run),
                lost_us=lost_views(log, run) or (),
                cars=len(log.cars(run)),
                holds=holdings(log, run),
            )
        )

    @router.get("/runs/{run}/site", name="site", responses=answers(RunSite, 404, 409, 422, also=GEOJSON))
    async def get_site(run: str, asked: Annotated[_Site, Query()]) -> Response:
        """Get the lanes and junctions that a run knew, if its site file is still there."""
        found = await pool.ask(site, run, asked.format)
        return json_answer(found) if asked.format == "json" else Response(found, media_type=GEOJSON)

    @router.get("/runs/{run}/streams", name="streams", responses=answers(StoredStreams, 404, 422))
    def get_streams(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Say what ran in a run: its processes, what their streams carried, and what each cost."""
        return json_answer(streams_of(log, log.run(run)))
