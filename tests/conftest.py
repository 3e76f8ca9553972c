"""What `dyknow demo` makes and prints, made once and shared by all tests that need a scene or its log."""

import contextlib
import fcntl
import gc
import io
import os
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.cli.app import run

# The process that hands the tests out reads this file too and runs none, so what is heavy is imported where it is used.

SECONDS = 16
"""Of the demo's 60: four overtakes are over by then, and a longer clip begins with the shorter one's pictures."""

LONG_TO_MAKE = {"demo", "postgres"}
"""Fixtures whose tests `make test` leaves to `make test-long`."""


@dataclass(frozen=True, slots=True)
class Demo:
    """The folder of a demo, and what it printed."""

    folder: Path
    printed: str

    @property
    def scene(self) -> Path:
        """Return the folder with video, site, network and truth."""
        return self.folder / "scene"

    @property
    def log(self) -> Path:
        """Return the log of the library's chronicles."""
        return self.folder / "log.db"


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave modules and tests out of all searches for garbage: they pile up here, and stay to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark what needs something that takes long to make, whichever fixtures lead there."""
    if not LONG_TO_MAKE.isdisjoint(getattr(item, "fixturenames", ())):
        item.add_marker(pytest.mark.long)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Look for no examples in the docstrings of tests, only of what they share: it takes a second in each process."""
    found = yield
    return [one for one in found if type(one) is pytest.Module] or found


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with a file that needs the demo: while it is made, the other workers have tests that do not wait for it."""
    first = next((item.path for item in items if "demo" in getattr(item, "fixturenames", ())), None)
    items.sort(key=lambda item: item.path != first)


@pytest.fixture(scope="session", autouse=True)
def patient_pool() -> Iterator[None]:
    """Let answers of processes take their time on a busy machine; tests of the time limit give one of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("service.api.processes.pool.ANSWERED_WITHIN_S", 3600.0)
        yield


@pytest.fixture(scope="session", autouse=True)
def one_loop() -> Iterator[None]:
    """End what the clients of the tests share."""
    yield
    from tests.service.http import close_loop

    close_loop()


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], str]) -> tuple[Path, str]:
    """Let one of all workers of pytest-xdist make what is in a folder, into which nobody else writes.

    Returns
    -------
    The folder, and what `make` said.
    """
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    folder.mkdir(exist_ok=True)
    said = folder / "said.txt"  # written last: with it the folder is whole
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            said.write_text(make(folder), encoding="utf-8")
    return folder, said.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Demo:
    """Make the demo."""

    def make(folder: Path) -> str:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            assert run(["demo", "--out", str(folder), "--seconds", str(SECONDS)]) == 0
        return printed.getvalue()

    return Demo(*made_once(tmp_path_factory, "demo", make))


@pytest.fixture(scope="session")
def scene(demo: Demo) -> Path:
    return demo.scene


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the demo's scene in small pictures, a quarter of the work: the truth is the same, vision cannot use them."""
    from data_gen.outputs.scene import generate

    def make(folder: Path) -> str:
        small = generate(
            "rural_overtaking", seed=3, duration_us=SECONDS * 1_000_000, out_dir=folder, width_px=320, height_px=180
        )
        return str(small.frame_count)

    return made_once(tmp_path_factory, "small_scene", make)[0]


@pytest.fixture(scope="session")
def tracks_log(small_scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Process the true trajectories of the scene; nobody writes into their log."""
    from service.runs.processing import RunRequest, process

    def make(folder: Path) -> str:
        return process(RunRequest(small_scene / "truth.csv", small_scene / "site.toml", str(folder / "log.db"))).status

    return made_once(tmp_path_factory, "tracks_log", make)[0] / "log.db"
