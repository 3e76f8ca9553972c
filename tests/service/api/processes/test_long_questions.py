"""Is a question that takes long ended, without holding up the others?"""

import asyncio
import os
import pickle
from pathlib import Path

import anyio
import httpx
import msgspec
import pytest

from service.api.app import create_app
from service.api.messages.bodies import Problem
from service.api.processes.pool import ProcessPool
from service.api.processes.questions import why, why_not
from service.errors import LogError, QueryError, UnansweredError
from service.questions.recognition.explaining import AbsenceQuestion
from tests.service.api.processes.acting import begin, end, stay
from tests.service.http import Client
from tests.service.logs import write_log

pytestmark = pytest.mark.long

_NO_QUESTION = AbsenceQuestion(chronicle="nothing", roles={})


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("long") / "a.db"
    write_log(path, [])
    return path


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("explanations.why", "r1-1/why"),
        pytest.param("events.summary", "summary?by=actor", marks=pytest.mark.slow),
        pytest.param("media.clip", "r1-1/clip.mp4", marks=pytest.mark.slow),
    ],
)
def test_a_question_that_takes_too_long_is_a_problem_and_the_next_is_answered(
    log: Path, monkeypatch: pytest.MonkeyPatch, name: str, path: str
) -> None:
    monkeypatch.setattr("service.api.processes.pool.ANSWERED_WITHIN_S", 0.5)
    with Client(create_app(str(log), shipped=[])) as client:
        monkeypatch.setattr(f"service.api.routes.{name}", stay)
        answer = client.get(f"/api/v1/events/{path}")
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "1")
        told = msgspec.json.decode(answer.content, type=Problem)
        assert told.type == "urn:dyknow:problem:unanswered"
        assert told.detail.startswith("answer: expected one within 0.5 s, got none; ask about less time")
        # On a busy machine a process that begins anew takes a while.
        monkeypatch.setattr("service.api.processes.pool.fail_after", lambda _: anyio.fail_after(60))
        assert client.get("/api/v1/chronicles/overtake/why-not").status_code == 404


def test_a_process_that_is_ended_from_outside_is_a_problem_and_the_next_is_there(log: Path) -> None:
    async def ask() -> None:
        pool = ProcessPool(str(log))
        with pytest.raises(UnansweredError, match="a process that was ended"):
            await pool.ask(end)
        assert await pool.ask(why, "r1-99") is None

    asyncio.run(ask())


def test_errors_come_from_the_process_as_they_are(log: Path) -> None:
    async def ask() -> None:
        pool = ProcessPool(str(log))
        with pytest.raises(LogError, match="expected one of its chronicles, got 'nothing'"):
            await pool.ask(why_not, _NO_QUESTION)

    asyncio.run(ask())
    error = pickle.loads(pickle.dumps(QueryError("limit: ...", parameter="limit")))
    assert (str(error), error.parameter) == ("limit: ...", "limit")


def test_others_are_answered_while_a_question_takes_long(log: Path, tmp_path: Path) -> None:
    app = create_app(str(log), shipped=[])
    transport = httpx.ASGITransport(app=app)

    async def ask() -> None:
        pool = ProcessPool(str(log))
        begun = [tmp_path / f"begun{number}" for number in range(os.cpu_count() or 1)]
        long = [asyncio.create_task(pool.ask(begin, str(one))) for one in begun]
        while not all(one.exists() for one in begun):
            await asyncio.sleep(0.01)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            assert (await client.get("/healthz")).text == "ok\n"
            assert (await client.get("/api/v1/events")).status_code == 200
        assert not any(one.done() for one in long)
        for one in long:
            one.cancel()
        await asyncio.gather(*long, return_exceptions=True)

    asyncio.run(ask())
