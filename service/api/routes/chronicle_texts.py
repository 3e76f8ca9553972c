"""How are chronicle texts stored, laid out and tried? Routes that take texts.

A text is stored under the name of a chronicle that it declares, and its version is its entity tag.
"""

import re
from functools import partial
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Path, Request
from starlette.responses import Response

from chronicles.errors import ChronicleError
from chronicles.language.formatter import format_text
from dyknow.language.diagnostics import render_all
from service.api.bodies import DifferenceRequest, LaidOut, TextVersions, TrialRequest, Window
from service.api.explanations import Explanations
from service.api.openapi import answers, takes
from service.api.routes.answering import json_answer, read_json, read_text, refuse_parameters
from service.errors import NotInLogError, QueryError, TextRefusedError, VersionError
from service.questions.explaining import AbsenceQuestion
from service.questions.trials import Difference, Trial
from service.store.chronicle_texts import ChronicleText, ChronicleTexts
from service.store.log import EventLog
from service.texts.chronicle_files import check_chronicles, chronicle_names
from service.times import parse_media_us

ChronicleName = Annotated[str, Path(pattern="^[A-Za-z_][A-Za-z0-9_]{0,63}$", description="A chronicle of the text.")]
IfMatch = Annotated[str | None, Header(description="The version that is changed, in quotation marks.")]
IfNoneMatch = Annotated[str | None, Header(description="`*`: only if there is none; of GET, the version known.")]

_TAG = re.compile(r'"([1-9][0-9]{0,8})"', re.ASCII)
_TEXT = "/api/v1/chronicles/{name}"


def add_chronicle_texts(router: APIRouter, log: EventLog, explanations: Explanations) -> None:
    """Add the routes that store texts, and those that lay out and try them."""
    _add_stored(router, partial(ChronicleTexts, log.place.url))

    @router.post(
        "/api/v1/chronicles/format",
        name="format",
        summary="Lay a chronicle text out",
        responses=answers(LaidOut, 413, 422),
        openapi_extra=takes(str),
    )
    async def lay_out(request: Request) -> Response:
        """Lay a text out in the one way, comments kept."""
        refuse_parameters(request)
        text = await read_text(request)
        try:
            return json_answer(LaidOut(await to_thread.run_sync(format_text, text, "text")))
        except ChronicleError as error:
            raise TextRefusedError(str(error), error.diagnostics) from error

    @router.post(
        "/api/v1/chronicles/try",
        name="try",
        summary="Try a chronicle text on a run",
        description="What it would recognise in a window of the log, and its near misses. Nothing is written.",
        responses=answers(Trial, 400, 404, 409, 413, 422),
        openapi_extra=takes(TrialRequest),
    )
    async def try_text(request: Request) -> Response:
        """Answer with the events of a text, and how near it came to more."""
        refuse_parameters(request)
        asked = await read_json(request, TrialRequest)
        await _check("text", asked.text)
        return json_answer(await explanations.trial(_question(asked, asked.limit), asked.text))

    @router.post(
        "/api/v1/chronicles/diff",
        name="diff",
        summary="Compare two chronicle texts on a run",
        description="Which events of a window one would recognise and the other not, or at another time.",
        responses=answers(Difference, 400, 404, 409, 413, 422),
        openapi_extra=takes(DifferenceRequest),
    )
    async def compare_texts(request: Request) -> Response:
        """Answer with what is gained, lost and moved."""
        refuse_parameters(request)
        asked = await read_json(request, DifferenceRequest)
        for name in ("before", "after"):
            await _check(name, getattr(asked, name))
        return json_answer(await explanations.difference(_question(asked), asked.before, asked.after))


def _add_stored(router: APIRouter, opened: "partial[ChronicleTexts]") -> None:
    @router.get(_TEXT, name="text", summary="Get a chronicle text", responses=answers(ChronicleText, 404, 422))
    def get_text(name: ChronicleName, request: Request, if_none_match: IfNoneMatch = None) -> Response:
        """Answer with the newest version, or with 304 if the client has it."""
        refuse_parameters(request)
        with opened() as texts:
            newest = texts.versions(name)[-1]
        if newest.text is None:
            raise NotInLogError(
                f"chronicle text {name!r}: expected one that has not ended, got version {newest.version}"
            )
        if f'"{newest.version}"' in (if_none_match or "").replace(" ", "").split(","):
            return Response(status_code=304, headers=_tag(newest.version))
        return _tagged(newest)

    @router.get(
        f"{_TEXT}/versions",
        name="text_versions",
        summary="List the versions of a chronicle text",
        responses=answers(TextVersions, 404, 422),
    )
    def list_versions(name: ChronicleName, request: Request) -> Response:
        """Answer with all versions, oldest first."""
        refuse_parameters(request)
        with opened() as texts:
            return json_answer(TextVersions(texts.versions(name)))

    @router.put(
        _TEXT,
        name="text",
        summary="Store a chronicle text",
        description="The body is the text, UTF-8, which declares the chronicle that the path names.",
        responses=answers(ChronicleText, 412, 413, 422, 428) | answers(ChronicleText, status=201),
        openapi_extra=takes(str),
    )
    async def put_text(
        name: ChronicleName, request: Request, if_match: IfMatch = None, if_none_match: IfNoneMatch = None
    ) -> Response:
        """Store a text as the first version of its name, or in place of the newest one."""
        refuse_parameters(request)
        expected = _expected(if_match, if_none_match)
        text = await read_text(request)
        declared = await _check(name, text)
        if name not in declared:
            message = f"body: expected a text that declares chronicle {name!r}, got {', '.join(declared)}"
            raise QueryError(message, parameter="body")

        def put() -> Response:
            with opened() as texts:
                version = texts.put(name, text, expected)
                newest = next(one for one in texts.versions(name) if one.version == version)
            return _tagged(newest, 201 if expected is None else 200)

        return await to_thread.run_sync(put)

    @router.delete(
        _TEXT,
        name="text",
        summary="End a chronicle text",
        description="Its versions stay.",
        status_code=204,
        responses=answers(ChronicleText, 412, 422, 428, status=204),
    )
    def end_text(name: ChronicleName, request: Request, if_match: IfMatch = None) -> Response:
        """End a text, so that it is in use no more."""
        refuse_parameters(request)
        expected = _expected(if_match, None)
        assert expected is not None
        with opened() as texts:
            return Response(status_code=204, headers=_tag(texts.end(name, expected)))


def _expected(if_match: str | None, if_none_match: str | None) -> int | None:
    """Read which version a client takes for the newest one; None for none."""
    if if_match is None and if_none_match == "*":
        return None
    if if_match is None:
        raise HTTPException(428, "If-Match: expected the version that is changed, or If-None-Match: *, got neither")
    tag = _TAG.fullmatch(if_match.strip())
    if tag is None:
        raise VersionError(f'If-Match: expected one version, such as "3", got {if_match!r}')
    return int(tag[1])


async def _check(name: str, text: str) -> tuple[str, ...]:
    """Refuse a text with errors, or without a chronicle, as one about traffic; name its chronicles."""
    if "\0" in text:
        raise QueryError(f"{name}: expected a text, got a NUL character", parameter="body")
    checked = await to_thread.run_sync(check_chronicles, [(name, text)], "traffic")
    names = chronicle_names(name, text) or ()
    if checked.errors:
        raise TextRefusedError(render_all(checked.findings), checked.findings)
    if not names:
        raise QueryError(f"{name}: expected a text with a chronicle, got one without", parameter="body")
    return names


def _question(window: Window, limit: int = 1) -> AbsenceQuestion:
    start_us, end_us = (
        None if value is None else parse_media_us(str(value), parameter=name)
        for name, value in (("from", window.from_), ("to", window.to))
    )
    return AbsenceQuestion(chronicle="", run=window.run, roles={}, start_us=start_us, end_us=end_us, limit=limit)


def _tagged(one: ChronicleText, status: int = 200) -> Response:
    answer = json_answer(one)
    answer.status_code = status
    answer.headers.update(_tag(one.version))
    return answer


def _tag(version: int) -> dict[str, str]:
    return {"ETag": f'"{version}"'}
