"""Which chronicles are there, is a text one, and how is it stored, laid out and tried? Routes about chronicles.

A text is stored under the name of a chronicle that it declares, and its version is its entity tag.
"""

import re
from collections.abc import Iterable
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Depends, Header, HTTPException, Path, Request
from msgspec.structs import asdict
from starlette.responses import Response

from chronicles.errors import ChronicleError
from chronicles.language.formatter import format_text
from dyknow.language.diagnostics import render_all
from dyknow.language.rendering import render_json
from service.api.messages.answers import TEXT_BODY, answers, json_answer
from service.api.messages.asked import DifferenceOrder, TrialOrder
from service.api.messages.bodies import ChronicleList, ChronicleUse, Findings, LaidOut, TextVersions
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import difference, trial
from service.errors import NotInLogError, QueryError, TextRefusedError, VersionError
from service.questions.recognition.trials import Difference, Trial
from service.records.runs import ChronicleRecord
from service.store.entries import ChronicleText
from service.store.log import EventLog
from service.store.registers.chronicle_texts import ChronicleTexts
from service.texts.chronicle_files import check_chronicles, chronicle_names

TEXT_NAME = "text"  # what findings call a text that came without a name
MAX_TEXT_BYTES = 256_000

_TAG = re.compile(r'"([1-9][0-9]{0,8})"', re.ASCII)
_TEXT = "/chronicles/{name}"


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
ChronicleName = Annotated[str, Path(pattern="^[A-Za-z_][A-Za-z0-9_]{0,63}$", description="A chronicle of the text.")]
IfMatch = Annotated[str | None, Header(description="The version that is changed, in quotation marks.")]
IfNoneMatch = Annotated[str | None, Header(description="`*`: only if there is none; of GET, the version known.")]


def add_chronicles(router: APIRouter, log: EventLog, pool: ProcessPool, library: Iterable[ChronicleRecord]) -> None:
    """Add the routes about chronicles.

    Parameters
    ----------
    library : the chronicles that come with DyKnow.
    """
    texts, shipped = ChronicleTexts(log), tuple(library)

    @router.get("/chronicles", name="chronicles", responses=answers(ChronicleList, 422))
    def list_chronicles() -> Response:
        """List the shipped chronicles, those of the log's runs, and the texts that the log holds."""
        return json_answer(ChronicleList(_merge_chronicles(log, shipped), texts.current()))

    _add_looks(router, pool)
    _add_stored(router, texts)  # last, as `{name}` fits the paths above too


def _add_looks(router: APIRouter, pool: ProcessPool) -> None:
    """Add the routes that look at a text, and write nothing."""
    laid_out, tried, compared = answers(LaidOut, 413, 422), answers(Trial, 400, 404, 409, 413, 422), answers(Difference)

    @router.post("/chronicles/check", name="check", responses=answers(Findings, 413, 422), openapi_extra=TEXT_BODY)
    def check_text(text: SentText) -> Response:
        """Find what is wrong or doubtful in a chronicle text.

        The body is the text, UTF-8. The answer is 200 whatever is found in it.
        """
        checked = check_chronicles([(TEXT_NAME, text)])
        return json_answer(f'{{"findings":{render_json(checked.findings)}}}'.encode())

    @router.post("/chronicles/format", name="format", responses=laid_out, openapi_extra=TEXT_BODY)
    def lay_out(text: SentText) -> Response:
        """Lay a text out in the one way, comments kept."""
        try:
            return json_answer(LaidOut(format_text(text, "text")))
        except ChronicleError as error:
            raise TextRefusedError(str(error), error.diagnostics) from error

    @router.post("/chronicles/try", name="try", responses=tried)
    async def try_text(order: TrialOrder) -> Response:
        """Say what a text would recognise in a window of the log, and how near it came to more; nothing is written."""
        await to_thread.run_sync(_check, "text", order.text)
        return json_answer(await pool.ask(trial, order.question(), order.text))

    @router.post("/chronicles/diff", name="diff", responses=tried | compared)
    async def compare_texts(order: DifferenceOrder) -> Response:
        """Say which events of a window one text would recognise and another one not, or at another time."""
        for name, text in (("before", order.before), ("after", order.after)):
            await to_thread.run_sync(_check, name, text)
        return json_answer(await pool.ask(difference, order.question(), order.before, order.after))


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


def _add_stored(router: APIRouter, texts: ChronicleTexts) -> None:
    stored = answers(ChronicleText, 404, 412, 413, 422, 428)

    @router.get(_TEXT, name="text", responses=stored | {304: {"description": "The client has the newest version."}})
    def get_text(name: ChronicleName, if_none_match: IfNoneMatch = None) -> Response:
        """Get the newest version of a text."""
        newest = texts.versions(name)[-1]
        if newest.text is None:
            raise NotInLogError(
                f"chronicle text {name!r}: expected one that has not ended, got version {newest.version}"
            )
        is_known = f'"{newest.version}"' in (if_none_match or "").replace(" ", "").split(",")
        return Response(status_code=304, headers=_tag(newest.version)) if is_known else _tagged(newest)

    @router.get(f"{_TEXT}/versions", name="text_versions", responses=answers(TextVersions, 404, 422))
    def list_versions(name: ChronicleName) -> Response:
        """List all versions of a text, oldest first."""
        return json_answer(TextVersions(texts.versions(name)))

    created = answers(ChronicleText, status=201)

    @router.put(_TEXT, name="text", responses=stored | created, openapi_extra=TEXT_BODY)
    def put_text(
        name: ChronicleName, text: SentText, if_match: IfMatch = None, if_none_match: IfNoneMatch = None
    ) -> Response:
        """Store a text, which declares this chronicle, as its first version or in place of the newest one."""
        expected = None if if_match is None and if_none_match == "*" else _expected(if_match)
        declared = _check(name, text)
        if name not in declared:
            message = f"body: expected a text that declares chronicle {name!r}, got {', '.join(declared)}"
            raise QueryError(message, parameter="body")
        return _tagged(texts.put(name, text, expected), 201 if expected is None else 200)

    @router.delete(_TEXT, name="text", status_code=204, responses=answers(ChronicleText, 412, 422, 428, status=204))
    def end_text(name: ChronicleName, if_match: IfMatch = None) -> Response:
        """End a text, so that it is in use no more; its versions stay."""
        return Response(status_code=204, headers=_tag(texts.end(name, _expected(if_match)).version))


def _expected(if_match: str | None) -> int:
    """Read which version a client takes for the newest one."""
    if if_match is None:
        raise HTTPException(428, "If-Match: expected the version that is changed, or If-None-Match: *, got neither")
    tag = _TAG.fullmatch(if_match.strip())
    if tag is None:
        raise VersionError(f'If-Match: expected one version, such as "3", got {if_match!r}')
    return int(tag[1])


def _check(name: str, text: str) -> tuple[str, ...]:
    """Refuse a text with errors, or without a chronicle, as one about traffic; name its chronicles."""
    if "\0" in text:
        raise QueryError(f"{name}: expected a text, got a NUL character", parameter="body")
    checked = check_chronicles([(name, text)], "traffic")
    if checked.errors:
        raise TextRefusedError(render_all(checked.findings), checked.findings)
    names = chronicle_names(name, text)
    if not names:
        raise QueryError(f"{name}: expected a text with a chronicle, got one without", parameter="body")
    return names


def _tagged(one: ChronicleText, status: int = 200) -> Response:
    return json_answer(one, status, _tag(one.version))


def _tag(version: int) -> dict[str, str]:
    return {"ETag": f'"{version}"'}
