"""What did a run look at? Its video, and its events as chapters of it, for a player."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field
from starlette.responses import FileResponse, Response, StreamingResponse

from service.api.messages.answers import Answers, problems
from service.api.messages.asked import MediaTime, NoParameters
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import picture, video_of
from service.export.events import exported
from service.questions.events.queries import EventFilter
from service.store.log import EventLog

_VIDEO: Answers = {
    200: {"description": "OK", "content": {"video/*": {}}},
    206: {"description": "A part", "content": {"video/*": {}}},
}
_PICTURE: Answers = {200: {"description": "OK", "content": {"image/jpeg": {}}}}
_CHAPTERS: Answers = {200: {"description": "OK", "content": {"text/vtt": {}}}}


class _Picture(NoParameters):
    t_us: MediaTime = Field(description="When, media time: the frame that a player shows then.")
    overlay: bool = Field(True, description="Whether cars, their trails and events are drawn on it.")
    width: int | None = Field(
        None, ge=16, le=8192, description="Its width in pixels at most; text is not made smaller."
    )


def add_media(router: APIRouter, log: EventLog, pool: ProcessPool, folders: Sequence[Path]) -> None:
    """Add the routes for players.

    Parameters
    ----------
    folders : only files that lie in these are sent.
    """
    allowed = [one.resolve() for one in folders]

    @router.get(
        "/api/v1/runs/{run}/video",
        name="video",
        summary="Get the video of a run",
        description="Takes `Range`. Media time 0 is at the time stamp `first_pts_us` of the run.",
        responses=problems(400, 404, 416, 422) | _VIDEO,
    )
    def get_video(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Answer with the file that the run read, if it is still there and may be sent."""
        path = video_of(log.run(run), allowed)
        return FileResponse(path, content_disposition_type="inline", filename=path.name)

    @router.get(
        "/api/v1/runs/{run}/frame",
        name="frame",
        summary="Get a picture of a run",
        responses=problems(404, 409, 422) | _PICTURE,
    )
    async def get_frame(run: str, asked: Annotated[_Picture, Query()]) -> Response:
        """Answer with a frame of the video as JPEG, with what the run saw on it."""
        make = partial(picture, is_drawn=asked.overlay, width_px=asked.width)
        return Response(await pool.ask(make, run, allowed, asked.t_us), media_type="image/jpeg")

    @router.get(
        "/api/v1/runs/{run}/chapters.vtt",
        name="chapters",
        summary="Get the events of a run as chapters of its video",
        responses=problems(404, 422) | _CHAPTERS,
    )
    def get_chapters(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Answer with WebVTT in the times of the video."""
        return StreamingResponse(exported(log, EventFilter(runs=(log.run(run).id,)), "vtt"), media_type="text/vtt")
