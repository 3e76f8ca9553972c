"""Which chronicles are there, and is a text one? Routes about chronicles and their texts."""

from collections.abc import Iterable
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Query, Request
from msgspec.structs import asdict
from starlette.responses import Response

from dyknow.language.rendering import render_json
from service.api.messages.answers import FINDINGS, TEXT_BODY, answers, json_answer
from service.api.messages.asked import NoParameters
from service.api.messages.bodies import ChronicleList, ChronicleUse
from service.errors import QueryError
from service.records.runs import ChronicleRecord
from service.store.log import EventLog
from service.store.registers.chronicle_texts import ChronicleTexts
from service.texts.chronicle_files import check_chronicles

TEXT_NAME = "text"  # what findings call a text that came without a name
MAX_TEXT_BYTES = 256_000


async def read_text(request: Request) -> str:
    """Read the body of a request as a text.

    Raises
    ------
    HTTPException
        If it is too large: 413.
    QueryError
        If it is not UTF-8.
    """
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > MAX_TEXT_BYTES:
            raise HTTPException(413, f"body: expected at most {MAX_TEXT_BYTES} bytes, got more")
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise QueryError(f"body: expected UTF-8 text, got byte {body[error.start]:#04x}", parameter="body") from error


SentText = Annotated[str, Depends(read_text)]


def add_chronicles(router: APIRouter, log: EventLog, library: tuple[ChronicleRecord, ...]) -> None:
    """Add the routes about chronicles.

    Parameters
    ----------
    library : the chronicles that come with DyKnow.
    """

    @router.get("/chronicles", name="chronicles", responses=answers(ChronicleList, 422))
    def list_chronicles(asked: Annotated[NoParameters, Query()]) -> Response:
        """List the shipped chronicles, those of the log's runs, and the texts that the log holds."""
        return json_answer(ChronicleList(_merge_chronicles(log, library), ChronicleTexts(log).current()))

    @router.post("/chronicles/check", name="check", responses=answers(FINDINGS, 413, 422), openapi_extra=TEXT_BODY)
    def check_text(text: SentText) -> Response:
        """Find what is wrong or doubtful in a chronicle text.

        The body is the text, UTF-8. The answer is 200 whatever is found in it.
        """
        checked = check_chronicles([(TEXT_NAME, text)])
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
