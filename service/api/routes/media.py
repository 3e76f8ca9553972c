"""What did a run look at? Its video, and its events as chapters of it, for a player."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import FileResponse, Response, StreamingResponse

from service.api.messages.answers import file_answers, problems
from service.api.messages.asked import MediaTime, NoParameters
from service.api.processes.pictures import clip, picture, video_of
from service.api.processes.pool import ProcessPool
from service.export.events import exported
from service.questions.events.queries import EventFilter
from service.records.seen import Drawing, OverlayForm
from service.store.log import EventLog


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
    video = file_answers(["video/*"], 400, 404, 416, 422, statuses=(200, 206))

    @router.get("/runs/{run}/video", name="video", responses=video)
    def get_video(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get the video that a run read, if it is still there and may be sent.

        Takes `Range`. Media time 0 is at the time stamp `first_pts_us` of the run.
        """
        path = video_of(log.run(run), allowed)
        return FileResponse(path, content_disposition_type="inline", filename=path.name)

    @router.get("/runs/{run}/frame", name="frame", responses=file_answers(["image/jpeg"], 404, 409, 422))
    async def get_frame(run: str, asked: Annotated[_Picture, Query()]) -> Response:
        """Get a frame of the video of a run as JPEG, with what the run saw on it."""
        made = await pool.ask(picture, run, allowed, asked.t_us, Drawing(asked.overlay, asked.width))
        return Response(made, media_type="image/jpeg")

    @router.get("/events/{event_id}/clip.mp4", name="clip", responses=video | problems(409))
    async def get_clip(event_id: str, asked: Annotated[_Clip, Query()], request: Request) -> Response:
        """Get the piece of video of an event as H.264, with what the run saw on it.

        Takes `Range`.
        """
        make = partial(clip, pad_us=asked.pad_us, drawing=Drawing(asked.overlay, asked.width))
        path = await pool.ask(make, event_id, allowed, request.app.state.clips)
        return FileResponse(path, content_disposition_type="inline", filename=f"{event_id}.mp4")

    @router.get("/runs/{run}/chapters.vtt", name="chapters", responses=file_answers(["text/vtt"], 404, 422))
    def get_chapters(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Get the events of a run as chapters of its video, WebVTT in the times of that."""
        return StreamingResponse(exported(log, EventFilter(runs=(log.run(run).id,)), "vtt"), media_type="text/vtt")
