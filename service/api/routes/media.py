"""What did a run look at? Its video, and its events as chapters of it, for a player."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import FileResponse, Response, StreamingResponse

from service.api.messages.answers import Answers, problems
from service.api.messages.asked import MediaTime, NoParameters
from service.api.processes.pictures import clip, picture, video_of
from service.api.processes.pool import ProcessPool
from service.export.events import exported
from service.questions.events.queries import EventFilter
from service.records.seen import OverlayForm
from service.store.log import EventLog

_VIDEO: Answers = {
    200: {"description": "OK", "content": {"video/*": {}}},
    206: {"description": "A part", "content": {"video/*": {}}},
}
_PICTURE: Answers = {200: {"description": "OK", "content": {"image/jpeg": {}}}}
_CHAPTERS: Answers = {200: {"description": "OK", "content": {"text/vtt": {}}}}


class _Drawn(NoParameters):
    overlay: OverlayForm = Field("symbols", description="Boxes of cars, or also their names and trails, and events.")
    width: int | None = Field(
        None, ge=16, le=8192, description="Its width in pixels at most; text is not made smaller."
    )


class _Picture(_Drawn):
    t_us: MediaTime = Field(description="When, media time: the frame that a player shows then.")


class _Clip(_Drawn):
    pad_us: MediaTime = Field(2_000_000, description="So much before and behind the event too.")


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
        make = partial(picture, overlay=asked.overlay, width_px=asked.width)
        return Response(await pool.ask(make, run, allowed, asked.t_us), media_type="image/jpeg")

    @router.get(
        "/api/v1/events/{event_id}/clip.mp4",
        name="clip",
        summary="Get the piece of video of an event",
        description="Takes `Range`.",
        responses=problems(400, 404, 409, 416, 422) | _VIDEO,
    )
    async def get_clip(event_id: str, asked: Annotated[_Clip, Query()], request: Request) -> Response:
        """Answer with the frames of the event as H.264, with what the run saw on them."""
        make = partial(clip, pad_us=asked.pad_us, overlay=asked.overlay, width_px=asked.width)
        path = await pool.ask(make, event_id, allowed, request.app.state.clips)
        return FileResponse(path, content_disposition_type="inline", filename=f"{event_id}.mp4")

    @router.get(
        "/api/v1/runs/{run}/chapters.vtt",
        name="chapters",
        summary="Get the events of a run as chapters of its video",
        responses=problems(404, 422) | _CHAPTERS,
    )
    def get_chapters(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Answer with WebVTT in the times of the video."""
        return StreamingResponse(exported(log, EventFilter(runs=(log.run(run).id,)), "vtt"), media_type="text/vtt")
