"""Which relations held from when to when? Answered by processes, since what was not watched is computed."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field, WithJsonSchema
from starlette.responses import Response

from qsr.relations import RANK
from service.api.messages.answers import answers, json_answer
from service.api.messages.asked import InWindow, MediaTime, OfRun
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import relations
from service.questions.events.queries import MAX_LIMIT, MAX_VALUES
from service.questions.observations.relation_intervals import RelationList, RelationQuestion

_DEFAULT_LIMIT = 1_000
_MAX_LIMIT = 10 * MAX_LIMIT  # an interval is a tenth of an event


_Name = Annotated[str, WithJsonSchema({"type": "string", "enum": list(RANK)})]


class _About(OfRun):
    name: list[_Name] = Field([], max_length=MAX_VALUES, description="A relation; without it all that were watched.")
    a: str | None = Field(None, description="What takes part, in any place: a car, a road.")
    b: str | None = Field(None, description="What takes part besides.")
    limit: int = Field(_DEFAULT_LIMIT, ge=1, le=_MAX_LIMIT, description="Intervals at most, the earliest.")
    cursor: str | None = Field(None, description="`next_cursor` of the page before, same question.")


class _InWindow(_About, InWindow):
    pass


class _AtTime(_About):
    t_us: MediaTime = Field(description="When, media time.")


def add_relations(router: APIRouter, pool: ProcessPool) -> None:
    """Add the routes about relations."""
    listed = answers(RelationList, 400, 404, 422)

    @router.get("/relations", name="relations", responses=listed)
    async def list_relations(asked: Annotated[_InWindow, Query()]) -> Response:
        """List when relations held in a window, the earliest first; unwatched ones too, if they are named."""
        return json_answer(await pool.ask(relations, _question(asked, asked.from_, asked.to), asked.cursor))

    @router.get("/relations/at", name="relations_at", responses=listed)
    async def list_relations_at(asked: Annotated[_AtTime, Query()]) -> Response:
        """List relations that held at a time, each with all of the interval in which that lies."""
        return json_answer(await pool.ask(relations, _question(asked, asked.t_us, asked.t_us + 1), asked.cursor))


def _question(asked: _About, from_us: int | None, to_us: int | None) -> RelationQuestion:
    about = tuple(one for one in (asked.a, asked.b) if one is not None)
    return RelationQuestion(
        run=asked.run, names=tuple(asked.name), about=about, from_us=from_us, to_us=to_us, limit=asked.limit
    )
