"""Which runs does the log hold, what is known of each, and what did it look at? Routes about runs and their videos."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request
from msgspec import convert
from msgspec.structs import replace
from pydantic import Field
from starlette.responses import FileResponse, Response, StreamingResponse

from service.api.messages.answers import answers, file_answers, json_answer, problems
from service.api.messages.asked import GEOJSON, Form, MediaTime, NoParameters
from service.api.messages.bodies import RunDetail, RunList, RunSummary
from service.api.processes.pictures import clip, picture, video_of
from service.api.processes.questions import ProcessPool, site
from service.export.events import exported
from service.questions.events.queries import MAX_VALUES, EventFilter
from service.questions.observations.coverage import Coverage, lost_views
from service.records.runs import RunSite, RunStatus
from service.records.seen import Drawing, OverlayForm
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
