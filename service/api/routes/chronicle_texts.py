"""How are chronicle texts stored, laid out and tried? Routes that take texts.

A text is stored under the name of a chronicle that it declares, and its version is its entity tag.
"""

import re
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Path
from starlette.responses import Response

from chronicles.errors import ChronicleError
from chronicles.language.formatter import format_text
from dyknow.language.diagnostics import render_all
from service.api.messages.answers import TEXT_BODY, answers, json_answer
from service.api.messages.asked import DifferenceOrder, TrialOrder
from service.api.messages.bodies import LaidOut, TextVersions
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import difference, trial
from service.api.routes.chronicles import SentText
from service.errors import NotInLogError, QueryError, TextRefusedError, VersionError
from service.questions.recognition.trials import Difference, Trial
from service.store.entries import ChronicleText
from service.store.log import EventLog
from service.store.registers.chronicle_texts import ChronicleTexts
from service.texts.chronicle_files import check_chronicles, chronicle_names

ChronicleName = Annotated[str, Path(pattern="^[A-Za-z_][A-Za-z0-9_]{0,63}$", description="A chronicle of the text.")]
IfMatch = Annotated[str | None, Header(description="The version that is changed, in quotation marks.")]
IfNoneMatch = Annotated[str | None, Header(description="`*`: only if there is none; of GET, the version known.")]

_TAG = re.compile(r'"([1-9][0-9]{0,8})"', re.ASCII)
_TEXT = "/chronicles/{name}"


def add_chronicle_texts(router: APIRouter, log: EventLog, pool: ProcessPool) -> None:
    """Add the routes that store texts, and those that lay out and try them."""
    laid_out, tried, compared = answers(LaidOut, 413, 422), answers(Trial, 400, 404, 409, 413, 422), answers(Difference)

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

    _add_stored(router, ChronicleTexts(log))  # last, as `{name}` fits the paths above too


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
