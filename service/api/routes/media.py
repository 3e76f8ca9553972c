"""What did a run look at? Its video, and its events as chapters of it, for a player."""

import mimetypes
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, HTTPException, Query
from starlette.responses import FileResponse, Response, StreamingResponse

from service.api.asked import NoParameters
from service.api.openapi import Answers, problems
from service.export.events import exported
from service.questions.queries import EventFilter
from service.records import InputFile
from service.store.log import EventLog

_VIDEO: Answers = {
    200: {"description": "OK", "content": {"video/*": {}}},
    206: {"description": "A part", "content": {"video/*": {}}},
}
_CHAPTERS: Answers = {200: {"description": "OK", "content": {"text/vtt": {}}}}


def add_media(router: APIRouter, log: EventLog, folders: Sequence[Path]) -> None:
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
        path = _sent(log.run(run).file, allowed)
        if path is None:
            expected = "expected one whose file is a video, as it was, in a folder that may be sent (serve --media)"
            raise HTTPException(404, f"run {run!r}: {expected}, got another one")
        return FileResponse(path, content_disposition_type="inline", filename=path.name)

    @router.get(
        "/api/v1/runs/{run}/chapters.vtt",
        name="chapters",
        summary="Get the events of a run as chapters of its video",
        responses=problems(404, 422) | _CHAPTERS,
    )
    def get_chapters(run: str, asked: Annotated[NoParameters, Query()]) -> Response:
        """Answer with WebVTT in the times of the video."""
        return StreamingResponse(exported(log, EventFilter(runs=(log.run(run).id,)), "vtt"), media_type="text/vtt")


def _sent(file: InputFile | None, folders: Iterable[Path]) -> Path | None:
    """Give where a video lies that may be sent; None if it may not, or is gone or another one."""
    path = Path(file.path).resolve() if file else Path()
    is_video = (mimetypes.guess_type(path)[0] or "").startswith("video/")
    if file is None or not is_video or not any(map(path.is_relative_to, folders)):
        return None
    return path if path.is_file() and path.stat().st_size == file.size_bytes else None
