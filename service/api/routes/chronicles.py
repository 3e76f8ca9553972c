"""Which chronicles are there, and is a text one? Routes about chronicles and their texts."""

from collections.abc import Iterable

from anyio import to_thread
from fastapi import APIRouter, Request
from msgspec.structs import asdict
from starlette.responses import Response

from dyknow.language.rendering import render_json
from service.api.bodies import ChronicleList, ChronicleUse
from service.api.openapi import FINDINGS, answers, takes
from service.api.routes.answering import json_answer, read_text, refuse_parameters
from service.records import ChronicleRecord
from service.store.chronicle_texts import ChronicleTexts
from service.store.log import EventLog
from service.texts.chronicle_files import check_chronicles

TEXT_NAME = "text"  # what findings call a text that came without a name


def add_chronicles(router: APIRouter, log: EventLog, library: tuple[ChronicleRecord, ...]) -> None:
    """Add the routes about chronicles.

    Parameters
    ----------
    library : the chronicles that come with DyKnow.
    """

    @router.get(
        "/api/v1/chronicles", name="chronicles", summary="List chronicles", responses=answers(ChronicleList, 422)
    )
    def list_chronicles(request: Request) -> Response:
        """List the shipped chronicles, those of the log's runs, and the texts that the log holds."""
        refuse_parameters(request)
        with ChronicleTexts(log.place.url) as texts:
            return json_answer(ChronicleList(_merge_chronicles(log, library), texts.current()))

    @router.post(
        "/api/v1/chronicles/check",
        name="check",
        summary="Check a chronicle text",
        description="The body is the text, UTF-8. The answer is 200 whatever is found in it.",
        responses=answers(FINDINGS, 413, 422),
        openapi_extra=takes(str),
    )
    async def check_text(request: Request) -> Response:
        """Find what is wrong or doubtful in a text."""
        text = await read_text(request)
        # Off the event loop, as everything that takes time.
        checked = await to_thread.run_sync(check_chronicles, [(TEXT_NAME, text)])
        return json_answer(f'{{"findings":{render_json(checked.findings)}}}'.encode())


def _merge_chronicles(log: EventLog, library: Iterable[ChronicleRecord]) -> list[ChronicleUse]:
    """Join the shipped chronicles and those of the log's runs, one entry a name and version."""
    shipped = {(one.name, one.version): one for one in library}
    used: dict[tuple[str, str], ChronicleRecord] = {}
    runs: dict[tuple[str, str], list[str]] = {}
    for run in log.runs():
        for one in run.chronicles:
            used.setdefault((one.name, one.version), one)
            runs.setdefault((one.name, one.version), []).append(run.id)
    return [
        ChronicleUse(**asdict(one), is_shipped=key in shipped, runs=runs.get(key, []))
        for key, one in sorted((used | shipped).items())
    ]
